#pragma once
#include <cstdint>
#include <functional>
#include <mutex>

#include "covol/image.h"

namespace covol::tool {

/// An image for repeated computations. Images in chunks keep all decoded chunks: when these exceed the limit, the next
/// job gets a newly opened image, and the memory is released when the last job with the old one ends.
class BoundedImage {
public:
    /// @param open  opens the image again
    BoundedImage(Image image, std::function<Image()> open, std::uint64_t max_bytes);

    /// The image for one job.
    [[nodiscard]] Image get();

private:
    [[nodiscard]] std::uint64_t decoded_bytes() const;

    const std::function<Image()> open_;
    const std::uint64_t max_bytes_;
    std::mutex mutex_;
    Image image_;
};

}  // namespace covol::tool
