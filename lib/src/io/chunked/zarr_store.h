#pragma once
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "covol/error.h"

// Reads files of a Zarr store. Their contents are untrusted, because the store may come from anyone.
namespace covol::detail {

using Json = nlohmann::json;

/// An array of bytes that are not initialized, so that large arrays occupy physical memory only where they are written.
class Bytes {
public:
    Bytes() = default;
    explicit Bytes(std::uint64_t size) : data_(new char[size]), size_(size) {}
    [[nodiscard]] char* data() noexcept { return data_.get(); }
    [[nodiscard]] const char* data() const noexcept { return data_.get(); }
    [[nodiscard]] std::uint64_t size() const noexcept { return size_; }
    /// @pre size <= size()
    void shrink(std::uint64_t size) noexcept { size_ = size; }

private:
    std::unique_ptr<char[]> data_;
    std::uint64_t size_ = 0;
};

/// A file that is open for reading. It is not mapped, because accessing mapped memory would crash if another process
/// truncated the file.
class StoreFile {
public:
    /// Opens a file. @returns nothing if there is no such file. @throws Error Io.
    static std::optional<StoreFile> open(const std::string& path);
    StoreFile(StoreFile&& other) noexcept;
    StoreFile& operator=(StoreFile&&) = delete;
    StoreFile(const StoreFile&) = delete;
    StoreFile& operator=(const StoreFile&) = delete;
    ~StoreFile();

    [[nodiscard]] std::uint64_t size() const noexcept { return size_; }
    /// Reads `count` bytes from the position `begin`. @throws Error InvalidInput if the file has fewer bytes, Io.
    [[nodiscard]] Bytes read(std::uint64_t begin, std::uint64_t count) const;

private:
    StoreFile(std::string path, int file, std::uint64_t size) : path_(std::move(path)), file_(file), size_(size) {}
    std::string path_;
    int file_;
    std::uint64_t size_;
};

/// Reads a JSON file. @returns nothing if there is no such file. @throws Error InvalidInput (not JSON, or larger or
/// more deeply nested than metadata can be), Io.
std::optional<Json> read_json(const std::string& path);

/// Parses a JSON object. @param path  of the text, for messages @throws Error InvalidInput.
Json parse_json(const std::string& path, std::string_view text);

/// The value of a key; null if there is none, or if `object` is not an object.
const Json& member(const Json& object, const char* key);
/// The text of a string; empty if `value` is not a string.
std::string text_of(const Json& value);

/// The path `inside` relative to `folder`. @throws Error InvalidInput, which names the metadata file `path`, if the
/// result would be outside of `folder`.
std::string path_within(const std::string& path, const std::string& folder, const std::string& inside);

}  // namespace covol::detail
