#include "jobs/image_grid.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "covol/error.h"

namespace covol::tool {
namespace {

constexpr int kLeaf = 8;

/// Whether the position is inside the image, which extends half a voxel beyond the centres of the outer voxels.
bool is_inside(const ImageGeometry& geometry, const Vec3& world) {
    const Vec3 index = geometry.world_to_index(world);
    for (int a = 0; a < 3; ++a)
        if (index[a] < -0.5 - 1e-6 || index[a] > geometry.size[a] - 0.5 + 1e-6) return false;
    return true;
}

void fill_leaf(const Image& image, const Domain& domain, FloatGrid::TreeType::LeafNodeType& leaf) {
    const openvdb::Coord o = leaf.origin();
    float values[kLeaf * kLeaf * kLeaf];
    image.sample(domain, {o.x(), o.y(), o.z()}, {o.x() + kLeaf - 1, o.y() + kLeaf - 1, o.z() + kLeaf - 1}, values);
    for (openvdb::Index n = 0; n < FloatGrid::TreeType::LeafNodeType::SIZE; ++n) {
        const openvdb::Coord c = leaf.offsetToGlobalCoord(n);
        if (is_inside(image.geometry(), domain.index_to_world({double(c.x()), double(c.y()), double(c.z())})))
            leaf.setValueOn(n, values[n]);
    }
}

}  // namespace

double bytes_of_grid(const ImageGeometry& geometry, double h) {
    const Domain domain = make_domain(geometry.world_box(), h);
    double leaves = 1;
    for (int a = 0; a < 3; ++a) leaves *= (domain.max[a] >> 3) - (domain.min[a] >> 3) + 1.0;
    // Besides its values, each leaf needs about 128 bytes: in the list of leaves and in the upper nodes of the tree.
    constexpr double kBytesOfLeaf = kLeaf * kLeaf * kLeaf * sizeof(float) + 128;
    return leaves * kBytesOfLeaf;
}

FloatGridPtr to_grid(const Image& image, double h, const RunContext& run) {
    const Domain domain = make_domain(image.geometry().world_box(), h);
    FloatGridPtr grid = make_grid(domain, 0.0F, "density");
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    std::vector<FloatGrid::TreeType::LeafNodeType*> leaves;
    for (int i = domain.min[0] & ~7; i <= domain.max[0]; i += kLeaf)
        for (int j = domain.min[1] & ~7; j <= domain.max[1]; j += kLeaf)
            for (int k = domain.min[2] & ~7; k <= domain.max[2]; k += kLeaf)
                leaves.push_back(grid->tree().touchLeaf({i, j, k}));
    with_threads(run, [&] {
        tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t n) { fill_leaf(image, domain, *leaves[n]); });
    });
    run.check();
    return grid;
}

ImageGeometry geometry_of(const FloatGrid& grid) {
    const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
    if (box.empty()) throw Error(Errc::InvalidInput, "convert: grid '" + grid.getName() + "' has no active voxel");
    const Domain domain = domain_of(grid);
    ImageGeometry geometry;
    geometry.spacing = {domain.voxel_size, domain.voxel_size, domain.voxel_size};
    geometry.origin = domain.index_to_world({double(box.min().x()), double(box.min().y()), double(box.min().z())});
    for (int a = 0; a < 3; ++a) geometry.size[a] = box.dim()[a];
    return geometry;
}

std::vector<float> sample(const FloatGrid& grid, const ImageGeometry& geometry, const RunContext& run) {
    const Index3 n = geometry.size;
    std::vector<float> values(std::size_t(n[0]) * n[1] * n[2]);
    with_threads(run, [&] {
        tbb::parallel_for(0, n[2], [&](int k) {
            const openvdb::tools::GridSampler<FloatGrid::ConstAccessor, openvdb::tools::BoxSampler> at(
                grid.getConstAccessor(), grid.transform());
            float* out = values.data() + std::size_t(k) * n[0] * n[1];
            for (int j = 0; j < n[1]; ++j)
                for (int i = 0; i < n[0]; ++i) {
                    const Vec3 w = geometry.index_to_world({double(i), double(j), double(k)});
                    *out++ = at.wsSample(openvdb::Vec3d(w[0], w[1], w[2]));
                }
        });
    });
    run.check();
    return values;
}

}  // namespace covol::tool
