#pragma once
#include <cstdint>
#include <string>

#include "covol/image_stream.h"

// One function for each family of files; write_image() chooses by the file name's extension.
namespace covol::detail {

/// .nrrd, .mha, .nii, .nii.gz and .npy: a header, followed by the voxels, i fastest.
void write_raw(const std::string& path, const std::string& extension, const PixelSource& source,
               const WriteImageOptions& options, const RunContext& run);

/// One deflated page for each slice: a classic TIFF with strips, or a BigTIFF with tiles. Spacing, unit and origin are
/// stored as ImageJ stores them. TIFF cannot store a direction.
/// @param ome  writes an OME-TIFF, with XML instead of ImageJ's description, without an origin
/// @param classic_limit  a BigTIFF is written if the unpacked size in bytes is larger than this
inline constexpr std::uint64_t kClassicTiff = std::uint64_t(4000) << 20;
void write_tiff(const std::string& path, const PixelSource& source, bool ome, const RunContext& run,
                std::uint64_t classic_limit = kClassicTiff);

/// OME-Zarr 0.4, in `folder`, which exists and is empty.
void write_ome_zarr(const std::string& folder, const std::string& name, const PixelSource& source,
                    const RunContext& run);

}  // namespace covol::detail
