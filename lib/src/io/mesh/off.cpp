// Reads and writes OFF meshes. Colours and normals, which follow the coordinates in variants of Geomview such as COFF
// and NOFF, are ignored. Binary files and meshes with other than three dimensions are refused.
#include <cmath>
#include <string>
#include <vector>

#include "covol/error.h"
#include "io/mesh/mesh_formats.h"

namespace covol::mesh_io {

using detail::lower, detail::next_word, detail::quote, detail::to_number, detail::trim;

namespace {

/// Reads the keyword, such as "OFF" or "COFF". @returns the remaining line, which may contain the counts
std::string_view read_key(Source& source) {
    std::string_view line = source.content_line();
    const std::string_view key = next_word(line);
    if (!lower(key).ends_with("off")) source.fail("expected 'OFF' in the first line, got " + quote(key));
    // "nOFF" means n dimensions, and "NOFF" means normals.
    if (key.find('4') != std::string_view::npos || key.ends_with("nOFF"))
        source.unsupported("expected three coordinates, got " + quote(key));
    std::string_view rest = line;
    if (lower(next_word(rest)) == "binary") source.unsupported("expected an ascii OFF, got a binary one");
    return trim(line);
}

/// Reads the number of vertices or faces. @param min_bytes  minimum size of a vertex or a face in the file
std::size_t read_count(const Source& source, std::string_view& line, const std::string& what, std::size_t min_bytes) {
    const std::string_view word = next_word(line);
    const auto count = to_number(word);
    if (!count)
        source.fail("expected the number of " + what + ", got " + (word.empty() ? "the end of the line" : quote(word)));
    // The limit is one more than the division yields, because the last line may lack its line end. A file that is too
    // short is then detected when its lines are read.
    if (!(*count >= 0) || *count != std::floor(*count) || *count > double(source.bytes_left() / min_bytes + 1))
        source.fail("the file is truncated: a file of this size cannot contain " + quote(word) + " " + what);
    return std::size_t(*count);
}

}  // namespace

void read_off(Source& source, Receiver& receiver) {
    std::string_view line = read_key(source);
    if (line.empty()) line = source.content_line();
    const std::size_t vertices = read_count(source, line, "vertices", sizeof("0 0 0\n") - 1);
    const std::size_t faces = receiver.wants_faces() ? read_count(source, line, "faces", sizeof("0\n") - 1) : 0;
    receiver.expect_vertices(vertices, false);
    for (std::size_t i = 0; i < vertices; ++i) {
        if (!source.next_content(line))
            source.fail("unexpected end of the file: expected " + std::to_string(vertices) + " vertices, got " +
                        std::to_string(i) + "; the file is truncated");
        receiver.vertex(source.three_numbers(line));
    }
    std::vector<std::uint32_t> corners;
    for (std::size_t i = 0; i < faces; ++i) {
        line = source.content_line();
        const auto count = source.number<std::uint64_t>(line, "the number of a face's vertices");
        if (count > line.size())
            source.fail("a face of " + std::to_string(count) + " vertices cannot fit into its line");
        corners.clear();
        for (std::uint64_t k = 0; k < count; ++k)
            corners.push_back(to_index(source, source.number<double>(line, "the number of a vertex")));
        receiver.face(corners);
    }
}

void write_off(Output& out, const Prepared& in) {
    out << "OFF\n";
    for (const std::string& comment : in.comments) out << "# " << comment << "\n";
    out << std::uint64_t(in.vertices.size()) << " " << std::uint64_t(in.triangles.size()) << " 0\n";
    for (const auto& p : in.vertices) {
        in.places.text(out, p);
        out << "\n";
    }
    for (const Face& t : in.triangles)
        out << "3 " << std::uint64_t(t[0]) << " " << std::uint64_t(t[1]) << " " << std::uint64_t(t[2]) << "\n";
}

}  // namespace covol::mesh_io
