// The start from a mesh, on its own for OpenVDB's MeshToVolume.h, which takes long to compile.
#include <openvdb/tools/MeshToVolume.h>
#include <tbb/parallel_for.h>

#include "covol/error.h"
#include "covol/start.h"
#include "redistance/signed_distance.h"

namespace covol {
namespace {

/// @return in the domain's index space
FloatGridPtr signed_distance_grid(Domain domain, const TriangleMesh& mesh) {
    for (int a = 0; a < 3; ++a) domain.origin[a] -= mesh.origin[a];  // vertices are relative to that
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
        throw Error(Errc::InvalidInput, std::string("start_from_mesh: ") + e.what());
    }
}

}  // namespace

FloatGridPtr start_from_mesh(const Domain& domain, const TriangleMesh& mesh, const RunContext& run) {
    if (mesh.empty()) throw Error(Errc::InvalidInput, "start_from_mesh: expected at least one triangle, got none");
    FloatGridPtr result;
    with_threads(run, [&] {
        const FloatGridPtr distance = signed_distance_grid(domain, mesh);
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
