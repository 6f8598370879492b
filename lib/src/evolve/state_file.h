#pragma once
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <string>
#include <type_traits>
#include <vector>

namespace covol::detail {

/// Writes the numbers of a computation to a file and reads them back: the sequence of calls that writes a file also
/// reads it. In the machine's byte order, with a checksum at the end.
class StateFile {
public:
    enum class Mode { Write, Read };
    /// @throws Error Io; InvalidInput (no such file, or a damaged one).
    StateFile(const std::string& path, Mode mode);

    [[nodiscard]] bool reads() const { return mode_ == Mode::Read; }

    template <typename T>
    void value(T& v) {
        static_assert(std::is_trivially_copyable_v<T>);
        bytes(&v, sizeof v);
    }
    /// Writes or reads `count` values. The file does not contain the count, so the caller must know it.
    template <typename T>
    void array(T* values, std::size_t count) {
        static_assert(std::is_trivially_copyable_v<T>);
        bytes(values, count * sizeof(T));
    }
    template <typename T>
    void list(std::vector<T>& values) {
        std::uint64_t count = values.size();
        value(count);
        if (reads()) {
            expect(count * sizeof(T), count);
            values.resize(count);
        }
        array(values.data(), values.size());
    }
    /// Writes the number, or compares it with the one in the file. @throws Error InvalidInput if they differ.
    void same(std::uint64_t number);
    /// To be called after the last value. @throws Error Io, InvalidInput.
    void finish();

private:
    void bytes(void* data, std::size_t count);
    /// Called before memory is allocated: fails unless the file has that many more bytes.
    void expect(std::uint64_t bytes, std::uint64_t count) const;
    [[noreturn]] void fail() const;

    std::string path_;
    Mode mode_;
    std::fstream file_;
    std::uint64_t left_ = 0;  ///< bytes that are not read yet, without the checksum
    std::uint32_t checksum_ = 0;
};

}  // namespace covol::detail
