#pragma once
// Code that is common to the writers of mesh files.
#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "covol/error.h"
#include "covol/mesh_io.h"

namespace covol::mesh_io {

static_assert(std::endian::native == std::endian::little, "binary mesh files are written in the machine's byte order");

/// A text or binary file that is being written, in memory or to the disk through a buffer.
class Output {
public:
    Output() = default;
    /// @param name  of the file in error messages
    /// @throws Error Io if the file cannot be written; all other functions throw this error, too.
    Output(const std::string& path, std::string name) : name_(std::move(name)), file_(path, std::ios::binary) {
        check();
    }

    Output& operator<<(std::string_view text) {
        data_ += text;
        return kept();
    }
    Output& operator<<(float number) { return append(number); }
    Output& operator<<(double number) { return append(number); }
    Output& operator<<(std::uint64_t number) { return append(number); }
    template <typename T>
    void raw(const T& value) {
        const auto* bytes = reinterpret_cast<const char*>(&value);
        data_.append(bytes, sizeof(T));
        kept();
    }
    void pad(std::size_t multiple, char fill) {
        while ((flushed_ + data_.size()) % multiple != 0) data_ += fill;
    }
    /// The contents of the buffer: all bytes if there is no file on the disk, otherwise the bytes that are not written
    /// to the file yet.
    [[nodiscard]] const std::string& data() const { return data_; }
    /// Number of bytes written so far.
    [[nodiscard]] std::uint64_t size() const { return flushed_ + data_.size(); }
    void close() {
        flush();
        file_.close();
        check();
    }

private:
    Output& kept() {
        constexpr std::size_t kPiece = 1U << 20;
        if (data_.size() >= kPiece && file_.is_open()) flush();
        return *this;
    }
    void flush() {
        file_.write(data_.data(), std::streamsize(data_.size()));
        check();
        flushed_ += data_.size();
        data_.clear();
    }
    void check() const {
        if (!file_) throw Error(Errc::Io, name_ + ": cannot be written");
    }
    template <typename T>
    Output& append(T number) {
        std::array<char, 32> text{};
        const auto end = std::to_chars(text.data(), text.data() + text.size(), number).ptr;
        data_.append(text.data(), end);
        return kept();
    }
    std::string data_, name_;
    std::ofstream file_;
    std::uint64_t flushed_ = 0;
};

template <typename Real>
Output& operator<<(Output& out, const std::array<Real, 3>& p) {
    return out << p[0] << " " << p[1] << " " << p[2];
}

/// Writes positions: in single precision if the mesh's origin is 0, otherwise in double precision, with the origin
/// added.
class PositionWriter {
public:
    explicit PositionWriter(const Vec3& origin) : origin_(origin) {}
    [[nodiscard]] bool is_far() const { return origin_ != Vec3{0, 0, 0}; }
    [[nodiscard]] const Vec3& origin() const { return origin_; }
    [[nodiscard]] Vec3 whole(const std::array<float, 3>& p) const {
        return {origin_[0] + p[0], origin_[1] + p[1], origin_[2] + p[2]};
    }
    void raw(Output& out, const std::array<float, 3>& p) const { is_far() ? out.raw(whole(p)) : out.raw(p); }
    void text(Output& out, const std::array<float, 3>& p) const { is_far() ? out << whole(p) : out << p; }

private:
    Vec3 origin_;
};

/// The input of all writers: scaled and rotated vertices, normals if there are any, and one-line comments.
struct Prepared {
    const std::vector<std::array<std::uint32_t, 3>>& triangles;
    std::vector<std::array<float, 3>> vertices;
    PositionWriter places;
    std::vector<std::array<float, 3>> normals;
    std::vector<std::string> comments;
    std::vector<VertexAttribute> attributes;
    bool binary;
};

}  // namespace covol::mesh_io
