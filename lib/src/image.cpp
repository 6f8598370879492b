#include "covol/image.h"

#include <itkImageIOBase.h>
#include <itkMetaDataObject.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <vector>

#include "covol/error.h"
#include "detail/file.h"
#include "detail/raw_image.h"
#include "detail/tiff.h"

namespace covol {
namespace {

namespace fs = std::filesystem;
using detail::RawImage;

// ---------------------------------------------------------------------------------------------- geometry

/// The inverse of `direction`, by cofactors: a file's cosines are orthonormal only up to its digits.
Matrix3 inverse(const Matrix3& m) {
    Matrix3 cofactors{};
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) {
            const int a1 = (a + 1) % 3, a2 = (a + 2) % 3, b1 = (b + 1) % 3, b2 = (b + 2) % 3;
            cofactors[a][b] = m[a1][b1] * m[a2][b2] - m[a1][b2] * m[a2][b1];
        }
    const double det = m[0][0] * cofactors[0][0] + m[0][1] * cofactors[0][1] + m[0][2] * cofactors[0][2];
    Matrix3 result{};
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) result[a][b] = cofactors[b][a] / det;
    return result;
}

Vec3 multiply(const Matrix3& m, const Vec3& v) {
    Vec3 result{};
    for (int a = 0; a < 3; ++a) result[a] = m[a][0] * v[0] + m[a][1] * v[1] + m[a][2] * v[2];
    return result;
}

/// @throws Error InvalidInput, Unsupported unless spacing is positive, origin finite and the axes perpendicular.
void check_geometry(const std::string& path, const ImageGeometry& g) {
    constexpr double kTolerance = 1e-3;
    for (int a = 0; a < 3; ++a) {
        if (!(g.spacing[a] > 0) || !std::isfinite(g.spacing[a]))
            throw Error(Errc::InvalidInput, "read_image: " + path + ": expected a positive spacing, got " +
                                                std::to_string(g.spacing[a]) + " along axis " + std::to_string(a));
        if (!std::isfinite(g.origin[a]))
            throw Error(Errc::InvalidInput, "read_image: " + path + ": the origin is not finite");
        for (int b = 0; b <= a; ++b) {
            double dot = 0;
            for (int c = 0; c < 3; ++c) dot += g.direction[c][a] * g.direction[c][b];
            if (!(std::abs(dot - (a == b ? 1.0 : 0.0)) <= kTolerance))
                throw Error(Errc::Unsupported, "read_image: " + path +
                                                   ": expected perpendicular axes, got sheared or degenerate ones; "
                                                   "resample the image");
        }
    }
}

void apply_options(ImageGeometry& geometry, const ReadImageOptions& options) {
    int given = 0;
    for (int a = 0; a < 3; ++a)
        if (options.spacing[a] > 0) {
            geometry.spacing[a] = options.spacing[a];
            ++given;
        }
    if (given == 3) geometry.spacing_known = true;
}

// ---------------------------------------------------------------------------------------------- ITK

constexpr const char* kReadable = ".tif, .tiff, .nrrd, .nhdr, .nii, .nii.gz, .mha or .mhd";
constexpr const char* kWritable = ".nrrd, .nii, .nii.gz, .mha or .tif";

bool is_tiff(const std::string& extension) { return extension == ".tif" || extension == ".tiff"; }

/// ITK's reader and writer for files of this ending; null when there is none. Made directly: a static library has no
/// registered factories.
itk::ImageIOBase::Pointer make_io(const std::string& extension) {
    itk::ImageIOBase::Pointer io;
    if (extension == ".nrrd" || extension == ".nhdr")
        io = itk::NrrdImageIO::New().GetPointer();
    else if (extension == ".nii" || extension == ".nii.gz")
        io = itk::NiftiImageIO::New().GetPointer();
    else if (extension == ".mha" || extension == ".mhd")
        io = itk::MetaImageIO::New().GetPointer();
    return io;
}

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
    }
}

