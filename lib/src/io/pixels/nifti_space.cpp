#include "io/pixels/nifti_space.h"

#include <cstring>
#include <filesystem>

#include "base/file.h"
#include "io/pixels/raw_image.h"

namespace covol::detail {

std::optional<NiftiSpace> read_nifti_space(const std::string& path) {
    const std::string end = extension(path);
    std::error_code status;
    if ((end != ".nii" && end != ".nii.gz") || !std::filesystem::is_regular_file(path, status)) return std::nullopt;
    std::array<char, nifti::kHeader> header{};
    PixelPlace begin;
    begin.path = path;
    begin.packed = end == ".nii.gz";
    if (!read_bytes(begin, header.size(), header.data())) return std::nullopt;
    std::int32_t size = 0;
    std::memcpy(&size, header.data(), sizeof(size));
    const bool swap = size != std::int32_t(nifti::kHeader);
    const auto load = [&](std::size_t at, auto& values) {
        using T = std::remove_reference_t<decltype(values[0])>;
        std::memcpy(values.data(), header.data() + at, sizeof(T) * values.size());
        if (swap) swap_bytes(values.data(), values.size(), sizeof(T));
    };
    NiftiSpace space;
    std::array<float, 1> qfac{};
    load(nifti::kPixdim, qfac);
    load(nifti::kCodes, space.codes);
    load(nifti::kQuatern, space.qform);
    load(nifti::kSrow, space.sform);
    space.qfac = qfac[0];
    return space;
}

}  // namespace covol::detail
