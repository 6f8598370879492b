#pragma once
#include <cstdint>
#include <functional>
#include <mutex>

#include "covol/image.h"

namespace covol::tool {

/// An image that is computed with again and again. Of one in chunks all that was decoded is kept: when that has become
/// too much, the next job gets the image opened anew, and the memory goes when the last job with the old one is done.
class BoundedImage {
public:
    /// @param open  opens it once more
    BoundedImage(Image image, std::function<Image()> open, std::uint64_t max_bytes);

    /// For one job.
    [[nodiscard]] Image get();

private:
    [[nodiscard]] std::uint64_t decoded_bytes() const;

    const std::function<Image()> open_;
    const std::uint64_t max_bytes_;
    std::mutex mutex_;
    Image image_;
};

}  // namespace covol::tool