PixelType pixel_type(const std::string& path, const itk::ImageIOBase& io) {
    using Component = itk::IOComponentEnum;
    const auto unsupported = [&](const std::string& what) {
        return Error(
            Errc::Unsupported,
            "read_image: " + path + ": expected grey values of 8, 16 or 32 bits, float or " + "double, got " + what);
    };
    if (io.GetNumberOfComponents() != 1)
        throw unsupported(itk::ImageIOBase::GetPixelTypeAsString(io.GetPixelType()) + " pixels of " +
                          std::to_string(io.GetNumberOfComponents()) + " components (colour or vectors)");
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
            throw unsupported("pixels of type " + itk::ImageIOBase::GetComponentTypeAsString(io.GetComponentType()));
    }
}

itk::IOComponentEnum component_type(PixelType type) {
    using Component = itk::IOComponentEnum;
    switch (type) {
        case PixelType::UInt8: return Component::UCHAR;
        case PixelType::Int8: return Component::CHAR;
        case PixelType::UInt16: return Component::USHORT;
        case PixelType::Int16: return Component::SHORT;
        case PixelType::UInt32: return Component::UINT;
        case PixelType::Int32: return Component::INT;
        case PixelType::Float: return Component::FLOAT;
        case PixelType::Double: break;
    }
    return Component::DOUBLE;
}

/// The lines of a NRRD's or MetaImage's text header, lower case, for what ITK keeps to itself.
struct TextHeader {
    std::vector<std::string> lines;
    fs::path data_file;     ///< as written, of a MetaImage
    std::uint64_t end = 0;  ///< where the pixels begin

    explicit TextHeader(const std::string& path) {
        constexpr std::size_t kMost = 1000;
        std::ifstream file(path, std::ios::binary);
        std::string line;
        std::string as_written;
        while (lines.size() < kMost && std::getline(file, line) && !line.empty() && line != "\r") {
            as_written = line;
            std::transform(line.begin(), line.end(), line.begin(), [](unsigned char c) { return std::tolower(c); });
            lines.push_back(line);
            if (line.rfind("elementdatafile", 0) == 0) break;
        }
        const std::string name = value("elementdatafile");
        if (!name.empty()) data_file = as_written.substr(lines.back().rfind(name), name.size());
        if (file) end = static_cast<std::uint64_t>(file.tellg());
    }
    /// What follows "key", one of ":", ":=" or "=", and blanks; empty when there is no such line.
    [[nodiscard]] std::string value(const std::string& key) const {
        for (const std::string& line : lines) {
            if (line.rfind(key, 0) != 0) continue;
            const std::size_t separator = line.find_first_not_of(' ', key.size());
            if (separator == std::string::npos || (line[separator] != ':' && line[separator] != '=')) continue;
            const std::size_t begin = line.find_first_not_of(":= ", separator);
            const std::size_t last = line.find_last_not_of(" \r");
            return begin == std::string::npos ? "" : line.substr(begin, last + 1 - begin);
        }
        return {};
    }
    /// The data lie in another file.
    [[nodiscard]] bool detached() const {
        const std::string meta = value("elementdatafile");
        return !value("data file").empty() || !value("datafile").empty() ||
               (!meta.empty() && meta.rfind("local", 0) != 0);
    }
};

/// Unit, and whether there is a spacing at all.
void read_text_header(const TextHeader& header, ImageGeometry& geometry) {
    std::string unit;
    for (const char* key : {"space units", "units", "distanceunits", "unit"})
        if (unit.empty()) unit = header.value(key);
    // "mm" "mm" "mm": the axes have one unit in practice
    if (!unit.empty() && unit.front() == '"') unit = unit.substr(1, unit.find('"', 1) - 1);
    geometry.unit = detail::normal_unit(unit);
    geometry.spacing_known = false;
    for (const char* key : {"spacings", "space directions", "elementspacing", "elementsize"})
        geometry.spacing_known = geometry.spacing_known || !header.value(key).empty();
}

