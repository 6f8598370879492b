#pragma once
#include <itkImageIOBase.h>

#include <algorithm>
#include <string>

#include "covol/error.h"
#include "covol/image.h"

namespace covol::detail {

/// Runs one call into ITK. Its warnings, which it would print, are off meanwhile, and its many-lined exceptions become
/// one line.
template <typename Call>
void with_itk(Errc code, const std::string& what, Call&& call) {
    struct Quiet {
        bool before = itk::Object::GetGlobalWarningDisplay();
        Quiet() { itk::Object::SetGlobalWarningDisplay(false); }
        ~Quiet() { itk::Object::SetGlobalWarningDisplay(before); }
    } quiet;
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
