#include "mark/bounded_image.h"

#include <utility>

namespace covol::tool {

BoundedImage::BoundedImage(Image image, std::function<Image()> open, std::uint64_t max_bytes)
    : open_(std::move(open)), max_bytes_(max_bytes), image_(std::move(image)) {}

std::uint64_t BoundedImage::decoded_bytes() const {
    if (image_.view()) return 0;  // no chunks: the whole image is in memory, or its file is mapped
    const ChunkCount chunks = image_.chunks().value_or(ChunkCount{});
    std::uint64_t bytes = chunks.read * bytes_of(image_.pixel_type());
    for (const std::int32_t n : chunks.size) bytes *= std::uint64_t(n);
    return bytes;
}

Image BoundedImage::get() {
    const std::lock_guard lock(mutex_);
    if (decoded_bytes() > max_bytes_) image_ = open_();
    return image_;
}

}  // namespace covol::tool
