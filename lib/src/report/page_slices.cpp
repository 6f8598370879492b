#include "report/page_slices.h"

#include <tbb/parallel_for.h>
#include <turbojpeg.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <new>

#include "covol/error.h"
#include "report/encoding.h"

namespace covol::detail {
namespace {

constexpr double kLow = 0.002, kHigh = 0.998;  // intensity percentiles shown as black and white
constexpr double kMargin = 0.15;               // margin around the positions, as a fraction of their box's longest side
constexpr int kMinVoxels = 3;                  // minimum number of voxels along an axis, however long the others are

std::int64_t count_of(const Index3& size) { return std::int64_t(size[0]) * size[1] * size[2]; }

Index3 shown_size(const VoxelBox& region, const Index3& step) {
    const Index3 size = region.size();
    return {std::max(1, size[0] / step[0]), std::max(1, size[1] / step[1]), std::max(1, size[2] / step[2])};
}

/// The box of the positions `places` with a margin, limited to `held`, the voxels that the image holds; indices.
VoxelBox around(const ImageGeometry& geometry, const VoxelBox& held, const std::vector<Vec3>& places) {
    Vec3 low, high;
    low.fill(std::numeric_limits<double>::max());
    high.fill(std::numeric_limits<double>::lowest());
    for (const Vec3& place : places) {
        const Vec3 index = geometry.world_to_index(place);
        for (int a = 0; a < 3; ++a) {
            low[a] = std::min(low[a], index[a]);
            high[a] = std::max(high[a], index[a]);
        }
    }
    double longest = 0;
    for (int a = 0; a < 3; ++a) longest = std::max(longest, (high[a] - low[a]) * geometry.spacing[a]);
    VoxelBox box = held;
    for (int a = 0; a < 3; ++a) {
        const double margin = kMargin * longest / geometry.spacing[a];
        const auto clamped = [&](double at) { return int(std::clamp(at, double(held.min[a]), double(held.max[a]))); };
        box.min[a] = clamped(std::floor(low[a] - margin));
        box.max[a] = clamped(std::ceil(high[a] + margin));
    }
    return box;
}

struct Compressor {
    Compressor() : handle(tjInitCompress()) {
        if (handle == nullptr) throw std::bad_alloc();
    }
    Compressor(const Compressor&) = delete;
    Compressor& operator=(const Compressor&) = delete;
    ~Compressor() {
        tjFree(bytes);
        tjDestroy(handle);
    }
    std::string operator()(const std::vector<std::uint8_t>& pixels, int width, int height, int quality) {
        unsigned long size = 0;
        if (tjCompress2(handle, pixels.data(), width, width, height, TJPF_GRAY, &bytes, &size, TJSAMP_GRAY, quality,
                        TJFLAG_ACCURATEDCT) != 0)
            throw Error(Errc::InvalidInput,
                        std::string("a slice cannot be compressed as JPEG: ") + tjGetErrorStr2(handle));
        return to_base64(bytes, size);
    }
    tjhandle handle;
    unsigned char* bytes = nullptr;
};

/// The means over step[0] x step[1] voxels of one slice of the image, row by row.
std::vector<float> shrink(const Image& image, const SlicePlan& plan, int k) {
    const int width = plan.size[0], height = plan.size[1];
    std::vector<float> means(std::size_t(width) * height), rows;
    VoxelBox box;
    for (int j = 0; j < height; ++j) {
        box.min = {plan.region.min[0], plan.region.min[1] + j * plan.step[1], k};
        box.max = {box.min[0] + width * plan.step[0] - 1, box.min[1] + plan.step[1] - 1, k};
        rows.resize(std::size_t(box.size()[0]) * box.size()[1]);
        image.copy(box, rows.data());
        float* const out = means.data() + std::size_t(j) * width;
        for (std::size_t n = 0; n < rows.size(); ++n) out[n % box.size()[0] / plan.step[0]] += rows[n];
        for (int i = 0; i < width; ++i) out[i] /= float(plan.step[0]) * float(plan.step[1]);
    }
    return means;
}

}  // namespace

SlicePlan plan_slices(const ImageGeometry& geometry, const VoxelBox& held, const std::vector<Vec3>& places,
                      std::int64_t maximum) {
    SlicePlan plan;
    plan.region = held;
    if (count_of(held.size()) > maximum && !places.empty()) plan.region = around(geometry, held, places);
    plan.size = shown_size(plan.region, plan.step);
    while (count_of(plan.size) > maximum) {
        int finest = -1;
        for (int a = 0; a < 3; ++a) {
            if (plan.size[a] <= kMinVoxels) continue;
            const auto edge = [&](int b) { return geometry.spacing[b] * plan.step[b]; };
            if (finest < 0 || edge(a) < edge(finest)) finest = a;
        }
        if (finest < 0) break;
        ++plan.step[finest];
        plan.size = shown_size(plan.region, plan.step);
    }
    return plan;
}

CodedSlices encode_slices(const Image& image, const SlicePlan& plan, int quality, const RunContext& run) {
    CodedSlices coded;
    coded.geometry = cropped(image.geometry(), plan.region);
    const Vec3 first{0.5 * (plan.step[0] - 1), 0.5 * (plan.step[1] - 1), double(plan.step[2] / 2)};
    coded.geometry.origin = coded.geometry.index_to_world(first);
    coded.geometry.size = plan.size;
    for (int a = 0; a < 3; ++a) coded.geometry.spacing[a] *= plan.step[a];
    if (image.chunks()) image.load(plan.region, run);
    const auto [black, white] = image.percentiles(kLow, kHigh);
    coded.black = black;
    coded.white = white > black ? white : black + 1;
    coded.jpegs.resize(plan.size[2]);
    tbb::parallel_for(0, plan.size[2], [&, scale = 255.0 / (coded.white - coded.black)](int n) {
        if (run.cancelled()) return;
        const std::vector<float> values = shrink(image, plan, plan.region.min[2] + n * plan.step[2] + plan.step[2] / 2);
        std::vector<std::uint8_t> pixels(values.size());
        std::transform(values.begin(), values.end(), pixels.begin(), [&](float value) {
            return std::uint8_t(std::lround(std::clamp((double(value) - coded.black) * scale, 0.0, 255.0)));
        });
        coded.jpegs[n] = Compressor()(pixels, plan.size[0], plan.size[1], quality);
    });
    run.check();
    return coded;
}

}  // namespace covol::detail
