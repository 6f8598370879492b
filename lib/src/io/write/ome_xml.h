#pragma once
#include <string>

#include "covol/image.h"

namespace covol::detail {

/// The description of an OME-TIFF with one channel and a page for each slice: sizes, spacing and unit.
/// https://docs.openmicroscopy.org/ome-model/6.2.0/ome-tiff/specification.html
[[nodiscard]] std::string make_ome_xml(const ImageGeometry& geometry, PixelType type);

}  // namespace covol::detail
