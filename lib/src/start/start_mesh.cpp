// The start from a mesh, in a separate file because OpenVDB's MeshToVolume.h takes long to compile.
#include <openvdb/tools/MeshToVolume.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "base/number.h"
#include "covol/error.h"
#include "covol/start.h"
#include "meshing/mesh_rows.h"
#include "redistance/signed_distance.h"
#include "start/closed_mesh.h"

namespace covol {
namespace {

/// The signed distance to the mesh, on the lattice of the domain. OpenVDB determines its sign, see correct_signs().
FloatGridPtr signed_distance_grid(Domain domain, const TriangleMesh& mesh) {
    for (int a = 0; a < 3; ++a) domain.origin[a] -= mesh.origin[a];  // vertices are relative to the mesh's origin
    std::vector<openvdb::Vec3s> points(mesh.vertices.size());
    std::vector<openvdb::Vec3I> triangles(mesh.triangles.size());
    for (std::size_t n = 0; n < points.size(); ++n)
        points[n] = openvdb::Vec3s(mesh.vertices[n][0], mesh.vertices[n][1], mesh.vertices[n][2]);
    for (std::size_t n = 0; n < triangles.size(); ++n)
        triangles[n] = openvdb::Vec3I(mesh.triangles[n][0], mesh.triangles[n][1], mesh.triangles[n][2]);
    const FloatGridPtr frame = make_grid(domain, 1.0F, "band");
    try {
        return openvdb::tools::meshToSignedDistanceField<FloatGrid>(frame->transform(), points, triangles, {},
                                                                    float(kHalfWidthVoxels), float(kHalfWidthVoxels));
    } catch (const openvdb::Exception& e) {
        throw Error(Errc::InvalidInput, std::string("the mesh: ") + e.what());
    }
}

/// OpenVDB treats as outside only what is connected to the exterior, and so fills cavities. Here voxels are inside if
/// the mesh's winding number is not 0.
void correct_signs(FloatGrid& distance, const Domain& domain, const TriangleMesh& mesh, const RunContext& run) {
    const openvdb::CoordBBox box = distance.evalActiveVoxelBoundingBox();
    ImageGeometry lattice;
    lattice.spacing.fill(domain.voxel_size);
    lattice.origin = domain.origin;
    for (int a = 0; a < 3; ++a) {
        // Extend to whole leaves.
        const int first = box.min()[a] & ~7, last = box.max()[a] | 7;
        lattice.size[a] = last - first + 1;
        lattice.origin[a] += first * domain.voxel_size;
    }
    const meshing::MeshRows rows(mesh, lattice);
    constexpr std::int32_t kSlices = 8;
    const Index3 slab = {lattice.size[0], lattice.size[1], kSlices};
    const std::size_t voxels = std::size_t(slab[0]) * std::size_t(slab[1]) * kSlices;
    std::vector<std::uint8_t> inside(voxels);
    std::map<int, std::vector<FloatGrid::TreeType::LeafNodeType*>> leaves;  // by the z of their first slice
    for (auto leaf = distance.tree().beginLeaf(); leaf; ++leaf) leaves[leaf->origin().z()].push_back(&*leaf);
    const int z0 = box.min().z() & ~7;
    for (const auto& [z, of_slab] : leaves) {
        if (z < z0 || z >= z0 + lattice.size[2]) continue;
        run.check();
        rows.fill(z - z0, slab, inside, "the mesh is not closed");
        tbb::parallel_for(std::size_t(0), of_slab.size(), [&, list = &of_slab](std::size_t n) {
            FloatGrid::TreeType::LeafNodeType& leaf = *(*list)[n];
            for (openvdb::Index at = 0; at < FloatGrid::TreeType::LeafNodeType::SIZE; ++at) {
                const openvdb::Coord c = leaf.offsetToGlobalCoord(at);
                const int i = c.x() - (box.min().x() & ~7), j = c.y() - (box.min().y() & ~7), k = c.z() - z;
                const bool within = i >= 0 && j >= 0 && i < slab[0] && j < slab[1];
                const float value = std::abs(leaf.getValue(at));
                const std::size_t voxel =
                    (std::size_t(k) * std::size_t(slab[1]) + std::size_t(j)) * std::size_t(slab[0]) + std::size_t(i);
                leaf.setValueOnly(at, within && inside[voxel] != 0 ? -value : value);
            }
        });
    }
}

/// The mesh with its holes closed, with a warning. @throws Error InvalidInput if the caps exceed half of its area.
TriangleMesh closed_or_refused(const TriangleMesh& mesh, const RunContext& run) {
    constexpr double kMaxCaps = 0.5;
    detail::ClosedMesh closed = detail::close_holes(mesh);
    if (closed.holes == 0) return mesh;
    const std::string holes = std::to_string(closed.holes) + (closed.holes > 1 ? " holes" : " hole");
    const std::string fraction = detail::number(std::round(1000 * closed.cap_fraction) / 10) + " % of its area";
    if (closed.cap_fraction > kMaxCaps)
        throw Error(Errc::InvalidInput, "the mesh of the start is not closed: expected one with an inside, got " +
                                            holes + (closed.holes > 1 ? " that need" : " that needs") + " patches of " +
                                            fraction + "; close it in the program that made it");
    run.warn("the mesh of the start is not closed: " + holes + ", closed by patches of " + fraction +
             " between rim and centre; check the result there");
    return std::move(closed.mesh);
}

}  // namespace

FloatGridPtr start_from_mesh(const Domain& domain, const TriangleMesh& mesh, const RunContext& run) {
    if (mesh.empty()) throw Error(Errc::InvalidInput, "mesh: expected at least one triangle, got none");
    FloatGridPtr result;
    with_threads(run, [&] {
        const MeshMeasures measures = measure(mesh);
        const TriangleMesh closed = measures.closed ? TriangleMesh() : closed_or_refused(mesh, run);
        const TriangleMesh& whole = measures.closed ? mesh : closed;
        const FloatGridPtr distance = signed_distance_grid(domain, whole);
        if (!measures.closed || measures.components > 1) correct_signs(*distance, domain, whole, run);
        run.check();
        std::vector<detail::Coord> origins;
        for (auto leaf = distance->tree().cbeginLeaf(); leaf; ++leaf) origins.push_back(leaf->origin());
        const detail::LeafBand band(detail::dilate_leaves(origins, 0, domain));
        detail::LeafArray<float> u(band.size(), 0.0F);
        detail::import_values(*distance, band, u);
        const auto h = float(domain.voxel_size);
        tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
            for (int at = 0; at < detail::kLeafSize; ++at) u.leaf(leaf)[at] /= h;
        });
        result = detail::make_start(band, u, domain, "start_from_mesh");
    });
    return result;
}

}  // namespace covol
