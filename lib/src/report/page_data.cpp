#include "covol/page_data.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "covol/error.h"
#include "report/encoding.h"
#include "report/mesh_codec.h"

namespace covol {
namespace {

constexpr double kMaxCode = 65535;
constexpr int kFast = 1;  // zlib's level of compression: a user waits for the slice
constexpr std::int32_t kMaxStep = 1 << 20;

template <typename T>
void append(std::vector<std::uint8_t>& bytes, T value) {
    static_assert(sizeof(T) == 4);
    std::uint32_t bits = 0;
    std::memcpy(&bits, &value, 4);
    for (int n = 0; n < 4; ++n) bytes.push_back(std::uint8_t(bits >> (8 * n)));
}

/// The position of a slice's pixels in a level of the image.
struct SlicePlan {
    std::size_t level = 0, along = 2, right = 0, down = 1;
    std::int32_t at = 0;                ///< the slice's index in the level
    Index3 size{0, 0, 0};               ///< of the level, voxels
    std::int32_t across = 1, rows = 1;  ///< voxels of the level per pixel, right and down
    SliceRequest::Part part;            ///< the pixels of the slice that are encoded
};

SlicePlan plan_slice(const ImageLevels& image, const SliceRequest& wanted) {
    if (wanted.axis < 0 || wanted.axis > 2)
        throw Error(Errc::InvalidOptions, "slice: expected axis 0, 1 or 2, got " + std::to_string(wanted.axis));
    SlicePlan plan;
    plan.along = std::size_t(wanted.axis);
    plan.right = wanted.axis == 0 ? 1 : 0;
    plan.down = wanted.axis == 2 ? 1 : 2;
    const Index3& whole = image.levels().front().size;
    if (wanted.at < 0 || wanted.at >= whole[plan.along])
        throw Error(Errc::InvalidOptions, "slice: expected an index from 0 to " +
                                              std::to_string(whole[plan.along] - 1) + ", got " +
                                              std::to_string(wanted.at));
    if (wanted.step < 1 || wanted.step > kMaxStep)
        throw Error(Errc::InvalidOptions, "slice: expected a step from 1 to " + std::to_string(kMaxStep) +
                                              " voxels, got " + std::to_string(wanted.step));
    plan.level = image.level_for(wanted.step);
    const ImageLevels::Level& level = image.levels()[plan.level];
    plan.size = level.size;
    plan.at = std::min(wanted.at / level.factor[plan.along], level.size[plan.along] - 1);
    plan.across = wanted.step / level.factor[plan.right];
    plan.rows = wanted.step / level.factor[plan.down];
    const int width = (whole[plan.right] + wanted.step - 1) / wanted.step;
    const int height = (whole[plan.down] + wanted.step - 1) / wanted.step;
    plan.part = wanted.part.value_or(SliceRequest::Part{0, 0, width, height});
    SliceRequest::Part& part = plan.part;
    if (part.x < 0 || part.y < 0 || part.x >= width || part.y >= height || part.width < 1 || part.height < 1)
        throw Error(Errc::InvalidOptions, "slice: expected a part within its " + std::to_string(width) + " x " +
                                              std::to_string(height) + " pixels, got " + std::to_string(part.width) +
                                              " x " + std::to_string(part.height) + " from (" + std::to_string(part.x) +
                                              ", " + std::to_string(part.y) + ") on");
    part.width = std::min(part.width, width - part.x);
    part.height = std::min(part.height, height - part.y);
    return plan;
}

/// The first and last voxel of a pixel. If a coarse level does not cover the image's end, its last voxel is used there.
std::array<std::int32_t, 2> voxels_of(std::int32_t pixel, std::int32_t step, std::int32_t size) {
    const std::int32_t first = std::int32_t(std::min(std::int64_t(pixel) * step, std::int64_t(size) - 1));
    return {first, std::int32_t(std::min(std::int64_t(first) + step, std::int64_t(size)) - 1)};
}

/// Encodes the pixels of rows `first` to `last` from the level's voxels that they need.
void code_rows(const ImageLevels& image, const SlicePlan& plan, int first, int last, const std::array<double, 2>& range,
               std::uint8_t* out, const RunContext& run) {
    const SliceRequest::Part& part = plan.part;
    VoxelBox box;
    box.min[plan.along] = box.max[plan.along] = plan.at;
    box.min[plan.right] = voxels_of(part.x, plan.across, plan.size[plan.right])[0];
    box.max[plan.right] = voxels_of(part.x + part.width - 1, plan.across, plan.size[plan.right])[1];
    box.min[plan.down] = voxels_of(part.y + first, plan.rows, plan.size[plan.down])[0];
    box.max[plan.down] = voxels_of(part.y + last, plan.rows, plan.size[plan.down])[1];
    const std::int64_t row = box.size()[plan.right];
    std::vector<float> values(std::size_t(row) * std::size_t(box.size()[plan.down]));
    image.copy(plan.level, box, values.data(), run);
    const double scale = range[1] > range[0] ? kMaxCode / (range[1] - range[0]) : 0;
    for (int y = first; y <= last; ++y) {
        const auto [top, bottom] = voxels_of(part.y + y, plan.rows, plan.size[plan.down]);
        for (int x = 0; x < part.width; ++x) {
            const auto [left, right] = voxels_of(part.x + x, plan.across, plan.size[plan.right]);
            double sum = 0;
            for (std::int32_t j = top; j <= bottom; ++j) {
                const float* from = values.data() + (j - box.min[plan.down]) * row;
                for (std::int32_t i = left; i <= right; ++i) sum += double(from[i - box.min[plan.right]]);
            }
            const double mean = sum / (double(right - left + 1) * (bottom - top + 1));
            const auto code = std::uint16_t(std::lround(std::clamp((mean - range[0]) * scale, 0.0, kMaxCode)));
            *out++ = std::uint8_t(code & 255U);
            *out++ = std::uint8_t(code >> 8U);
        }
    }
}

}  // namespace

PageSlice make_page_slice(const ImageLevels& image, const SliceRequest& wanted, const std::array<double, 2>& range,
                          const RunContext& run) {
    const SlicePlan plan = plan_slice(image, wanted);
    const int width = plan.part.width, height = plan.part.height;
    // The image is a compressed stream: the slice is decoded once here, and not by each of the parallel tasks.
    if (!image.is_in_chunks() && image.image().chunks()) {
        VoxelBox slice = image.image().held();
        slice.min[plan.along] = slice.max[plan.along] = plan.at;
        image.image().load(slice, run);
    }
    const Index3& factor = image.levels()[plan.level].factor;
    PageSlice coded{width, height, *std::max_element(factor.begin(), factor.end()), {}};
    const std::size_t bytes_of_row = 2 * std::size_t(width);
    std::vector<std::uint8_t> bytes(bytes_of_row * std::size_t(height));
    // For an image in chunks, the rows of one layer of chunks are encoded together, so that each chunk is looked up
    // once. More rows at a time would take much memory.
    const int chunk = image.is_in_chunks() ? std::max(1, image.chunk_size(plan.level)[plan.down] / plan.rows) : 1;
    const int offset = plan.part.y % chunk;
    tbb::parallel_for(0, (offset + height - 1) / chunk + 1, [&](int n) {
        const int first = std::max(0, n * chunk - offset), last = std::min(height, (n + 1) * chunk - offset) - 1;
        if (!run.cancelled())
            code_rows(image, plan, first, last, range, bytes.data() + bytes_of_row * std::size_t(first), run);
    });
    run.check();
    coded.bytes = detail::deflated(bytes, kFast);
    return coded;
}

std::string make_page_mesh(const TriangleMesh& mesh) {
    const detail::CodedMesh coded = detail::encode(mesh);
    std::vector<std::uint8_t> bytes;
    bytes.reserve(48 + coded.positions.size() + coded.corners.size());
    append(bytes, coded.vertex_count);
    append(bytes, coded.triangle_count);
    for (const float x : coded.min) append(bytes, x);
    for (const float x : coded.max) append(bytes, x);
    append(bytes, std::uint32_t(coded.positions.size()));
    append(bytes, std::uint32_t(coded.corners.size()));
    bytes.insert(bytes.end(), coded.positions.begin(), coded.positions.end());
    bytes.insert(bytes.end(), coded.corners.begin(), coded.corners.end());
    return detail::deflated(bytes, kFast);
}

}  // namespace covol
