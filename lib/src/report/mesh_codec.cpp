#include "report/mesh_codec.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace covol::detail {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
constexpr double kSteps = 65535.0;

void add_number(std::uint32_t value, std::vector<std::uint8_t>& bytes) {
    for (; value >= 128; value >>= 7U) bytes.push_back(std::uint8_t(value | 128U));
    bytes.push_back(std::uint8_t(value));
}

std::uint32_t take_number(const std::uint8_t*& at) {
    std::uint32_t value = 0;
    for (unsigned shift = 0;; shift += 7) {
        value |= std::uint32_t(*at & 127U) << shift;
        if ((*at++ & 128U) == 0) return value;
    }
}

void encode_corners(const TriangleMesh& mesh, CodedMesh& coded) {
    std::vector<std::uint32_t> number(mesh.vertices.size(), kNone);
    for (const auto& triangle : mesh.triangles)
        for (const std::uint32_t v : triangle) {
            const auto next = std::uint32_t(coded.from.size());
            if (number[v] == kNone) {
                number[v] = next;
                coded.from.push_back(v);
            }
            add_number(next - number[v], coded.corners);
        }
    coded.vertex_count = std::uint32_t(coded.from.size());
    coded.triangle_count = std::uint32_t(mesh.triangles.size());
}

}  // namespace

CodedMesh encode(const TriangleMesh& mesh) {
    CodedMesh coded;
    encode_corners(mesh, coded);
    const std::size_t count = coded.from.size();
    coded.positions.resize(6 * count);
    for (int a = 0; a < 3 && count > 0; ++a) {
        float low = mesh.vertices[coded.from.front()][a], high = low;
        for (const std::uint32_t v : coded.from) {
            low = std::min(low, mesh.vertices[v][a]);
            high = std::max(high, mesh.vertices[v][a]);
        }
        coded.min[a] = low;
        coded.max[a] = high;
        const double scale = high > low ? kSteps / (double(high) - low) : 0.0;
        std::uint8_t* const bytes = coded.positions.data() + 2 * a * count;
        std::uint16_t before = 0;
        for (std::size_t n = 0; n < count; ++n) {
            const auto at = std::uint16_t(std::lround((double(mesh.vertices[coded.from[n]][a]) - low) * scale));
            const auto step = std::uint16_t(at - before);
            bytes[n] = std::uint8_t(step & 255U);
            bytes[count + n] = std::uint8_t(step >> 8U);
            before = at;
        }
    }
    return coded;
}

TriangleMesh decode(const CodedMesh& coded) {
    TriangleMesh mesh;
    const std::size_t count = coded.vertex_count;
    mesh.vertices.resize(count);
    for (int a = 0; a < 3; ++a) {
        const std::uint8_t* const bytes = coded.positions.data() + 2 * a * count;
        const double scale = (double(coded.max[a]) - coded.min[a]) / kSteps;
        std::uint16_t at = 0;
        for (std::size_t n = 0; n < count; ++n) {
            at = std::uint16_t(at + bytes[n] + 256U * bytes[count + n]);
            mesh.vertices[n][a] = float(coded.min[a] + at * scale);
        }
    }
    const std::uint8_t* next = coded.corners.data();
    std::uint32_t fresh = 0;
    mesh.triangles.resize(coded.triangle_count);
    for (auto& triangle : mesh.triangles)
        for (std::uint32_t& v : triangle) {
            const std::uint32_t behind = take_number(next);
            v = fresh - behind;
            if (behind == 0) ++fresh;
        }
    return mesh;
}

CodedValues encode(const std::vector<float>& values, const std::vector<std::uint32_t>& from) {
    CodedValues coded;
    coded.min = std::numeric_limits<float>::max();
    coded.max = std::numeric_limits<float>::lowest();
    for (const std::uint32_t v : from)
        if (std::isfinite(values[v])) {
            coded.min = std::min(coded.min, values[v]);
            coded.max = std::max(coded.max, values[v]);
        }
    if (coded.min > coded.max) coded.min = coded.max = 0;
    const float range = coded.max - coded.min;
    std::uint8_t before = 0;
    for (const std::uint32_t v : from) {
        const float fraction = !std::isfinite(values[v]) ? 1.0F : range > 0 ? (values[v] - coded.min) / range : 0.0F;
        const auto at = std::uint8_t(std::lround(255.0F * std::clamp(fraction, 0.0F, 1.0F)));
        coded.steps.push_back(std::uint8_t(at - before));
        before = at;
    }
    return coded;
}

}  // namespace covol::detail
