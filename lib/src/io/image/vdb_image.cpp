// Reads a float grid of a .vdb file as an image.
#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include "covol/vdb_io.h"
#include "io/image/image_formats.h"

namespace covol::detail {
namespace {

// Maximum ratio of the requested voxels to the active voxels of the grid; read() rejects larger requests. A grid with a
// few distant active voxels exceeds this ratio, because its bounding box is huge.
constexpr std::uint64_t kSparsest = 10000;

class VdbImage : public ImageFile {
public:
    VdbImage(std::string path, const std::string& name) : path_(std::move(path)), grid_(read_vdb(path_, name)) {
        const openvdb::CoordBBox box = grid_->evalActiveVoxelBoundingBox();
        const std::string title = "grid '" + grid_->getName() + "'";
        if (box.empty()) throw read_error(Errc::InvalidInput, path_, title + " has no active voxel");
        const auto& transform = grid_->transform();
        if (!transform.isLinear())
            throw read_error(Errc::Unsupported, path_, title + " has a transform that is not linear");
        first_ = box.min();
        std::uint64_t size[3];
        for (int a = 0; a < 3; ++a) size[a] = std::uint64_t(std::int64_t(box.max()[a]) - box.min()[a] + 1);
        ImageGeometry& geometry = info_.geometry;
        geometry.size = require_3d(path_, size);
        const openvdb::Vec3d origin = transform.indexToWorld(first_);
        for (int a = 0; a < 3; ++a) {
            openvdb::Coord next = first_;
            next[a] += 1;
            openvdb::Vec3d step = transform.indexToWorld(next) - origin;
            geometry.origin[a] = origin[a];
            geometry.spacing[a] = step.length();
            step.normalize();
            for (int w = 0; w < 3; ++w) geometry.direction[w][a] = step[w];
        }
        info_.format = "OpenVDB";
        info_.axis_order = "XYZ";
        info_.fields = {{"grid", grid_->getName()},
                        {"transform", "spacing, origin and direction"},
                        {"active voxels", "the box, from (" + text(box.min()) + ") to (" + text(box.max()) + ")"}};
    }

    Pixels read(const PixelRequest& request, const RunContext& run) override {
        const Index3 n = request.box.size();
        if (voxel_count(n) / kSparsest > grid_->activeVoxelCount())
            throw read_error(Errc::Unsupported, path_,
                             "the box of the grid's active voxels is " + size_text(n) +
                                 ", nearly all of it empty; choose a part with `roi`",
                             "roi");
        const std::shared_ptr<void> data = allocate_pixels(path_, voxel_count(n), PixelType::Float, 0);
        const openvdb::Coord first = first_.offsetBy(request.box.min[0], request.box.min[1], request.box.min[2]);
        tbb::parallel_for(0, n[2], [&](int k) {
            const auto accessor = grid_->getConstAccessor();
            float* out = static_cast<float*>(data.get()) + std::int64_t(k) * n[0] * n[1];
            for (int j = 0; j < n[1]; ++j)
                for (int i = 0; i < n[0]; ++i) *out++ = accessor.getValue(first.offsetBy(i, j, k));
        });
        run.check();
        return {data, dense_strides(n), false};
    }

private:
    static std::string text(const openvdb::Coord& c) {
        return std::to_string(c.x()) + ", " + std::to_string(c.y()) + ", " + std::to_string(c.z());
    }

    std::string path_;
    FloatGridPtr grid_;
    openvdb::Coord first_;
};

}  // namespace

std::unique_ptr<ImageFile> open_vdb_image(const std::string& path, const std::string& name) {
    return std::make_unique<VdbImage>(path, name);
}

}  // namespace covol::detail
