#pragma once
#include <memory>
#include <optional>
#include <string>

#include "io/hdf5/hdf5_image.h"
#include "io/modules/modules.h"
#include "io/pixels/raw_image.h"

// One function for each family of image files; read_image() chooses by the file name's extension.
namespace covol::detail {

/// NRRD (.nrrd, .nhdr), MetaImage (.mha, .mhd), ITK's HDF5 (.h5, .hdf5): ITK reads the header.
std::unique_ptr<ImageFile> open_itk(const std::string& path, const RunContext& run);

/// NIfTI-1 in a single file (.nii, .nii.gz). The positions of voxels are taken from the sform if sform_code > 0, else
/// from the qform if qform_code > 0, else from pixdim with the image's centre at 0, as in nibabel. If the sform is not
/// invertible, the qform is used and a warning is reported; if the file has no qform, an error is thrown. A warning is
/// also reported if both codes are positive and sform and qform differ by more than half a voxel, or if the sform is
/// used and pixdim states another spacing.
std::unique_ptr<ImageFile> open_nifti(const std::string& path, const RunContext& run);

/// ITK's reader for the extension of `path`: of NRRD, of HDF5 or, for any other extension, of MetaImage.
OpenWithItk* itk_reader_of(const std::string& path);

/// Opens an HDF5 file in ITK's layout or in any other supported layout.
std::unique_ptr<ImageFile> open_either_hdf5(const Hdf5Name& name);

/// MRC2014 and CCP4 maps: modes 0, 1, 2, 6 and 12, either byte order.
std::unique_ptr<ImageFile> open_mrc(const std::string& path);

/// Image Cytometry Standard: version 1.0 with its voxels in an .ids file of the same name, version 2.0 in one file.
std::unique_ptr<ImageFile> open_ics(const std::string& path);

/// NumPy's .npy: an array of three axes z, y, x, in C's or Fortran's order.
std::unique_ptr<ImageFile> open_npy(const std::string& path);

/// The series in a folder, or the series that a file belongs to; its slices are sorted by position.
/// @param frame  index of the volume (time, echo or stack) whose geometry is reported; by default the first
/// @throws Error Unsupported if a folder holds several series, which the message lists.
std::unique_ptr<ImageFile> open_dicom(const std::string& path, std::optional<int> frame, const RunContext& run);

/// A float grid as an image, on the bounding box of its active voxels. @param name  of the grid; if it is empty, the
/// first float grid of the file is used
std::unique_ptr<ImageFile> open_vdb_image(const std::string& path, const std::string& name);

}  // namespace covol::detail
