// Writes NRRD, MetaImage, NIfTI-1 and NumPy's .npy: a header, followed by all voxels.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>

#include "base/matrix.h"
#include "covol/error.h"
#include "io/pixels/nifti_space.h"
#include "io/pixels/raw_image.h"
#include "io/write/image_writers.h"
#include "io/write/pixel_blocks.h"
#include "io/write/shortest.h"

namespace covol::detail {
namespace {

template <typename Numbers>
std::string joined(const Numbers& numbers, const char* between) {
    std::string text;
    for (const auto n : numbers) text += (text.empty() ? "" : between) + shortest(double(n));
    return text;
}

/// The direction of axis `a`: column a of the matrix.
Vec3 axis_of(const ImageGeometry& g, std::size_t a) {
    return {g.direction[0][a], g.direction[1][a], g.direction[2][a]};
}

/// The name or code of a type in each format.
struct TypeNames {
    const char* nrrd;
    const char* meta;
    std::int16_t nifti;
    const char* numpy;
};
TypeNames names_of(PixelType type) {
    switch (type) {
        case PixelType::UInt8: return {"unsigned char", "MET_UCHAR", 2, "|u1"};
        case PixelType::Int8: return {"signed char", "MET_CHAR", 256, "|i1"};
        case PixelType::UInt16: return {"unsigned short", "MET_USHORT", 512, "<u2"};
        case PixelType::Int16: return {"short", "MET_SHORT", 4, "<i2"};
        case PixelType::UInt32: return {"unsigned int", "MET_UINT", 768, "<u4"};
        case PixelType::Int32: return {"int", "MET_INT", 8, "<i4"};
        case PixelType::Float: return {"float", "MET_FLOAT", 16, "<f4"};
        case PixelType::Double: break;
    }
    return {"double", "MET_DOUBLE", 64, "<f8"};
}

/// Escapes a key or a value of NRRD's key/value pairs, which are single lines.
std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text) out += c == '\n' ? "\\n" : c == '\\' ? "\\\\" : std::string(1, c);
    return out;
}

/// Prepares a text to stand between the quotes of a NRRD field: escapes quotes and backslashes, and removes line
/// breaks.
std::string quoted(const std::string& text) {
    std::string out;
    for (const char c : text)
        if (c != '\n') out += (c == '"' || c == '\\' ? "\\" : "") + std::string(1, c);
    return out;
}

std::string nrrd_header(const PixelSource& source, bool pack) {
    const ImageGeometry& g = source.geometry();
    std::string directions;
    for (std::size_t a = 0; a < 3; ++a) {
        Vec3 axis = axis_of(g, a);
        for (double& c : axis) c *= g.spacing[a];
        directions += (a == 0 ? "(" : " (") + joined(axis, ",") + ")";
    }
    std::string text =
        "NRRD0004\n# Complete NRRD file format specification at:\n# http://teem.sourceforge.net/nrrd/format.html\n"
        "type: " +
        std::string(names_of(source.type()).nrrd) +
        "\ndimension: 3\nspace: left-posterior-superior\nsizes: " + joined(g.size, " ") +
        "\nspace directions: " + directions + "\nkinds: domain domain domain\n";
    if (pixel_bytes(source.type()) > 1) text += "endian: little\n";
    text += std::string("encoding: ") + (pack ? "gzip" : "raw") + "\nspace origin: (" + joined(g.origin, ",") + ")\n";
    // NRRD requires the field "space" to precede the field "space units".
    const std::string unit = "\"" + quoted(g.unit) + "\"";
    if (!g.unit.empty()) text += "space units: " + unit + " " + unit + " " + unit + "\n";
    for (const auto& [key, value] : source.metadata()) text += escaped(key) + ":=" + escaped(value) + "\n";
    return text;
}

