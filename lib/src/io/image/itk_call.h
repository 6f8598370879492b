#pragma once
#include <itkImageIOBase.h>

#include <algorithm>
#include <string>

#include "base/while_any.h"
#include "covol/error.h"
#include "covol/image.h"

namespace covol::detail {

/// ITK's own warnings, which it would print, are off while this lives.
class QuietItk {
public:
    QuietItk() { itk::Object::SetGlobalWarningDisplay(false); }
    ~QuietItk() { itk::Object::SetGlobalWarningDisplay(before_); }
    QuietItk(const QuietItk&) = delete;
    QuietItk& operator=(const QuietItk&) = delete;

private:
    bool before_ = itk::Object::GetGlobalWarningDisplay();
};

/// Runs one call into ITK. Its warnings, which it would print, are off meanwhile, and its many-lined exceptions become
/// one line.
template <typename Call>
void with_itk(Errc code, const std::string& what, Call&& call) {
    const WhileAny<QuietItk> quiet;
    const auto one_line = [](std::string text) {
        std::replace_if(
            text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r' || c == '\t'; }, ' ');
        constexpr std::size_t kLongest = 300;
        return text.substr(0, kLongest);
    };
    try {
        call();
    } catch (const Error&) {
        throw;
    } catch (const itk::ExceptionObject& e) {
        throw Error(code, what + " (" + one_line(e.GetDescription()) + ")");
    } catch (const std::exception& e) {
        throw Error(code, what + " (" + one_line(e.what()) + ")");
    } catch (...) {  // HDF5's own exceptions have no base
        throw Error(code, what);
    }
}

/// The type of one component. @throws Error Unsupported.
PixelType itk_pixel_type(const std::string& path, const itk::ImageIOBase& io);

/// Size, spacing, origin and direction of the first three dimensions. @throws Error InvalidInput when not 3D.
ImageGeometry itk_geometry(const std::string& path, const itk::ImageIOBase& io);

}  // namespace covol::detail
