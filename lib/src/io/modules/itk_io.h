#pragma once
#include <itkImageIOBase.h>

#include <algorithm>
#include <string>

#include "base/while_any.h"
#include "covol/error.h"
#include "io/modules/modules.h"

namespace covol::detail {

/// Prevents ITK from printing warnings while this object exists. The class has default visibility, so that all modules
/// use the same class, and the same count of its objects in WhileAny.
class __attribute__((visibility("default"))) QuietItk {
public:
    QuietItk() { itk::Object::SetGlobalWarningDisplay(false); }
    ~QuietItk() { itk::Object::SetGlobalWarningDisplay(before_); }
    QuietItk(const QuietItk&) = delete;
    QuietItk& operator=(const QuietItk&) = delete;

private:
    bool before_ = itk::Object::GetGlobalWarningDisplay();
};

/// Calls a function of ITK. ITK prints no warnings meanwhile, and its exceptions, which have several lines, are
/// converted to errors of one line.
template <typename Call>
void with_itk(const std::string& unusable, Call&& call) {
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
        throw Error(Errc::InvalidInput, unusable + " (" + one_line(e.GetDescription()) + ")");
    } catch (const std::exception& e) {
        throw Error(Errc::InvalidInput, unusable + " (" + one_line(e.what()) + ")");
    } catch (...) {  // HDF5's C++ exceptions are not derived from std::exception
        throw Error(Errc::InvalidInput, unusable);
    }
}

inline PixelType itk_pixel_type(const std::string& path, const itk::ImageIOBase& io) {
    using Component = itk::IOComponentEnum;
    switch (io.GetComponentType()) {
        case Component::UCHAR: return PixelType::UInt8;
        case Component::CHAR: return PixelType::Int8;
        case Component::USHORT: return PixelType::UInt16;
        case Component::SHORT: return PixelType::Int16;
        case Component::UINT: return PixelType::UInt32;
        case Component::INT: return PixelType::Int32;
        case Component::FLOAT: return PixelType::Float;
        case Component::DOUBLE: return PixelType::Double;
        default:
            throw Error(Errc::Unsupported, path + ": expected values of 8, 16 or 32 bits, float or double, got " +
                                               itk::ImageIOBase::GetComponentTypeAsString(io.GetComponentType()));
    }
}

/// Reads an image with `Io`, one of the classes of ITK such as itk::NrrdImageIO. ITK's factories are not used, because
/// a static library does not register them.
template <typename Io>
class ItkIo : public ItkReader {
public:
    ItkIo(const std::string& path, std::string unusable) : unusable_(std::move(unusable)) {
        io_->SetFileName(path);
        with_itk(unusable_, [&] {
            if (!io_->CanReadFile(path.c_str())) throw Error(Errc::InvalidInput, unusable_);
            io_->ReadImageInformation();
        });
        header_.type = itk_pixel_type(path, *io_);
        header_.components = io_->GetNumberOfComponents();
        header_.is_rgb = io_->GetPixelType() == itk::IOPixelEnum::RGB;
        header_.bytes = io_->GetImageSizeInBytes();
        if constexpr (requires { io_->GetRescaleSlope(); }) {
            header_.slope = io_->GetRescaleSlope();
            header_.intercept = io_->GetRescaleIntercept();
        }
        for (unsigned a = 0; a < io_->GetNumberOfDimensions(); ++a) {
            header_.size.push_back(io_->GetDimensions(a));
            header_.spacing.push_back(io_->GetSpacing(a));
            header_.origin.push_back(io_->GetOrigin(a));
            header_.axes.push_back(io_->GetDirection(a));
        }
    }

    void read(const std::vector<std::uint64_t>& begin, const std::vector<std::uint64_t>& size, void* out) override {
        itk::ImageIORegion region(unsigned(size.size()));
        for (unsigned a = 0; a < size.size(); ++a) {
            region.SetIndex(a, itk::IndexValueType(begin[a]));
            region.SetSize(a, size[a]);
        }
        io_->SetIORegion(region);
        with_itk(unusable_, [&] { io_->Read(out); });
    }

private:
    typename Io::Pointer io_ = Io::New();
    std::string unusable_;
};

template <typename Io>
std::unique_ptr<ItkReader> open_with(const std::string& path, const std::string& unusable) {
    return std::make_unique<ItkIo<Io>>(path, unusable);
}

}  // namespace covol::detail
