// Reads and writes STL meshes, in ASCII and binary.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <unordered_map>
#include <vector>

#include "covol/error.h"
#include "io/mesh/mesh_formats.h"

namespace covol::mesh_io {
namespace {

/// Builds a mesh from separate triangles: STL stores a vertex once per triangle, so equal positions are merged.
class StlBuilder {
public:
    explicit StlBuilder(const Source& source) : mesh_(source) {}
    void corner(const Vec3& p) {
        // Coordinates are compared by their bits. Adding 0 turns -0 into 0, which is equal but has other bits.
        const auto bits = [](float c) { return std::bit_cast<std::uint32_t>(c + 0.0F); };
        const std::array<float, 3> held = mesh_.held(p);
        const auto [at, is_new] =
            known_.try_emplace({bits(held[0]), bits(held[1]), bits(held[2])}, std::uint32_t(mesh_.vertex_count()));
        if (is_new) mesh_.vertex(p);
        corners_.push_back(at->second);
        if (corners_.size() == 3) {
            mesh_.face(corners_);
            corners_.clear();
        }
    }
    TriangleMesh finish() { return mesh_.finish(); }

private:
    using Key = std::array<std::uint32_t, 3>;
    struct Hash {
        std::size_t operator()(const Key& k) const {
            return ((k[0] * 0x9E3779B97F4A7C15ULL ^ k[1]) * 0x9E3779B97F4A7C15ULL ^ k[2]) * 0x9E3779B97F4A7C15ULL;
        }
    };
    MeshBuilder mesh_;
    std::unordered_map<Key, std::uint32_t, Hash> known_;
    std::vector<std::uint32_t> corners_;
};

using Corners = std::array<std::array<float, 3>, 3>;

std::array<float, 3> triangle_normal(const Corners& corners) {
    const auto side = [&](int corner, int axis) { return double(corners[corner][axis]) - corners[0][axis]; };
    Vec3 n{};
    for (int a = 0; a < 3; ++a) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        n[a] = side(1, b) * side(2, c) - side(1, c) * side(2, b);
    }
    const double size = std::hypot(n[0], n[1], n[2]);
    if (!(size > 0)) return {0, 0, 0};
    return {float(n[0] / size), float(n[1] / size), float(n[2] / size)};
}

}  // namespace

TriangleMesh read_stl(Source& source, std::string_view text) {
    constexpr std::size_t kHeader = 84, kRecord = 50;
    StlBuilder mesh(source);
    std::uint32_t count = 0;
    if (text.size() >= kHeader) std::memcpy(&count, text.data() + 80, 4);
    const bool exact = text.size() >= kHeader && text.size() == kHeader + kRecord * std::uint64_t(count);
    if (!exact && text.starts_with("solid")) {
        while (!source.at_end()) {
            std::string_view line = source.line();
            if (detail::next_word(line) != "vertex") continue;
            mesh.corner(source.three_numbers(line));
        }
        return mesh.finish();
    }
    if (text.size() < kHeader + kRecord * std::uint64_t(count) || text.size() < kHeader)
        source.fail("expected " + std::to_string(kHeader + kRecord * std::uint64_t(count)) +
                    " bytes for the header and " + std::to_string(count) + " triangles, got " +
                    std::to_string(text.size()) + "; the file is truncated, or not an STL file");
    for (std::uint32_t i = 0; i < count; ++i) {
        std::array<float, 12> record{};  // normal, three corners
        std::memcpy(record.data(), text.data() + kHeader + std::size_t(i) * kRecord, sizeof(record));
        for (int k = 3; k < 12; k += 3) mesh.corner({record[k], record[k + 1], record[k + 2]});
    }
    return mesh.finish();
}

void write_stl_header(Output& out, std::uint64_t triangles, const std::vector<std::string>& comments) {
    if (triangles > std::numeric_limits<std::uint32_t>::max())
        throw Error(Errc::Unsupported, "STL holds at most 2^32 - 1 triangles, but the mesh has " +
                                           std::to_string(triangles) + "; decimate it or use larger voxels");
    // The header must not begin with "solid", because readers would take the file for ASCII.
    std::array<char, 80> header{};
    const std::string text = "covol" + (comments.empty() ? std::string() : ": " + comments.front());
    std::copy_n(text.begin(), std::min(text.size(), header.size()), header.begin());
    out.raw(header);
    out.raw(std::uint32_t(triangles));
}

void write_stl_facet(Output& out, const Corners& corners) {
    out.raw(triangle_normal(corners));
    out.raw(corners);
    out.raw(std::uint16_t(0));
}

void write_stl(Output& out, const Prepared& in) {
    if (in.binary)
        write_stl_header(out, in.triangles.size(), in.comments);
    else
        out << "solid covol\n";
    for (const Face& t : in.triangles) {
        const Corners corners{in.vertices[t[0]], in.vertices[t[1]], in.vertices[t[2]]};
        if (in.binary) {
            write_stl_facet(out, corners);
            continue;
        }
        out << "facet normal " << triangle_normal(corners) << "\n outer loop\n";
        for (const auto& corner : corners) {
            out << "  vertex ";
            in.places.text(out, corner);
            out << "\n";
        }
        out << " endloop\nendfacet\n";
    }
    if (!in.binary) out << "endsolid covol\n";
}

}  // namespace covol::mesh_io
