#pragma once
// What the readers of mesh files share.
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "covol/error.h"
#include "covol/mesh.h"

namespace covol::mesh_io {

using Face = std::array<std::uint32_t, 3>;

inline std::string_view next_word(std::string_view& line) {
    const auto is_space = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; };
    std::size_t begin = 0;
    while (begin < line.size() && is_space(line[begin])) ++begin;
    std::size_t end = begin;
    while (end < line.size() && !is_space(line[end])) ++end;
    const std::string_view word = line.substr(begin, end - begin);
    line.remove_prefix(end);
    return word;
}

template <typename T>
std::optional<T> to_number(std::string_view word) {
    if (!word.empty() && word.front() == '+') word.remove_prefix(1);
    T value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
    return value;
}

/// A file in memory, read line by line or byte by byte; knows where it is for messages.
class Source {
public:
    Source(const std::string& path, std::string_view text) : path_(path), rest_(text) {}

    [[nodiscard]] const std::string& path() const { return path_; }
    [[nodiscard]] bool at_end() const { return rest_.empty(); }
    [[nodiscard]] std::size_t bytes_left() const { return rest_.size(); }

    std::string_view line() {
        if (rest_.empty()) fail("unexpected end of the file");
        const std::size_t end = rest_.find('\n');
        std::string_view line = rest_.substr(0, end);
        rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
        ++line_;
        if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
        return line;
    }

    /// The next line that is neither blank nor a comment, without its comment.
    std::string_view content_line() {
        for (;;) {
            const std::string_view text = line();
            const std::string_view content = text.substr(0, text.find('#'));
            if (content.find_first_not_of(" \t") != std::string_view::npos) return content;
        }
    }

    std::string_view bytes(std::size_t count) {
        if (count > rest_.size()) fail("the file is cut off");
        const std::string_view result = rest_.substr(0, count);
        rest_.remove_prefix(count);
        return result;
    }

    template <typename T>
    T number(std::string_view& line, const char* what) {
        const std::string_view word = next_word(line);
        const auto value = to_number<T>(word);
        if (!value)
            fail(std::string("expected ") + what + ", got " +
                 (word.empty() ? "the end of the line" : "'" + std::string(word.substr(0, 40)) + "'"));
        return *value;
    }

    [[noreturn]] void fail(const std::string& what) const {
        throw Error(Errc::InvalidInput, "read_mesh: " + path_ + (line_ > 0 ? ":" + std::to_string(line_) : "") + ": " + what);
    }

private:
    const std::string path_;
    std::string_view rest_;
    std::size_t line_ = 0;
};

/// Collects vertices and polygons, and checks them.
class MeshBuilder {
public:
    explicit MeshBuilder(const Source& source) : source_(source) {}

    void reserve_vertices(std::size_t count) { mesh_.vertices.reserve(count); }
    [[nodiscard]] std::size_t vertex_count() const { return mesh_.vertices.size(); }

    void vertex(double x, double y, double z) {
        const std::array<float, 3> p{float(x), float(y), float(z)};
        if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2]))
            source_.fail("vertex " + std::to_string(vertex_count()) + ": coordinates that are not finite");
        if (vertex_count() >= std::numeric_limits<std::uint32_t>::max()) source_.fail("more than 2^32 vertices");
        mesh_.vertices.push_back(p);
    }

    /// A fan; pieces with a repeated corner have no area and are left out.
    void polygon(const std::vector<std::uint32_t>& corners) {
        for (std::size_t i = 2; i < corners.size(); ++i)
            if (corners[0] != corners[i - 1] && corners[i - 1] != corners[i] && corners[i] != corners[0])
                mesh_.triangles.push_back({corners[0], corners[i - 1], corners[i]});
    }

    /// Faces may come before the vertices that they name, so their numbers are checked here.
    TriangleMesh finish() {
        for (const Face& t : mesh_.triangles)
            for (const std::uint32_t v : t)
                if (v >= vertex_count())
                    source_.fail("a face refers to vertex " + std::to_string(v) + " (from 0), the file has " +
                                 std::to_string(vertex_count()));
        return std::move(mesh_);
    }

private:
    const Source& source_;
    TriangleMesh mesh_;
};

inline std::uint32_t to_index(const Source& source, double value) {
    if (!(value >= 0 && value < double(std::numeric_limits<std::uint32_t>::max())) || value != std::floor(value))
        source.fail("expected the number of a vertex, got " + std::to_string(value));
    return std::uint32_t(value);
}

}  // namespace covol::mesh_io