template <typename T>
T load(const char* data, bool swap) {
    T value;
    std::memcpy(&value, data, sizeof(T));
    if (swap) detail::swap_bytes(&value, 1, sizeof(T));
    return value;
}

/// What follows from the first 348 bytes of a NIfTI-1 file; empty when they are not that.
std::optional<detail::PixelPlace> nifti_pixels(const std::string& path) {
    constexpr std::int32_t kHeaderBytes = 348;
    detail::PixelPlace place;
    place.path = path;
    place.packed = detail::extension(path) == ".nii.gz";
    std::array<char, kHeaderBytes> header{};
    if (!detail::read_bytes(place, header.size(), header.data())) return std::nullopt;
    place.swap = load<std::int32_t>(header.data(), false) != kHeaderBytes;
    if (load<std::int32_t>(header.data(), place.swap) != kHeaderBytes) return std::nullopt;
    if (std::memcmp(header.data() + 344, "n+1", 4) != 0) return std::nullopt;
    switch (load<std::int16_t>(header.data() + 70, place.swap)) {
        case 2: place.type = PixelType::UInt8; break;
        case 4: place.type = PixelType::Int16; break;
        case 8: place.type = PixelType::Int32; break;
        case 16: place.type = PixelType::Float; break;
        case 64: place.type = PixelType::Double; break;
        case 256: place.type = PixelType::Int8; break;
        case 512: place.type = PixelType::UInt16; break;
        case 768: place.type = PixelType::UInt32; break;
        default: return std::nullopt;
    }
    const float offset = load<float>(header.data() + 108, place.swap);
    if (!(offset >= 0 && offset < 1e9F)) return std::nullopt;
    place.skip = std::max<std::uint64_t>(kHeaderBytes + 4, static_cast<std::uint64_t>(offset));
    const float slope = load<float>(header.data() + 112, place.swap);
    const float intercept = load<float>(header.data() + 116, place.swap);
    if (std::isfinite(slope) && std::isfinite(intercept) && slope != 0) {
        place.slope = slope;
        place.intercept = intercept;
    }
    return place;
}

/// Empty for the rare kinds that are left to ITK: ascii pixels, one file for each slice, a header to skip.
std::optional<detail::PixelPlace> meta_pixels(const std::string& path, const TextHeader& header, PixelType type) {
    const std::string file = header.value("elementdatafile");
    if (header.value("binarydata").rfind("false", 0) == 0 || !header.value("headersize").empty()) return std::nullopt;
    if (file.rfind("list", 0) == 0 || file.find('%') != std::string::npos) return std::nullopt;
    detail::PixelPlace place;
    place.path = path;
    place.file_offset = header.end;
    if (header.detached()) {
        if (!header.data_file.has_filename()) return std::nullopt;
        place.path = (fs::path(path).parent_path() / header.data_file).string();
        place.file_offset = 0;
    }
    place.packed = header.value("compresseddata").rfind("true", 0) == 0;
    const bool big = header.value("binarydatabyteordermsb").rfind("true", 0) == 0 ||
                     header.value("elementbyteordermsb").rfind("true", 0) == 0;
    place.swap = big == (std::endian::native == std::endian::little) && detail::pixel_bytes(type) > 1;
    place.type = type;
    return place;
}

/// MetaIO says on std::cerr what a header lacks; such headers do not get that far.
void require_meta_header(const TextHeader& header, const std::string& unusable) {
    for (const char* key : {"ndims", "dimsize", "elementtype", "elementdatafile"})
        if (header.value(key).empty()) throw Error(Errc::InvalidInput, unusable + " (no " + key + " in its header)");
}

