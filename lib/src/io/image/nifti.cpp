// NIfTI-1. ITK's reader is not used: it rejects sheared lattices, and its rule for the choice between sform and qform
// differs from that of open_nifti().
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <sstream>

#include "base/number.h"
#include "io/image/image_formats.h"
#include "io/pixels/nifti_space.h"

namespace covol::detail {
namespace {

/// Maps voxel (i, j, k) to RAS, in the file's unit.
struct NiftiAffine {
    Matrix3 matrix{};
    Vec3 origin{};

    [[nodiscard]] Vec3 at(const Vec3& index) const {
        Vec3 place = origin;
        for (std::size_t w = 0; w < 3; ++w)
            for (std::size_t a = 0; a < 3; ++a) place[w] += matrix[w][a] * index[a];
        return place;
    }
    [[nodiscard]] double step(std::size_t axis) const {
        return std::sqrt(matrix[0][axis] * matrix[0][axis] + matrix[1][axis] * matrix[1][axis] +
                         matrix[2][axis] * matrix[2][axis]);
    }
};

template <typename T>
T load(const char* data, bool swap) {
    T value;
    std::memcpy(&value, data, sizeof(T));
    if (swap) swap_bytes(&value, 1, sizeof(T));
    return value;
}

std::optional<PixelType> nifti_type(int code) {
    switch (code) {
        case 2: return PixelType::UInt8;
        case 4: return PixelType::Int16;
        case 8: return PixelType::Int32;
        case 16: return PixelType::Float;
        case 64: return PixelType::Double;
        case 256: return PixelType::Int8;
        case 512: return PixelType::UInt16;
        case 768: return PixelType::UInt32;
        default: return std::nullopt;
    }
}

/// The header of a NIfTI-1 file: its first 348 bytes.
class NiftiHeader {
public:
    /// @throws Error InvalidInput, Unsupported (NIfTI-2).
    NiftiHeader(const PixelPlace& begin, const std::string& unusable) {
        if (!read_bytes(begin, bytes_.size(), bytes_.data())) throw Error(Errc::InvalidInput, unusable);
        const auto size = load<std::int32_t>(bytes_.data(), false), swapped = load<std::int32_t>(bytes_.data(), true);
        constexpr std::int32_t kVersion2 = 540;
        if (size == kVersion2 || swapped == kVersion2)
            throw Error(Errc::Unsupported, begin.path + ": NIfTI-2 is not read; convert it to NIfTI-1");
        swap_ = size != std::int32_t(bytes_.size());
        if (swap_ && swapped != std::int32_t(bytes_.size())) throw Error(Errc::InvalidInput, unusable);
        for (const auto& [first, count] : {std::pair(nifti::kPixdim, 4), std::pair(nifti::kQuatern, 6 + 12)})
            for (int n = 0; n < count; ++n)
                if (!(std::abs(number(first + 4 * std::size_t(n))) < 1e9))
                    throw Error(
                        Errc::InvalidInput,
                        unusable + " (expected a spacing, an origin and a direction of finite numbers below 1e9)");
        if (dimensions() < 1 || dimensions() > 7) throw Error(Errc::InvalidInput, unusable);
        for (int a = 0; a < dimensions(); ++a)
            if (integer(kDim + 2 + 2 * std::size_t(a)) < 0) throw Error(Errc::InvalidInput, unusable);
    }
    [[nodiscard]] bool swap() const { return swap_; }
    [[nodiscard]] double number(std::size_t at) const { return double(load<float>(bytes_.data() + at, swap_)); }
    [[nodiscard]] int integer(std::size_t at) const { return load<std::int16_t>(bytes_.data() + at, swap_); }
    [[nodiscard]] int dimensions() const { return integer(kDim); }
    /// Sizes along the dimensions; 1 along those that the file does not have.
    [[nodiscard]] std::array<std::uint64_t, 7> sizes() const {
        std::array<std::uint64_t, 7> sizes{1, 1, 1, 1, 1, 1, 1};
        for (int a = 0; a < dimensions(); ++a)
            sizes[a] = std::max(a < 3 ? 0 : 1, integer(kDim + 2 + 2 * std::size_t(a)));
        return sizes;
    }
    [[nodiscard]] bool in_one_piece() const { return std::memcmp(bytes_.data() + 344, "n+1", 4) == 0; }
    /// Index into kNiftiUnits of the unit of length; 0 if the header states none or an unknown one.
    [[nodiscard]] std::size_t unit() const {
        const auto code = std::size_t(bytes_[123] & 7);
        return code < kNiftiUnits.size() ? code : 0;
    }
    [[nodiscard]] std::string unit_name() const { return unit() > 0 ? kNiftiUnits[unit()] : "mm"; }

private:
    static constexpr std::size_t kDim = 40;
    std::array<char, 348> bytes_{};
    bool swap_ = false;
};

/// Position of the pixels; empty if the pixels are in another file or are not grey values. Adds header fields to
/// `info`.
std::optional<PixelPlace> nifti_pixels(const NiftiHeader& header, PixelPlace place, ImageInfo& info) {
    const auto type = nifti_type(header.integer(70));
    const double offset = header.number(108), slope = header.number(112), intercept = header.number(116);
    constexpr double kMinOffset = 352;
    if (!type || !header.in_one_piece() || !(offset >= 0 && offset < 1e9)) return std::nullopt;
    place.swap = header.swap() && pixel_bytes(*type) > 1;
    place.type = *type;
    place.skip = static_cast<std::uint64_t>(std::max(kMinOffset, offset));
    if (std::isfinite(slope) && std::isfinite(intercept) && slope != 0) {
        place.slope = slope;
        place.intercept = intercept;
    }
    std::ostringstream pixdim;
    for (std::size_t a = 0; a < 3; ++a) pixdim << (a == 0 ? "" : " ") << header.number(80 + 4 * a);
    info.format = "NIfTI-1";
    info.fields = {{"pixdim", pixdim.str()},
                   {"xyzt_units", header.unit() > 0 ? header.unit_name() : "not stated, taken as mm"},
                   {"qform_code", std::to_string(header.integer(nifti::kCodes))},
                   {"sform_code", std::to_string(header.integer(nifti::kCodes + 2))}};
    return place;
}

/// The spacing: the absolute values of pixdim, which may be negative.
Vec3 pixdim_of(const NiftiHeader& header) {
    return {std::abs(header.number(80)), std::abs(header.number(84)), std::abs(header.number(88))};
}

NiftiAffine sform_of(const NiftiHeader& header) {
    NiftiAffine sform;
    for (std::size_t w = 0; w < 3; ++w) {
        for (std::size_t a = 0; a < 3; ++a) sform.matrix[w][a] = header.number(nifti::kSrow + 16 * w + 4 * a);
        sform.origin[w] = header.number(nifti::kSrow + 16 * w + 12);
    }
    return sform;
}

/// The qform as "method 2" of https://nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h.
NiftiAffine qform_of(const NiftiHeader& header) {
    double b = header.number(nifti::kQuatern), c = header.number(nifti::kQuatern + 4),
           d = header.number(nifti::kQuatern + 8);
    const double square = b * b + c * c + d * d, a = std::sqrt(std::max(0.0, 1 - square));
    if (square > 1)  // for a rotation by 180 degrees, the square is 1, and rounding errors may increase it
        for (double* part : {&b, &c, &d}) *part /= std::sqrt(square);
    NiftiAffine qform;
    qform.matrix = {{{a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)},
                     {2 * (b * c + a * d), a * a + c * c - b * b - d * d, 2 * (c * d - a * b)},
                     {2 * (b * d - a * c), 2 * (c * d + a * b), a * a + d * d - b * b - c * c}}};
    Vec3 step = pixdim_of(header);
    if (header.number(nifti::kPixdim) < 0) step[2] = -step[2];
    for (std::size_t w = 0; w < 3; ++w) {
        for (std::size_t n = 0; n < 3; ++n) qform.matrix[w][n] *= step[n];
        qform.origin[w] = header.number(nifti::kQuatern + 12 + 4 * w);
    }
    return qform;
}

/// The map to RAS coordinates if sform_code and qform_code are both 0. As in nibabel, the image's first axis points to
/// the patient's left, and the centre of the image is at 0.
NiftiAffine base_of(const NiftiHeader& header, const Index3& size) {
    const Vec3 step = pixdim_of(header);
    NiftiAffine base;
    for (std::size_t a = 0; a < 3; ++a) {
        base.matrix[a][a] = a == 0 ? -step[a] : step[a];
        base.origin[a] = -0.5 * (size[a] - 1) * base.matrix[a][a];
    }
    return base;
}

/// The maximum over the corner voxels of the image of the distance between their positions under the two maps.
double distance_between(const NiftiAffine& p, const NiftiAffine& q, const Index3& size) {
    double maximum = 0;
    for (unsigned corner = 0; corner < 8; ++corner) {
        Vec3 index{};
        for (std::size_t a = 0; a < 3; ++a) index[a] = (corner >> a & 1) != 0 ? size[a] - 1 : 0;
        const Vec3 one = p.at(index), other = q.at(index);
        maximum = std::max(maximum, std::hypot(one[0] - other[0], one[1] - other[1], one[2] - other[2]));
    }
    return maximum;
}

bool is_invertible(const NiftiAffine& affine) {
    const Matrix3& m = affine.matrix;
    const double det = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                       m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                       m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
    return std::abs(det) > 1e-6 * affine.step(0) * affine.step(1) * affine.step(2);
}

std::string steps_text(const Vec3& v) { return number(v[0]) + " x " + number(v[1]) + " x " + number(v[2]); }

/// Chooses between sform, qform and pixdim, reports the choice, and warns if the header is inconsistent.
class NiftiPlace {
public:
    NiftiPlace(const std::string& path, const NiftiHeader& header, ImageInfo& info, const RunContext& run)
        : path_(path), header_(header), info_(info), run_(run) {}

