#include <png.h>

#include "covol/error.h"
#include "covol/picture.h"
#include "files/atomic.h"

namespace covol {

void write_png(const std::string& path, const Picture& picture) {
    detail::write_atomically(path, [&](const std::string& temporary) {
        png_image png{};
        png.version = PNG_IMAGE_VERSION;
        png.width = static_cast<png_uint_32>(picture.width);
        png.height = static_cast<png_uint_32>(picture.height);
        png.format = PNG_FORMAT_RGB;
        if (png_image_write_to_file(&png, temporary.c_str(), 0, picture.rgb.data(), 0, nullptr) == 0)
            throw Error(Errc::Io, path + ": " + png.message);
    });
}

}  // namespace covol