RawImage read_itk(const std::string& path, const ReadImageOptions& options, bool header_only) {
    const std::string extension = detail::extension(path);
    const itk::ImageIOBase::Pointer io = make_io(extension);
    io->SetFileName(path);
    const std::string unusable = "read_image: " + path + ": damaged, truncated, or not a " + extension + " file";
    const bool is_nifti = extension.rfind(".nii", 0) == 0;
    const bool is_meta = extension.rfind(".mh", 0) == 0;
    std::optional<TextHeader> header;
    if (!is_nifti) header.emplace(path);
    if (is_meta) require_meta_header(*header, unusable);
    with_itk(Errc::InvalidInput, unusable, [&] {
        if (!io->CanReadFile(path.c_str())) throw Error(Errc::InvalidInput, unusable);
        io->ReadImageInformation();
    });

    RawImage image;
    image.type = pixel_type(path, *io);
    const unsigned dimensions = io->GetNumberOfDimensions();
    std::uint64_t size[3] = {1, 1, 1};
    std::uint64_t frames = 1;
    for (unsigned a = 0; a < dimensions; ++a) {
        if (a < 3)
            size[a] = io->GetDimensions(a);
        else
            frames *= std::min<std::uint64_t>(io->GetDimensions(a), std::uint64_t(1) << 20);
    }
    detail::require_3d(path, size);
    if (frames != 1 && options.frame < 0)
        throw Error(Errc::Unsupported, "read_image: " + path + ": expected one 3D image, got " +
                                           std::to_string(frames) + " frames; choose 0 to " +
                                           std::to_string(frames - 1) + " with --frame");
    const std::uint64_t frame = options.frame < 0 ? 0 : std::uint64_t(options.frame);
    if (frame >= frames)
        throw Error(Errc::InvalidOptions, "read_image: " + path + ": frame " + std::to_string(frame) +
                                              " does not exist; choose 0 to " + std::to_string(frames - 1));
    ImageGeometry& geometry = image.geometry;
    for (unsigned a = 0; a < 3; ++a) {
        geometry.size[a] = static_cast<std::int32_t>(size[a]);
        geometry.spacing[a] = io->GetSpacing(a);
        geometry.origin[a] = io->GetOrigin(a);
        const std::vector<double> axis = io->GetDirection(a);
        for (unsigned b = 0; b < 3; ++b) geometry.direction[b][a] = b < axis.size() ? axis[b] : 0;
    }
    if (header)
        read_text_header(*header, geometry);
    else
        geometry.unit = "mm";  // ITK converts NIfTI to millimetres
    if (header_only) return image;

    const std::uint64_t voxels = size[0] * size[1] * size[2];
    if (voxels / size[0] / size[1] != size[2] || voxels > (std::uint64_t(1) << 50) / frames)
        throw Error(Errc::InvalidInput,
                    "read_image: " + path + ": the header claims " + detail::size_text(geometry.size) + " voxels");
    const std::shared_ptr<void> data = detail::allocate_pixels(path, voxels * frames, image.type,
                                                               header && header->detached() ? 0 : fs::file_size(path));
    std::optional<detail::PixelPlace> place;
    if (is_nifti) place = nifti_pixels(path);
    if (is_meta) place = meta_pixels(path, *header, image.type);
    if (place) {
        if (!detail::read_pixels(*place, voxels * frames, image.type, data.get()))
            throw Error(Errc::InvalidInput, unusable);
    } else if (is_nifti) {
        throw Error(Errc::Unsupported,
                    "read_image: " + path + ": expected a NIfTI-1 file in one piece with grey values");
    } else {
        itk::ImageIORegion region(dimensions);
        for (unsigned a = 0; a < dimensions; ++a) region.SetSize(a, io->GetDimensions(a));
        io->SetIORegion(region);
        with_itk(Errc::InvalidInput, unusable, [&] { io->Read(data.get()); });
    }
    image.data =
        std::shared_ptr<void>(data, static_cast<char*>(data.get()) + frame * voxels * detail::pixel_bytes(image.type));
    return image;
}