    void fill() {
        const int qcode = header_.integer(nifti::kCodes), scode = header_.integer(nifti::kCodes + 2);
        const NiftiAffine sform = sform_of(header_), qform = qform_of(header_);
        const bool by_sform = scode > 0 && is_invertible(sform), by_qform = !by_sform && qcode > 0;
        if (scode > 0 && !by_sform) {
            if (!by_qform)
                throw read_error(Errc::InvalidInput, path_,
                                 "sform_code is " + std::to_string(scode) +
                                     ", but the sform's rows form no invertible matrix; correct srow_x, y, z, or set "
                                     "sform_code to 0");
            run_.warn(path_ + ": sform_code is " + std::to_string(scode) +
                      ", but the sform's rows form no invertible matrix: the qform is used");
        }
        use(by_sform ? sform : by_qform ? qform : base_of(header_, info_.geometry.size), by_sform);
        info_.fields.emplace_back("place of the voxels",
                                  by_sform    ? "the sform, because sform_code > 0"
                                  : scode > 0 ? "the qform, because the sform is not invertible"
                                  : by_qform  ? "the qform, because sform_code is 0"
                                              : "pixdim, with the image's centre at 0, because both codes are 0");
        if (by_sform && qcode > 0) compare(sform, qform);
        if (by_sform) compare_steps();
    }

private:
    /// Sets the geometry from an affine map, and converts it from RAS to LPS.
    void use(const NiftiAffine& affine, bool by_sform) {
        ImageGeometry& g = info_.geometry;
        const Vec3 pixdim = pixdim_of(header_);
        for (std::size_t a = 0; a < 3; ++a) {
            const double step = affine.step(a);
            info_.spacing_known[a] = by_sform || pixdim[a] > 0;
            g.spacing[a] = info_.spacing_known[a] ? step : 1;
            for (std::size_t w = 0; w < 3; ++w) {
                const double along = step > 0 ? affine.matrix[w][a] / step : (a == w ? 1 : 0);
                g.direction[w][a] = w < 2 ? -along : along;
            }
            g.origin[a] = a < 2 ? -affine.origin[a] : affine.origin[a];
        }
    }

