#include "holes/share_beyond.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "mesh/triangle.h"
#include "points/kd_tree.h"
#include "surface/marching_cubes.h"
#include "surface/mesh_pieces.h"

namespace covol::detail {

BeyondPoints measure_beyond(const FloatGrid& surface, const std::vector<Vec3>& points, double distance,
                            const RunContext& run) {
    const KdTree tree(points);
    std::vector<double> distances;  // from the piece's vertices to the points; kept for vertices in the next piece
    std::uint64_t first = 0;
    double area = 0, beyond = 0;
    BeyondPoints result;
    result.mesh = measure_pieces(surface, 0, run, [&](const StreamedMesh& mesh, const MeshPiece& piece) {
        distances.erase(distances.begin(), distances.begin() + std::ptrdiff_t(std::min<std::uint64_t>(
                                                                   piece.first - first, distances.size())));
        first = piece.first;
        const std::size_t known = distances.size();
        distances.resize(piece.positions.size());
        tbb::parallel_for(known, distances.size(), [&](std::size_t n) {
            Vec3 place;
            for (int a = 0; a < 3; ++a) place[a] = mesh.origin[a] + double(piece.positions[n][a]);
            distances[n] = std::sqrt(tree.nearest(place));
        });
        for (const auto& t : piece.triangles) {
            const auto at = [&](int k) { return meshing::to_vec3(piece.positions[t[k] - first]); };
            const double own = length(meshing::area_normal(at(0), at(1), at(2))) / 2;
            area += own;
            if (distances[t[0] - first] + distances[t[1] - first] + distances[t[2] - first] > 3 * distance)
                beyond += own;
        }
    });
    result.fraction = area > 0 ? beyond / area : 0;
    return result;
}

}  // namespace covol::detail