RawImage read_raw(const std::string& path, const ReadImageOptions& options, bool header_only, const RunContext& run) {
    const std::string extension = detail::extension(path);
    std::error_code status;
    if (!fs::exists(path, status)) throw Error(Errc::Io, "read_image: " + path + ": no such file");
    if (!fs::is_regular_file(path, status) || !std::ifstream(path).good())
        throw Error(Errc::Io, "read_image: " + path + ": cannot be opened");
    if (!is_tiff(extension) && make_io(extension).IsNull())
        throw Error(Errc::Unsupported,
                    "read_image: " + path + ": expected a name ending in " + kReadable + ", got '" + extension + "'");
    if (fs::file_size(path) == 0) throw Error(Errc::InvalidInput, "read_image: " + path + ": the file is empty");
    RawImage image =
        is_tiff(extension) ? detail::read_tiff(path, options, header_only, run) : read_itk(path, options, header_only);
    apply_options(image.geometry, options);
    check_geometry(path, image.geometry);
    return image;
}

// ---------------------------------------------------------------------------------------------- sampling

/// image index = matrix * frame index + offset
struct LatticeMap {
    Matrix3 matrix{};
    Vec3 offset{};
    std::array<int, 3> image_axis{-1, -1, -1};  ///< the one image axis that moves with a frame axis, where separable
    bool separable = true;
};

LatticeMap map_lattice(const ImageGeometry& geometry, const Domain& frame) {
    LatticeMap map;
    map.offset = geometry.world_to_index(frame.origin);
    const Matrix3 to_axes = inverse(geometry.direction);
    constexpr double kSmall = 1e-6;
    for (int a = 0; a < 3; ++a) {
        int used = 0;
        for (int b = 0; b < 3; ++b) {
            map.matrix[a][b] = to_axes[a][b] * frame.voxel_size / geometry.spacing[a];
            if (std::abs(to_axes[a][b]) < kSmall) continue;
            ++used;
            map.image_axis[b] = a;
        }
        map.separable = map.separable && used == 1;
    }
    return map;
}

/// Linear interpolation along one axis: (1-weight) * data[offset] + weight * data[offset + step].
struct Tap {
    std::int64_t offset = 0;
    std::int64_t step = 0;  ///< 0 where the position is a voxel's centre, or outside
    double weight = 0;
};

Tap make_tap(double position, std::int32_t size, std::int64_t stride) {
    // Lattices that should coincide differ by the rounding of a file's spacing.
    constexpr double kSame = 1e-4;
    const double clamped = std::clamp(position, 0.0, double(size - 1));
    const auto below = static_cast<std::int64_t>(clamped);
    const double weight = clamped - double(below);
    if (weight < kSame) return {below * stride, 0, 0};
    if (weight > 1 - kSame) return {(below + 1) * stride, 0, 0};
    return {below * stride, stride, weight};
}

/// What interpolation is computed in: single precision where it holds every value of T.
template <typename T>
using Work = std::conditional_t<sizeof(T) <= 2 || std::is_same_v<T, float>, float, double>;

template <typename T>
Work<T> interpolate(const T* data, const Tap& x, const Tap& y, const Tap& z) {
    using W = Work<T>;
    const auto along_x = [&](const T* p) { return W(p[0]) + W(x.weight) * (W(p[x.step]) - W(p[0])); };
    const auto along_xy = [&](const T* p) {
        const W first = along_x(p);
        return y.step == 0 ? first : first + W(y.weight) * (along_x(p + y.step) - first);
    };
    const T* p = data + x.offset + y.offset + z.offset;
    const W first = along_xy(p);
    return z.step == 0 ? first : first + W(z.weight) * (along_xy(p + z.step) - first);
}

struct Lattice {
    std::array<std::int32_t, 3> size;
    std::array<std::int64_t, 3> stride;
};