    void compare(const NiftiAffine& sform, const NiftiAffine& qform) {
        const ImageGeometry& g = info_.geometry;
        const double apart = distance_between(sform, qform, g.size), voxels = apart / g.smallest_spacing();
        const std::string text =
            number(apart) + " " + g.unit + " (" + number(std::round(100 * voxels) / 100) + " voxels)";
        info_.fields.emplace_back("qform and sform", "apart by up to " + text);
        if (voxels > 0.5)
            run_.warn(path_ + ": its qform and sform place the same voxel up to " + text +
                      " apart: the sform is used, as nibabel does; if that is wrong, set sform_code to 0");
    }

    void compare_steps() {
        const Vec3 pixdim = pixdim_of(header_);
        const Vec3& spacing = info_.geometry.spacing;
        bool alike = true;
        for (std::size_t a = 0; a < 3; ++a) alike = alike && std::abs(pixdim[a] - spacing[a]) <= 0.01 * spacing[a];
        if (!alike)
            run_.warn(path_ + ": pixdim states a spacing of " + steps_text(pixdim) + ", the sform one of " +
                      steps_text(spacing) + ": the sform is used, as nibabel does; `spacing = sx,sy,sz` gives another");
    }

    const std::string& path_;
    const NiftiHeader& header_;
    ImageInfo& info_;
    const RunContext& run_;
};

/// The type of the pixels after they are multiplied by the slope and the intercept is added.
PixelType rescaled_nifti_type(const PixelPlace& place) {
    if (place.slope == 1 && place.intercept == 0) return place.type;
    return place.type == PixelType::Double ? PixelType::Double : PixelType::Float;
}

}  // namespace