std::string meta_header(const PixelSource& source, bool pack, std::uint64_t packed_bytes) {
    const ImageGeometry& g = source.geometry();
    std::string matrix;
    for (std::size_t a = 0; a < 3; ++a) matrix += (a == 0 ? "" : " ") + joined(axis_of(g, a), " ");
    std::string text = "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n";
    // The number of packed bytes is known only after all voxels are written, and then overwrites this text in place. It
    // is therefore padded to the maximum width.
    std::string count = std::to_string(packed_bytes);
    constexpr std::size_t kWidest = 20;
    count.insert(0, kWidest - count.size(), ' ');
    text += pack ? "CompressedData = True\nCompressedDataSize = " + count + "\n" : "CompressedData = False\n";
    text += "TransformMatrix = " + matrix + "\nOffset = " + joined(g.origin, " ") +
            "\nCenterOfRotation = 0 0 0\nElementSpacing = " + joined(g.spacing, " ") +
            "\nDimSize = " + joined(g.size, " ") + "\n";
    if (!g.unit.empty()) text += std::string("unit") + " = " + g.unit + "\n";
    return text + "ElementType = " + names_of(source.type()).meta + "\nElementDataFile = LOCAL\n";
}

/// The components b, c and d of the unit quaternion a + bi + cj + dk of a rotation, with a >= 0.
/// https://nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h
std::array<double, 3> quaternion(const Matrix3& r) {
    const double trace = 1 + r[0][0] + r[1][1] + r[2][2];
    if (trace > 0.5) {
        const double a = 0.5 * std::sqrt(trace);
        return {0.25 * (r[2][1] - r[1][2]) / a, 0.25 * (r[0][2] - r[2][0]) / a, 0.25 * (r[1][0] - r[0][1]) / a};
    }
    // The largest of b, c and d is computed first, because the other two are obtained by a division by it.
    std::size_t i = 0;
    for (std::size_t n = 1; n < 3; ++n)
        if (r[n][n] > r[i][i]) i = n;
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    std::array<double, 3> q{};
    q[i] = 0.5 * std::sqrt(std::max(0.0, 1 + r[i][i] - r[j][j] - r[k][k]));
    q[j] = 0.25 * (r[i][j] + r[j][i]) / q[i];
    q[k] = 0.25 * (r[i][k] + r[k][i]) / q[i];
    if (r[k][j] - r[j][k] < 0)
        for (double& c : q) c = -c;
    return q;
}

using nifti::kCodes, nifti::kPixdim, nifti::kQuatern, nifti::kSrow;

bool is_sheared(const Matrix3& direction) {
    double maximum = 0;
    for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t b = 0; b < a; ++b)
            maximum = std::max(maximum, std::abs(direction[0][a] * direction[0][b] + direction[1][a] * direction[1][b] +
                                                 direction[2][a] * direction[2][b]));
    return maximum > 1e-3;
}

/// Whether the stated transform of the input (the sform if it has a code, otherwise the qform) describes the same
/// lattice as the new header.
bool still_holds(const NiftiSpace& space, const std::string& header, double spacing) {
    // Tolerance of positions relative to the spacing, and of the components of quaternions.
    constexpr double kRounding = 1e-3;
    const auto own = [&](std::size_t at, std::size_t n) {
        float value = 0;
        std::memcpy(&value, header.data() + at + n * sizeof(value), sizeof(value));
        return double(value);
    };
    double square = 0;
    for (std::size_t n = 0; n < 3; ++n) square += own(kQuatern, n) * own(kQuatern, n);
    const auto turns_alike = [&](double sign) {
        for (std::size_t n = 0; n < 3; ++n)
            if (!(std::abs(sign * space.qform[n] - own(kQuatern, n)) <= kRounding)) return false;
        return true;
    };
    const auto lies_alike = [&](const auto& stated, std::size_t at, std::size_t first) {
        for (std::size_t n = first; n < stated.size(); ++n)
            if (!(std::abs(stated[n] - own(at, n)) <= kRounding * spacing)) return false;
        return true;
    };
    const bool same_side = (space.qfac < 0) == (own(kPixdim, 0) < 0);
    // For a rotation by 180 degrees (a = 0), (b, c, d) and (-b, -c, -d) are the same rotation.
    const bool turn = turns_alike(1) || (square > 1 - kRounding && turns_alike(-1));
    // Readers use the sform if sform_code is positive.
    if (space.codes[1] > 0) return lies_alike(space.sform, kSrow, 0);
    return space.codes[0] > 0 && same_side && turn && lies_alike(space.qform, kQuatern, 3);
}