/// Every frame axis moves along one image axis: taps are made once per axis.
template <typename T>
void sample_separable(const T* data, const Lattice& image, const LatticeMap& map, const Index3& min, const Index3& max,
                      float* out) {
    std::array<std::vector<Tap>, 3> taps;
    for (int b = 0; b < 3; ++b) {
        const int a = map.image_axis[b];
        taps[b].reserve(static_cast<std::size_t>(max[b] - min[b] + 1));
        for (std::int32_t n = min[b]; n <= max[b]; ++n)
            taps[b].push_back(make_tap(map.matrix[a][b] * n + map.offset[a], image.size[a], image.stride[a]));
    }
    const auto on_centres = [](const std::vector<Tap>& t) {
        return std::all_of(t.begin(), t.end(), [](const Tap& tap) { return tap.step == 0; });
    };
    const bool copy = on_centres(taps[0]) && on_centres(taps[1]) && on_centres(taps[2]);
    for (const Tap& i : taps[0])
        for (const Tap& j : taps[1]) {
            if (copy) {
                const T* row = data + i.offset + j.offset;
                for (const Tap& k : taps[2]) *out++ = static_cast<float>(row[k.offset]);
            } else {
                for (const Tap& k : taps[2]) *out++ = static_cast<float>(interpolate(data, k, i, j));
            }
        }
}

template <typename T>
void sample_affine(const T* data, const Lattice& image, const LatticeMap& map, const Index3& min, const Index3& max,
                   float* out) {
    for (std::int32_t i = min[0]; i <= max[0]; ++i)
        for (std::int32_t j = min[1]; j <= max[1]; ++j) {
            const Vec3 row = multiply(map.matrix, {double(i), double(j), 0});
            for (std::int32_t k = min[2]; k <= max[2]; ++k) {
                const auto tap = [&](int a) {
                    return make_tap(row[a] + map.matrix[a][2] * k + map.offset[a], image.size[a], image.stride[a]);
                };
                *out++ = static_cast<float>(interpolate(data, tap(0), tap(1), tap(2)));
            }
        }
}

// ---------------------------------------------------------------------------------------------- values

std::size_t voxel_count(const ImageGeometry& g) {
    return std::size_t(g.size[0]) * std::size_t(g.size[1]) * std::size_t(g.size[2]);
}

struct MinMax {
    double min = std::numeric_limits<double>::infinity();
    double max = -std::numeric_limits<double>::infinity();
    bool finite = true;
};

template <typename T>
MinMax scan(const T* data, std::size_t count) {
    constexpr std::size_t kGrain = std::size_t(1) << 18;
    return tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, count, kGrain), MinMax{},
        [&](const tbb::blocked_range<std::size_t>& r, MinMax so_far) {
            T lo = std::numeric_limits<T>::max();
            T hi = std::numeric_limits<T>::lowest();
            bool finite = true;
            for (std::size_t n = r.begin(); n != r.end(); ++n) {
                lo = std::min(lo, data[n]);
                hi = std::max(hi, data[n]);
                if constexpr (std::is_floating_point_v<T>) finite = finite && std::isfinite(data[n]);
            }
            return MinMax{std::min(so_far.min, double(lo)), std::max(so_far.max, double(hi)), so_far.finite && finite};
        },
        [](const MinMax& a, const MinMax& b) {
            return MinMax{std::min(a.min, b.min), std::max(a.max, b.max), a.finite && b.finite};
        });
}

/// @throws Error InvalidInput that names the first voxel which is not finite.
void require_finite(const std::string& path, const RawImage& image) {
    detail::with_pixel_type(image.type, [&](auto pixel) {
        using T = decltype(pixel);
        if constexpr (std::is_floating_point_v<T>) {
            const T* data = static_cast<const T*>(image.data.get());
            const std::size_t count = voxel_count(image.geometry);
            if (scan(data, count).finite) return;
            const std::size_t first = static_cast<std::size_t>(
                std::find_if(data, data + count, [](T v) { return !std::isfinite(v); }) - data);
            const auto nx = std::size_t(image.geometry.size[0]);
            const auto ny = std::size_t(image.geometry.size[1]);
            throw Error(Errc::InvalidInput, "read_image: " + path +
                                                ": expected finite values, got NaN or infinity at " + "voxel (" +
                                                std::to_string(first % nx) + ", " + std::to_string(first / nx % ny) +
                                                ", " + std::to_string(first / nx / ny) + ")");
        }
    });
}

