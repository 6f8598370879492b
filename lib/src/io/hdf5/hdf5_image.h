#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "io/pixels/raw_image.h"

namespace covol::detail {

/// "FILE.h5:/path/to/dataset", in its parts.
struct Hdf5Name {
    std::string path, inside;
};
/// @returns an empty `inside` where `text` names a file alone; nothing where its name is not one of HDF5.
std::optional<Hdf5Name> split_hdf5_name(const std::string& text);

/// The HDF5 library reads and writes outside its buffers where a file is damaged: what would be read of it is read in a
/// copy of this process first, which may crash. @throws Error InvalidInput (it did, or took a minute), and what `read`
/// threw: the library keeps objects of damaged headers, which this process then has not seen.
void try_hdf5(const std::string& path, const std::function<void()>& read);

/// Whether the file as a whole is an image in ITK's layout, which ITK reads. @throws Error InvalidInput.
bool is_itk_hdf5(const Hdf5Name& name);

/// An image in an HDF5 file: Imaris', BigDataViewer's, ilastik's, or any dataset of grey values.
/// @throws Error InvalidInput (damaged), Io, Unsupported (types, filters, several datasets: lists them).
std::unique_ptr<ImageFile> open_hdf5(const Hdf5Name& name);

}  // namespace covol::detail