/// The 348 bytes of a NIfTI-1 header and four zeros, which mean that no extension follows. World coordinates are RAS.
/// https://nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h
/// @param like  path of the input, whose codes, qform and sform are kept if they describe the same lattice as `source`
std::string nifti_header(const std::string& path, const PixelSource& source, const std::string& like) {
    const ImageGeometry& g = source.geometry();
    for (const std::int32_t n : g.size)
        if (n > std::numeric_limits<std::int16_t>::max())
            throw Error(Errc::Unsupported, path + ": NIfTI-1 holds at most 32767 voxels along an " +
                                               "axis, but the image is " + size_text(g.size) +
                                               "; write .nrrd, .mha or .zarr");
    std::string header(352, '\0');
    const auto put = [&](std::size_t at, auto value) { std::memcpy(header.data() + at, &value, sizeof(value)); };
    const auto put_float = [&](std::size_t at, double value) { put(at, static_cast<float>(value)); };
    put(0, std::int32_t(348));
    header[38] = 'r';
    constexpr std::size_t kDim = 40, kQoffset = 268;
    put(kDim, std::int16_t(3));
    for (std::size_t a = 0; a < 7; ++a) put(kDim + 2 + 2 * a, a < 3 ? std::int16_t(g.size[a]) : std::int16_t(1));
    put(70, names_of(source.type()).nifti);
    put(72, std::int16_t(8 * pixel_bytes(source.type())));
    Matrix3 ras = g.direction;
    for (std::size_t b = 0; b < 3; ++b)
        for (std::size_t a = 0; a < 2; ++a) ras[a][b] = -ras[a][b];
    const double det = determinant(ras);
    Matrix3 rotation = ras;
    if (det < 0)
        for (auto& row : rotation) row[2] = -row[2];
    put_float(kPixdim, det < 0 ? -1 : 1);
    const std::array<double, 3> q = quaternion(rotation);
    for (std::size_t a = 0; a < 3; ++a) {
        put_float(kPixdim + 4 + 4 * a, g.spacing[a]);
        put_float(kQuatern + 4 * a, q[a]);
        const double origin = a < 2 ? -g.origin[a] : g.origin[a];
        put_float(kQoffset + 4 * a, origin);
        put_float(kSrow + 16 * a + 12, origin);
        for (std::size_t b = 0; b < 3; ++b) put_float(kSrow + 16 * a + 4 * b, ras[a][b] * g.spacing[b]);
    }
    put_float(108, 352);  // position of the first voxel
    put_float(112, 1);    // slope
    const auto unit = std::find(kNiftiUnits.begin() + 1, kNiftiUnits.end(), g.unit);
    header[123] = char(unit == kNiftiUnits.end() ? 0 : unit - kNiftiUnits.begin());
    // A qform cannot represent sheared axes; its code 0 means that it is not stated.
    put(kCodes, std::int16_t(is_sheared(g.direction) ? 0 : 1));
    put(kCodes + 2, std::int16_t(1));
    const std::optional<NiftiSpace> stated = read_nifti_space(like);
    if (stated && still_holds(*stated, header, g.smallest_spacing())) {
        put(kPixdim, stated->qfac);
        put(kCodes, stated->codes);
        put(kQuatern, stated->qform);
        put(kSrow, stated->sform);
    }
    std::memcpy(header.data() + 344, "n+1", 3);
    return header;
}