template <typename T>
std::shared_ptr<const void> copy_of(const T* values, std::size_t count) {
    std::shared_ptr<T[]> data(new T[count]);
    std::copy_n(values, count, data.get());
    return data;
}

// ---------------------------------------------------------------------------------------------- writing

using Metadata = std::vector<std::pair<std::string, std::string>>;

void write_itk(const std::string& path, const ImageGeometry& g, PixelType type, const void* values, const Metadata& metadata) {
    const itk::ImageIOBase::Pointer io = make_io(detail::extension(path));
    with_itk(Errc::Io, "write_image: " + path + ": cannot write", [&] {
        io->SetFileName(path);
        io->SetNumberOfDimensions(3);
        itk::ImageIORegion region(3);
        for (unsigned a = 0; a < 3; ++a) {
            io->SetDimensions(a, static_cast<itk::SizeValueType>(g.size[a]));
            io->SetSpacing(a, g.spacing[a]);
            io->SetOrigin(a, g.origin[a]);
            io->SetDirection(a, std::vector<double>{g.direction[0][a], g.direction[1][a], g.direction[2][a]});
            region.SetSize(a, static_cast<itk::SizeValueType>(g.size[a]));
        }
        io->SetIORegion(region);
        io->SetNumberOfComponents(1);
        io->SetPixelType(itk::IOPixelEnum::SCALAR);
        io->SetComponentType(component_type(type));
        io->SetUseCompression(true);
        // ITK has no field for the unit; as a key of our own the file keeps it, and read_image finds it again.
        if (!g.unit.empty()) itk::EncapsulateMetaData<std::string>(io->GetMetaDataDictionary(), "unit", g.unit);
        if (detail::extension(path) == ".nrrd")
            for (const auto& [key, value] : metadata)
                itk::EncapsulateMetaData<std::string>(io->GetMetaDataDictionary(), key, value);
        io->WriteImageInformation();
        io->Write(values);
    });
}

void write_values(const std::string& path, const ImageGeometry& geometry, PixelType type, const void* values,
                  const Metadata& metadata = {}) {
    check_image_extension(path);
    for (int a = 0; a < 3; ++a)
        if (geometry.size[a] < 1 || !(geometry.spacing[a] > 0))
            throw Error(Errc::InvalidInput, "write_image: " + path + ": expected voxels along every axis, got " +
                                                detail::size_text(geometry.size));
    detail::write_atomically(path, [&](const std::string& temporary) {
        if (is_tiff(detail::extension(path)))
            detail::write_tiff(temporary, geometry, type, values);
        else
            write_itk(temporary, geometry, type, values, metadata);
    });
}

}  // namespace

// ------------------------------------------------------------------------------------------------ public

Vec3 ImageGeometry::index_to_world(const Vec3& index) const {
    const Vec3 moved = multiply(direction, {index[0] * spacing[0], index[1] * spacing[1], index[2] * spacing[2]});
    return {origin[0] + moved[0], origin[1] + moved[1], origin[2] + moved[2]};
}