std::unique_ptr<ImageFile> open_nifti(const std::string& path, const RunContext& run) {
    const bool is_packed = path.size() > 3 && (path.ends_with(".gz") || path.ends_with(".GZ"));
    PixelPlace begin;
    begin.path = path;
    begin.packed = is_packed;
    const NiftiHeader header(begin, path + ": damaged, truncated, or not a .nii" + (is_packed ? ".gz" : "") + " file");
    ImageInfo info;
    const std::optional<PixelPlace> place = nifti_pixels(header, begin, info);
    const std::array<std::uint64_t, 7> sizes = header.sizes();
    if (!place || sizes[4] > 1)
        throw read_error(Errc::Unsupported, path,
                         "expected one file with a header and one integer of 8, 16 or 32 bits, float or double for "
                         "each voxel; convert it, for example with nibabel");
    info.type = rescaled_nifti_type(*place);
    info.geometry.size = require_3d(path, {sizes[0], sizes[1], sizes[2]});
    info.geometry.unit = header.unit_name();
    constexpr std::uint64_t kMax = std::uint64_t(1) << 20;
    std::uint64_t frames = 1;
    for (std::size_t a = 3; a < sizes.size(); ++a)
        if (__builtin_mul_overflow(frames, sizes[a], &frames) || frames > kMax)
            throw read_error(Errc::InvalidInput, path, "expected 1 to 2^20 frames, but the header claims more");
    info.frames = static_cast<int>(frames);
    info.axis_order = header.dimensions() > 3 ? "XYZT" : "XYZ";
    NiftiPlace(path, header, info, run).fill();
    info.fields.emplace_back("space", "RAS in the file, turned to LPS");
    return open_placed(path, info, *place);
}

}  // namespace covol::detail
