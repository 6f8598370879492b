#pragma once
// Code that is common to the readers of mesh files: their input, and the interface that receives the contents.
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "base/text.h"
#include "covol/error.h"
#include "covol/fwd.h"

namespace covol::mesh_io {

/// A file in memory that is read as lines or as bytes. Error messages state the number of the line.
class Source {
public:
    /// @pre path and text outlive this object
    Source(const std::string& path, std::string_view text) : path_(path), lines_(text) {}

    [[nodiscard]] bool at_end() const { return lines_.rest().empty(); }
    [[nodiscard]] std::size_t bytes_left() const { return lines_.rest().size(); }
    [[nodiscard]] std::string_view rest() const { return lines_.rest(); }

    /// The next line, without the blanks at both ends.
    std::string_view line() {
        std::string_view line;
        if (!lines_.next(line)) fail("unexpected end of the file");
        return line;
    }

    /// The next line that is neither blank nor a comment, without the comment at its end; false at the end of the file.
    bool next_content(std::string_view& line) { return lines_.next_content(line); }
    std::string_view content_line() {
        std::string_view line;
        if (!lines_.next_content(line)) fail("unexpected end of the file");
        return line;
    }

    /// The next `count` bytes. After this call, error messages state no line, because the file is binary.
    std::string_view bytes(std::size_t count) {
        is_text_ = false;
        if (count > bytes_left()) fail("the file is truncated");
        const std::string_view result = lines_.rest().substr(0, count);
        lines_.skip(count);
        return result;
    }

    template <typename T>
    T number(std::string_view& line, const char* what) {
        const std::string_view word = detail::next_word(line);
        const auto value = detail::to_number<T>(word);
        if (!value)
            fail(std::string("expected ") + what + ", got " +
                 (word.empty() ? "the end of the line" : detail::quote(word)));
        return *value;
    }

    /// The first three numbers of `line`. @throws Error InvalidInput if there are fewer.
    Vec3 three_numbers(std::string_view line) {
        Vec3 p{};
        for (std::size_t a = 0; a < 3; ++a) {
            if (detail::trim(line).empty()) fail("expected 3 numbers, got " + std::to_string(a));
            p[a] = number<double>(line, "a number");
        }
        return p;
    }

    void check_finite(std::uint64_t vertex, double x, double y, double z) const {
        if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z))
            fail("vertex " + std::to_string(vertex) + ": expected finite numbers, got coordinates that are not finite");
    }

    [[noreturn]] void fail(const std::string& what) const { fail(Errc::InvalidInput, what); }
    [[noreturn]] void unsupported(const std::string& what) const { fail(Errc::Unsupported, what); }

private:
    [[noreturn]] void fail(Errc code, const std::string& what) const {
        const std::string line = is_text_ && lines_.number() > 0 ? ":" + std::to_string(lines_.number()) : "";
        throw Error(code, path_ + line + ": " + what);
    }

    const std::string& path_;
    detail::Lines lines_;
    bool is_text_ = true;
};

/// Receives the contents of a file in the order in which they are stored. read_mesh() builds triangles from them, and
/// read_points() a cloud. Readers skip contents that the receiver does not want without checking them.
class Receiver {
public:
    virtual ~Receiver() = default;
    [[nodiscard]] virtual bool wants_faces() const { return false; }
    [[nodiscard]] virtual bool wants_normals() const { return false; }
    /// Announces the maximum number of vertices. The file is large enough for this number, so memory may be reserved.
    virtual void expect_vertices(std::size_t count, bool with_normals) = 0;
    virtual void vertex(const Vec3& position) = 0;
    /// The normal, of any length, of the first vertex that has no normal yet.
    virtual void normal(const Vec3&) {}
    /// Called if a corner of a face has a normal whose index differs from the index of its vertex.
    virtual void mixed_normals() {}
    /// The corners may refer to vertices that follow later, or that do not exist.
    virtual void face(const std::vector<std::uint32_t>&) {}
};

inline std::uint32_t to_index(const Source& source, double value) {
    if (!(value >= 0 && value < double(std::numeric_limits<std::uint32_t>::max())) || value != std::floor(value))
        source.fail("expected the number of a vertex, got " + std::to_string(value));
    return std::uint32_t(value);
}

}  // namespace covol::mesh_io
