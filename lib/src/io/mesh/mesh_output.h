#pragma once
// What the writers of mesh files share.
#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "covol/mesh_io.h"

namespace covol::mesh_io {

static_assert(std::endian::native == std::endian::little, "binary mesh files are written in the machine's byte order");

/// A text or binary file that is put together in memory.
class Output {
public:
    Output& operator<<(std::string_view text) {
        data_ += text;
        return *this;
    }
    Output& operator<<(float number) { return append(number); }
    Output& operator<<(std::uint64_t number) { return append(number); }
    template <typename T>
    void raw(const T& value) {
        const auto* bytes = reinterpret_cast<const char*>(&value);
        data_.append(bytes, sizeof(T));
    }
    void pad(std::size_t multiple, char fill) {
        while (data_.size() % multiple != 0) data_ += fill;
    }
    [[nodiscard]] const std::string& data() const { return data_; }

private:
    template <typename T>
    Output& append(T number) {
        std::array<char, 32> text{};
        const auto end = std::to_chars(text.data(), text.data() + text.size(), number).ptr;
        data_.append(text.data(), end);
        return *this;
    }
    std::string data_;
};

inline Output& operator<<(Output& out, const std::array<float, 3>& p) {
    return out << p[0] << " " << p[1] << " " << p[2];
}

/// What every format needs: placed vertices, their normals, one-line comments.
struct Prepared {
    TriangleMesh mesh;
    std::vector<std::array<float, 3>> normals;
    std::vector<std::string> comments;
    std::vector<VertexAttribute> attributes;
    bool binary;
};

}  // namespace covol::mesh_io
