#pragma once
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "covol/error.h"

// Files of a Zarr store. Whatever stands in them may be wrong on purpose.
namespace covol::detail {

using Json = nlohmann::json;

/// Memory that takes none until it is written to.
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

/// A file, open for reading. It is not mapped: it may be cut short while it is read.
class StoreFile {
public:
    /// @returns nothing when there is no such file. @throws Error Io.
    static std::optional<StoreFile> open(const std::string& path);
    StoreFile(StoreFile&& other) noexcept;
    StoreFile& operator=(StoreFile&&) = delete;
    StoreFile(const StoreFile&) = delete;
    StoreFile& operator=(const StoreFile&) = delete;
    ~StoreFile();

    [[nodiscard]] std::uint64_t size() const noexcept { return size_; }
    /// @throws Error InvalidInput when fewer bytes are there, Io.
    [[nodiscard]] Bytes read(std::uint64_t begin, std::uint64_t count) const;

private:
    StoreFile(std::string path, int file, std::uint64_t size) : path_(std::move(path)), file_(file), size_(size) {}
    std::string path_;
    int file_;
    std::uint64_t size_;
};

/// @returns nothing when there is no such file.
/// @throws Error InvalidInput (no JSON, or one that is larger or deeper than metadata can be), Io.
std::optional<Json> read_json(const std::string& path);

/// An object. @throws Error InvalidInput, with `path`, the text's.
Json parse_json(const std::string& path, std::string_view text);

/// The value of a key; null when there is none, or `object` is none.
const Json& member(const Json& object, const char* key);
/// A string; empty when it is none.
std::string text_of(const Json& value);

/// `inside` below `folder`. @throws Error InvalidInput when it leads out of it: from `path`'s metadata.
std::string path_within(const std::string& path, const std::string& folder, const std::string& inside);

}  // namespace covol::detail
