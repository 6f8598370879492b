#pragma once
#include <cstdint>
#include <string>

#include "covol/image_stream.h"

// One function for each family of files; write_image() picks by the name's end.
namespace covol::detail {

/// .nrrd, .mha, .nii, .nii.gz and .npy: a header, and the voxels behind it, i fastest.
void write_raw(const std::string& path, const std::string& extension, const PixelSource& source,
               const WriteImageOptions& options, const RunContext& run);

/// One page per z, deflated: classic with strips, or BigTIFF with tiles. Spacing, unit and origin as ImageJ has them.
/// TIFF has no place for a direction.
/// @param ome  OME-TIFF: its XML in the place of ImageJ's text, without an origin
/// @param classic_limit  bytes of voxels, unpacked, from which on it is a BigTIFF
inline constexpr std::uint64_t kClassicTiff = std::uint64_t(4000) << 20;
void write_tiff(const std::string& path, const PixelSource& source, bool ome, const RunContext& run,
                std::uint64_t classic_limit = kClassicTiff);

/// OME-Zarr 0.4, at `folder`, which is there and empty.
void write_ome_zarr(const std::string& folder, const std::string& name, const PixelSource& source,
                    const RunContext& run);

}  // namespace covol::detail
