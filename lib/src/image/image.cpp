#include "covol/image.h"

#include <algorithm>
#include <cmath>

#include "base/matrix.h"
#include "covol/error.h"
#include "image/geometry_check.h"
#include "io/pixels/chunks.h"

namespace covol {

// ---------------------------------------------------------------------------------------------- geometry

Vec3 ImageGeometry::index_to_world(const Vec3& index) const {
    const Vec3 moved =
        detail::multiply(direction, {index[0] * spacing[0], index[1] * spacing[1], index[2] * spacing[2]});
    return {origin[0] + moved[0], origin[1] + moved[1], origin[2] + moved[2]};
}

Vec3 ImageGeometry::world_to_index(const Vec3& world) const {
    const Vec3 moved = detail::multiply(detail::inverse(direction),
                                        {world[0] - origin[0], world[1] - origin[1], world[2] - origin[2]});
    return {moved[0] / spacing[0], moved[1] / spacing[1], moved[2] / spacing[2]};
}

WorldBox ImageGeometry::world_box() const {
    std::vector<Vec3> corners;
    for (int corner = 0; corner < 8; ++corner) {
        Vec3 index;
        for (int a = 0; a < 3; ++a) index[a] = (corner >> a & 1) != 0 ? size[a] - 0.5 : -0.5;
        corners.push_back(index_to_world(index));
    }
    return bounding_box(corners);
}

bool ImageGeometry::is_axis_aligned() const {
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b)
            if (std::abs(direction[a][b] - (a == b ? 1.0 : 0.0)) > 1e-6) return false;
    return true;
}

bool VoxelBox::contains(const Index3& voxel) const {
    for (int a = 0; a < 3; ++a)
        if (voxel[a] < min[a] || voxel[a] > max[a]) return false;
    return true;
}

VoxelBox voxels_around(const ImageGeometry& geometry, const WorldBox& roi) {
    VoxelBox box;
    Vec3 lo{}, hi{};
    for (int corner = 0; corner < 8; ++corner) {
        Vec3 world;
        for (int a = 0; a < 3; ++a) world[a] = (corner >> a & 1) != 0 ? roi.max[a] : roi.min[a];
        const Vec3 index = geometry.world_to_index(world);
        for (int a = 0; a < 3; ++a) {
            lo[a] = corner == 0 ? index[a] : std::min(lo[a], index[a]);
            hi[a] = corner == 0 ? index[a] : std::max(hi[a], index[a]);
        }
    }
    for (int a = 0; a < 3; ++a) {
        const double last = geometry.size[a] - 1;
        if (!(lo[a] <= last + 0.5 && hi[a] >= -0.5)) {
            const auto text = [](const WorldBox& b) {
                std::string line;
                for (const Vec3& corner : {b.min, b.max})
                    for (int c = 0; c < 3; ++c) line += (line.empty() ? "" : ",") + std::to_string(corner[c]);
                return line;
            };
            throw Error(Errc::InvalidInput,
                        "the roi " + text(roi) + " lies outside the image, which is " + text(geometry.world_box()));
        }
        box.min[a] = static_cast<std::int32_t>(std::clamp(std::floor(lo[a]) - 1, 0.0, last));
        box.max[a] = static_cast<std::int32_t>(std::clamp(std::ceil(hi[a]) + 1, 0.0, last));
    }
    return box;
}

ImageGeometry cropped(const ImageGeometry& geometry, const VoxelBox& box) {
    ImageGeometry part = geometry;
    part.size = box.size();
    part.origin = geometry.index_to_world({double(box.min[0]), double(box.min[1]), double(box.min[2])});
    return part;
}

// ---------------------------------------------------------------------------------------------- images

const char* to_string(PixelType type) {
    switch (type) {
        case PixelType::UInt8: return "uint8";
        case PixelType::Int8: return "int8";
        case PixelType::UInt16: return "uint16";
        case PixelType::Int16: return "int16";
        case PixelType::UInt32: return "uint32";
        case PixelType::Int32: return "int32";
        case PixelType::Float: return "float";
        case PixelType::Double: break;
    }
    return "double";
}