Vec3 ImageGeometry::world_to_index(const Vec3& world) const {
    const Vec3 moved = multiply(inverse(direction), {world[0] - origin[0], world[1] - origin[1], world[2] - origin[2]});
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

double Image::at(int i, int j, int k) const {
    const std::size_t n =
        (std::size_t(k) * std::size_t(geometry_.size[1]) + std::size_t(j)) * std::size_t(geometry_.size[0]) +
        std::size_t(i);
    return detail::with_pixel_type(
        type_, [&](auto pixel) { return double(static_cast<const decltype(pixel)*>(data_.get())[n]); });
}

void Image::sample(const Domain& frame, const Index3& min, const Index3& max, float* out) const {
    const LatticeMap map = map_lattice(geometry_, frame);
    const Lattice lattice{geometry_.size,
                          {1, geometry_.size[0], std::int64_t(geometry_.size[0]) * std::int64_t(geometry_.size[1])}};
    detail::with_pixel_type(type_, [&](auto pixel) {
        const auto* data = static_cast<const decltype(pixel)*>(data_.get());
        if (map.separable)
            sample_separable(data, lattice, map, min, max, out);
        else
            sample_affine(data, lattice, map, min, max, out);
    });
}

std::array<double, 2> Image::percentiles(double low, double high) const {
    constexpr double kSamples = 4e6;
    const double ratio = double(voxel_count(geometry_)) / kSamples;
    const auto step = static_cast<std::int32_t>(std::max(1.0, std::ceil(std::cbrt(ratio))));
    return detail::with_pixel_type(type_, [&](auto pixel) {
        using T = decltype(pixel);
        const T* data = static_cast<const T*>(data_.get());
        std::vector<T> values;
        const auto [nx, ny, nz] = geometry_.size;
        for (std::int64_t k = 0; k < nz; k += step)
            for (std::int64_t j = 0; j < ny; j += step)
                for (std::int64_t i = 0; i < nx; i += step) values.push_back(data[(k * ny + j) * nx + i]);
        const auto value_at = [&](double fraction) {
            const double place = std::clamp(fraction, 0.0, 1.0) * double(values.size() - 1);
            const auto nth = values.begin() + static_cast<std::ptrdiff_t>(std::lround(place));
            std::nth_element(values.begin(), nth, values.end());
            return double(*nth);
        };
        const double first = value_at(low);
        return std::array<double, 2>{first, value_at(high)};
    });
}

std::array<double, 2> Image::range() const {
    const MinMax result = detail::with_pixel_type(type_, [&](auto pixel) {
        return scan(static_cast<const decltype(pixel)*>(data_.get()), voxel_count(geometry_));
    });
    return {result.min, result.max};
}

Image Image::from_values(const ImageGeometry& geometry, const float* values) {
    Image image;
    image.geometry_ = geometry;
    image.type_ = PixelType::Float;
    image.data_ = copy_of(values, voxel_count(geometry));
    return image;
}

Image Image::from_values(const ImageGeometry& geometry, const std::uint8_t* values) {
    Image image;
    image.geometry_ = geometry;
    image.type_ = PixelType::UInt8;
    image.data_ = copy_of(values, voxel_count(geometry));
    return image;
}

Image read_image(const std::string& path, const ReadImageOptions& options, const RunContext& run) {
    Image image;
    with_threads(run, [&] {
        RawImage raw = read_raw(path, options, false, run);
        require_finite(path, raw);
        image.geometry_ = raw.geometry;
        image.type_ = raw.type;
        image.path_ = path;
        image.data_ = std::move(raw.data);
    });
    return image;
}

ImageGeometry read_image_geometry(const std::string& path, const ReadImageOptions& options) {
    return read_raw(path, options, true, {}).geometry;
}

void write_image(const std::string& path, const ImageGeometry& geometry, const std::int32_t* labels) {
    write_values(path, geometry, PixelType::Int32, labels);
}

void write_image(const std::string& path, const ImageGeometry& geometry, const std::uint8_t* values,
                 const std::vector<std::pair<std::string, std::string>>& metadata) {
    write_values(path, geometry, PixelType::UInt8, values, metadata);
}

void write_image(const std::string& path, const ImageGeometry& geometry, const std::uint8_t* values) {
    write_values(path, geometry, PixelType::UInt8, values);
}

void write_image(const std::string& path, const ImageGeometry& geometry, const float* values) {
    write_values(path, geometry, PixelType::Float, values);
}

void check_image_extension(const std::string& path) {
    const std::string extension = detail::extension(path);
    for (const char* known : {".nrrd", ".nii", ".nii.gz", ".mha", ".tif", ".tiff"})
        if (extension == known) return;
    throw Error(Errc::InvalidOptions,
                "write_image: " + path + ": expected a name ending in " + kWritable + ", got '" + extension + "'");
}

}  // namespace covol
