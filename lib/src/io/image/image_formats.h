#pragma once
#include <memory>
#include <optional>
#include <string>

#include "io/hdf5/hdf5_image.h"
#include "io/modules/modules.h"
#include "io/pixels/raw_image.h"

// One function for each family of image files; read_image() picks by the name's end.
namespace covol::detail {

/// NRRD (.nrrd, .nhdr), MetaImage (.mha, .mhd), ITK's HDF5 (.h5, .hdf5): ITK reads the header.
std::unique_ptr<ImageFile> open_itk(const std::string& path, const RunContext& run);

/// NIfTI-1 in one file (.nii, .nii.gz). The sform says where voxels lie if sform_code > 0, else the qform if
/// qform_code > 0, else pixdim with the image's middle at 0: nibabel's rule. Where both forms have codes and lie more
/// than half a voxel apart, that is a warning.
std::unique_ptr<ImageFile> open_nifti(const std::string& path, const RunContext& run);

/// ITK's reader for files of this ending.
OpenWithItk* itk_reader_of(const std::string& path);

/// Of ITK's layout or another.
std::unique_ptr<ImageFile> open_either_hdf5(const Hdf5Name& name);

/// MRC2014 and CCP4 maps: modes 0, 1, 2, 6 and 12, either byte order.
std::unique_ptr<ImageFile> open_mrc(const std::string& path);

/// NumPy's .npy: an array of three axes z, y, x, in C's or Fortran's order.
std::unique_ptr<ImageFile> open_npy(const std::string& path);

/// The series in a folder, or the one that a file belongs to; its slices sorted by position.
/// @throws Error Unsupported when a folder holds several series: lists them.
/// @param frame  the volume of those that a series has (times, echoes, stacks), whose geometry is told; the first
std::unique_ptr<ImageFile> open_dicom(const std::string& path, std::optional<int> frame, const RunContext& run);

/// A float grid as an image, on the box of its active voxels.
/// @param name  the grid's, or empty for the file's first float grid
std::unique_ptr<ImageFile> open_vdb_image(const std::string& path, const std::string& name);

}  // namespace covol::detail