/// The header of NumPy's format 1.0 for an array with the axes z, y, x.
/// https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html
std::string npy_header(const PixelSource& source) {
    const Index3 n = source.geometry().size;
    std::string dictionary = std::string("{'descr': '") + names_of(source.type()).numpy +
                             "', 'fortran_order': False, 'shape': (" + std::to_string(n[2]) + ", " +
                             std::to_string(n[1]) + ", " + std::to_string(n[0]) + "), }";
    constexpr std::size_t kBefore = 10, kAlignment = 64;
    const std::size_t whole = (kBefore + dictionary.size() + 1 + kAlignment - 1) / kAlignment * kAlignment;
    dictionary.resize(whole - kBefore - 1, ' ');
    const auto length = std::uint16_t(dictionary.size() + 1);
    return std::string("\x93NUMPY\x01\x00", 8) + char(length & 0xFF) + char(length >> 8) + dictionary + "\n";
}

/// A file that is written sequentially. add_zeros() skips zeros, which saves disk space if the file system supports
/// sparse files.
class GrowingFile {
public:
    explicit GrowingFile(const std::string& path) : path_(path), file_(path, std::ios::binary | std::ios::trunc) {
        if (!file_) fail();
    }
    void add(const std::string& bytes) {
        if (!file_.write(bytes.data(), std::streamsize(bytes.size()))) fail();
        size_ += bytes.size();
    }
    void add_zeros(std::uint64_t count) {
        size_ += count;
        if (!file_.seekp(static_cast<std::streamoff>(size_ - 1)) || !file_.put('\0')) fail();
    }
    void overwrite_begin(const std::string& bytes) {
        if (!file_.seekp(0) || !file_.write(bytes.data(), std::streamsize(bytes.size()))) fail();
    }
    [[nodiscard]] std::uint64_t size() const { return size_; }
    void close() {
        file_.close();
        if (!file_) fail();
    }

private:
    [[noreturn]] void fail() const { throw Error(Errc::Io, path_ + ": cannot write"); }
    std::string path_;
    std::ofstream file_;
    std::uint64_t size_ = 0;
};

/// Divides the lattice into blocks of whole slices, or of rows of one slice.
class Layers {
public:
    Layers(const Index3& size, std::uint64_t pixel) : size_(size) {
        // [bytes] Size of a block. It is small, so that many blocks are uniform and are packed only once, but large
        // enough that the time to start packing a block is negligible.
        constexpr std::uint64_t kBlock = 1U << 18;
        const std::uint64_t row = std::uint64_t(size[0]) * pixel, slice = row * std::uint64_t(size[1]);
        slices_ = std::int32_t(std::clamp<std::uint64_t>(kBlock / slice, 1, std::uint64_t(size[2])));
        rows_ = slice <= kBlock ? size[1]
                                : std::int32_t(std::clamp<std::uint64_t>(kBlock / row, 1, std::uint64_t(size[1])));
        per_slice_ = (size[1] + rows_ - 1) / rows_;
    }
    [[nodiscard]] std::uint64_t count() const {
        return std::uint64_t((size_[2] + std::int64_t(slices_) - 1) / slices_) * std::uint64_t(per_slice_);
    }
    [[nodiscard]] BlockPlace place(std::uint64_t n) const {
        const auto k = std::int32_t(n / std::uint64_t(per_slice_)) * slices_;
        const auto j = std::int32_t(n % std::uint64_t(per_slice_)) * rows_;
        const VoxelBox box{
            {0, j, k}, {size_[0] - 1, std::min(size_[1] - j, rows_) + j - 1, std::min(size_[2] - k, slices_) + k - 1}};
        return {box, box.size()};
    }

private:
    Index3 size_;
    std::int32_t slices_ = 1, rows_ = 1, per_slice_ = 1;
};

std::string bytes_of(std::uint32_t value, bool big_endian) {
    std::string bytes;
    for (int n = 0; n < 4; ++n) bytes += char(value >> (8 * (big_endian ? 3 - n : n)) & 0xFF);
    return bytes;
}

