#pragma once
#include <memory>
#include <optional>
#include <string>

#include "io/pixels/raw_image.h"

namespace covol::detail {

/// The parts of a name such as "FILE.h5:/path/to/dataset".
struct Hdf5Name {
    std::string path, inside;
};
/// @returns an empty `inside` if `text` names only a file; nothing if `text` does not name an HDF5 file.
std::optional<Hdf5Name> split_hdf5_name(const std::string& text);

/// Whether the file as a whole is an image in ITK's own layout, which ITK reads. @throws Error InvalidInput.
bool is_itk_hdf5(const Hdf5Name& name);

/// An image in an HDF5 file in the layout of Imaris, BigDataViewer or ilastik, or any dataset of grey values.
/// @throws Error InvalidInput (damaged), Io, Unsupported (types, filters; several datasets, which the message lists).
std::unique_ptr<ImageFile> open_hdf5(const Hdf5Name& name);

}  // namespace covol::detail