std::size_t bytes_of(PixelType type) {
    return detail::with_pixel_type(type, [](auto pixel) { return sizeof(pixel); });
}

double Image::at(int i, int j, int k) const {
    if (chunks_) return chunks_->at(in_file({{i, j, k}, {i, j, k}}).min);
    const std::int64_t n =
        stride_[0] * (i - held_.min[0]) + stride_[1] * (j - held_.min[1]) + stride_[2] * (k - held_.min[2]);
    return detail::with_pixel_type(
        type_, [&](auto pixel) { return double(static_cast<const decltype(pixel)*>(data_.get())[n]); });
}

VoxelBox Image::in_file(const VoxelBox& held) const {
    VoxelBox box;
    for (int a = 0; a < 3; ++a) {
        box.min[a] = held.min[a] - held_.min[a] + first_[a];
        box.max[a] = held.max[a] - held_.min[a] + first_[a];
    }
    return box;
}

void Image::copy(const VoxelBox& box, float* out) const {
    if (!chunks_) {
        for (int k = box.min[2]; k <= box.max[2]; ++k)
            for (int j = box.min[1]; j <= box.max[1]; ++j)
                for (int i = box.min[0]; i <= box.max[0]; ++i) *out++ = static_cast<float>(at(i, j, k));
        return;
    }
    detail::with_pixel_type(type_, [&](auto pixel) {
        std::vector<decltype(pixel)> values(detail::voxel_count(box.size()));
        chunks_->copy(in_file(box), values.data());
        std::transform(values.begin(), values.end(), out, [](auto value) { return static_cast<float>(value); });
    });
}

std::optional<ChunkCount> Image::chunks() const {
    std::optional<ChunkCount> count = chunk_count_;
    if (chunks_) count->read = chunks_->read_count();
    return count;
}

Image Image::cropped() const {
    Image part = *this;
    part.geometry_ = covol::cropped(geometry_, held_);
    part.held_ = detail::whole_box(part.geometry_.size);
    return part;
}

Image Image::placed(const ImageGeometry& geometry) const {
    if (geometry.size != geometry_.size)
        throw Error(Errc::InvalidInput, path_ + ": expected " + detail::size_text(geometry.size) + " voxels, got " +
                                            detail::size_text(geometry_.size));
    Image moved = *this;
    moved.geometry_ = geometry;
    return moved;
}

template <typename T>
Image Image::copy_of(const ImageGeometry& geometry, PixelType type, const T* values) {
    Image image;
    image.geometry_ = geometry;
    image.type_ = type;
    image.held_ = detail::whole_box(geometry.size);
    image.stride_ = detail::dense_strides(geometry.size);
    const std::shared_ptr<T[]> data(new T[detail::voxel_count(geometry.size)]);
    std::copy_n(values, detail::voxel_count(geometry.size), data.get());
    image.data_ = data;
    return image;
}

Image Image::from_values(const ImageGeometry& geometry, const float* values) {
    return copy_of(geometry, PixelType::Float, values);
}

Image Image::from_values(const ImageGeometry& geometry, const std::uint8_t* values) {
    return copy_of(geometry, PixelType::UInt8, values);
}

Image Image::from_view(const ImageGeometry& geometry, const VoxelView& voxels) {
    if (geometry.size[0] < 2 || geometry.size[1] < 2 || geometry.size[2] < 2 || !voxels.first)
        throw Error(Errc::InvalidInput,
                    "image: expected at least two voxels along each axis, got " + detail::size_text(geometry.size));
    detail::check_geometry("image", geometry);
    Image image;
    image.geometry_ = geometry;
    image.type_ = voxels.type;
    image.held_ = detail::whole_box(geometry.size);
    image.data_ = voxels.first;
    image.stride_ = voxels.stride;
    image.require_finite();
    return image;
}

std::optional<VoxelView> Image::view() const {
    if (chunks_) return std::nullopt;
    return VoxelView{type_, data_, stride_};
}

}  // namespace covol