/// Writes all voxels. @param before  bytes that precede the voxels in the packed stream
void add_voxels(GrowingFile& file, const PixelSource& source, BlockPacking packing, const RunContext& run,
                const std::string& before = {}) {
    const Layers layers(source.geometry().size, pixel_bytes(source.type()));
    const bool gzip = packing == BlockPacking::Gzip, adler = packing == BlockPacking::Adler;
    uLong check = gzip ? crc32(0, nullptr, 0) : adler32(0, nullptr, 0);
    std::uint64_t unpacked = 0;
    if (gzip) file.add(std::string("\x1f\x8b\x08\x00\x00\x00\x00\x00\x00\xff", 10));
    if (adler) file.add("\x78\x9c");
    const auto add = [&](const PackedBlock& block) {
        if (packing == BlockPacking::None && block.is_zero)
            file.add_zeros(block.unpacked);
        else
            file.add(block.bytes);
        const auto length = static_cast<z_off_t>(block.unpacked);
        if (gzip) check = crc32_combine(check, block.check, length);
        if (adler) check = adler32_combine(check, block.check, length);
        unpacked += block.unpacked;
    };
    BlockPacker packer(source, packing);
    if (!before.empty()) add(packer.packed(before));
    packer.pack_all(
        layers.count(), [&](std::uint64_t n) { return layers.place(n); },
        [&](std::uint64_t, const PackedBlock& block) { add(block); }, run);
    // The blocks do not contain the mark of the last block of a Deflate stream, so an empty last block follows.
    if (gzip || adler) file.add(std::string("\x03\x00", 2));
    if (gzip) file.add(bytes_of(std::uint32_t(check), false) + bytes_of(std::uint32_t(unpacked), false));
    if (adler) file.add(bytes_of(std::uint32_t(check), true));
}

/// The header, padded by a comment to a total of `length` bytes, including the blank line that ends a NRRD header.
std::string filled(std::string header, std::size_t length) {
    header += "#";
    header.resize(length - 2, ' ');
    return header + "\n\n";
}

void write_nrrd(GrowingFile& file, const PixelSource& source, bool pack, const RunContext& run) {
    const BlockPacking packing = pack ? BlockPacking::Gzip : BlockPacking::None;
    const std::string widest = nrrd_header(source, pack);
    if (source.metadata().empty()) {
        file.add(widest + "\n");
        return add_voxels(file, source, packing, run);
    }
    // The metadata contain the extents of segments, which are known only after all voxels are written. The header is
    // then overwritten in place.
    constexpr std::size_t kShortestComment = 2, kBlank = 1;
    const std::size_t length = widest.size() + kShortestComment + kBlank;
    file.add(filled(widest, length));
    add_voxels(file, source, packing, run);
    file.overwrite_begin(filled(nrrd_header(source, pack), length));
}

void write_meta(GrowingFile& file, const PixelSource& source, bool pack, const RunContext& run) {
    const std::string header = meta_header(source, pack, 0);
    file.add(header);
    add_voxels(file, source, pack ? BlockPacking::Adler : BlockPacking::None, run);
    if (pack) file.overwrite_begin(meta_header(source, pack, file.size() - header.size()));
}

}  // namespace

void write_raw(const std::string& path, const std::string& extension, const PixelSource& source,
               const WriteImageOptions& options, const RunContext& run) {
    const bool pack = options.pack;
    GrowingFile file(path);
    if (extension == ".nrrd") {
        write_nrrd(file, source, pack, run);
    } else if (extension == ".mha") {
        write_meta(file, source, pack, run);
    } else if (extension == ".nii" || extension == ".npy") {
        file.add(extension == ".npy" ? npy_header(source) : nifti_header(path, source, options.like));
        add_voxels(file, source, BlockPacking::None, run);
    } else {
        add_voxels(file, source, BlockPacking::Gzip, run, nifti_header(path, source, options.like));
    }
    file.close();
}

}  // namespace covol::detail
