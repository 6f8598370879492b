// Reads and writes OBJ meshes: vertices, their normals, and polygons. Other elements of a file are ignored.
#include <limits>
#include <string>
#include <vector>

#include "covol/error.h"
#include "io/mesh/mesh_formats.h"

namespace covol::mesh_io {

using detail::next_word, detail::quote, detail::to_number;

namespace {

/// Whether a corner of a face has a normal whose index differs from the index of its vertex.
bool mixes_normals(std::string_view corners) {
    for (std::string_view corner = next_word(corners); !corner.empty(); corner = next_word(corners)) {
        const std::size_t first = corner.find('/'), last = corner.rfind('/');
        if (first != last && corner.substr(0, first) != corner.substr(last + 1)) return true;
    }
    return false;
}

/// The indices of a face's vertices, from 0. @param count  number of vertices before the face
void read_corners(const Source& source, std::string_view line, std::int64_t count,
                  std::vector<std::uint32_t>& corners) {
    corners.clear();
    for (std::string_view word = next_word(line); !word.empty() && word[0] != '#'; word = next_word(line)) {
        const auto number = to_number<std::int64_t>(word.substr(0, word.find('/')));
        // Positive indices count from 1; negative indices count backwards from the last vertex so far.
        if (!number || *number == 0 || *number < -count ||
            *number > std::int64_t(std::numeric_limits<std::uint32_t>::max()))
            source.fail("expected the number of a vertex, got " + quote(word));
        corners.push_back(std::uint32_t(*number > 0 ? *number - 1 : count + *number));
    }
    if (corners.size() < 3)
        source.fail("expected a face of at least 3 vertices, got " + std::to_string(corners.size()));
}

/// The next line. If it ends with a backslash, the following line is appended to it. @param joined  buffer for the
/// result
std::string_view whole_line(Source& source, std::string& joined) {
    std::string_view line = source.line();
    if (!line.ends_with('\\') || line.starts_with('#')) return line;
    joined.clear();
    while (line.ends_with('\\')) {
        joined.append(line.substr(0, line.size() - 1)) += ' ';
        line = source.at_end() ? std::string_view() : source.line();
    }
    return joined.append(line);
}

/// Reads a direction; {0, 0, 0} if there are fewer than three words. Words that are not numbers count as 0.
Vec3 direction(std::string_view line) {
    Vec3 n{};
    for (double& c : n) {
        const std::string_view word = next_word(line);
        if (word.empty()) return {0, 0, 0};
        c = to_number(word).value_or(0);
    }
    return n;
}

}  // namespace

void read_obj(Source& source, Receiver& receiver) {
    std::int64_t vertices = 0;
    std::vector<std::uint32_t> corners;
    std::string joined;
    while (!source.at_end()) {
        std::string_view line = whole_line(source, joined);
        const std::string_view key = next_word(line);
        if (key == "v") {
            receiver.vertex(source.three_numbers(line));
            ++vertices;
        } else if (key == "vn" && receiver.wants_normals()) {
            receiver.normal(direction(line));
        } else if (key == "f") {
            if (receiver.wants_normals() && mixes_normals(line)) receiver.mixed_normals();
            if (!receiver.wants_faces()) continue;
            read_corners(source, line, vertices, corners);
            receiver.face(corners);
        }
    }
}

void write_obj_face(Output& out, const Face& triangle, std::uint64_t first) {
    out << "f";
    for (const std::uint32_t v : triangle) out << " " << first + v << "//" << first + v;
    out << "\n";
}

void write_obj_object(Output& out, const Prepared& in, std::uint64_t first) {
    for (const auto& p : in.vertices) {
        out << "v ";
        in.places.text(out, p);
        out << "\n";
    }
    for (const auto& n : in.normals) out << "vn " << n << "\n";
    for (const Face& t : in.triangles) write_obj_face(out, t, first);
}

void write_obj(Output& out, const Prepared& in) {
    for (const std::string& comment : in.comments) out << "# " << comment << "\n";
    write_obj_object(out, in, 1);
}

}  // namespace covol::mesh_io
