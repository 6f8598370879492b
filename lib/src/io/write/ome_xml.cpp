#include "io/write/ome_xml.h"

#include "covol/version.h"
#include "io/write/shortest.h"

namespace covol::detail {
namespace {

/// The name of a unit in the OME schema; "reference frame" for unknown units. Letters outside of ASCII are XML
/// entities, because texts in TIFF are ASCII.
std::string ome_unit(const std::string& unit) {
    if (unit == "um") return "&#181;m";
    if (unit == "angstrom") return "&#197;";
    if (unit == "inch") return "in";
    for (const char* same : {"nm", "mm", "cm", "m", "pm"})
        if (unit == same) return unit;
    return "reference frame";
}

}  // namespace

std::string make_ome_xml(const ImageGeometry& geometry, PixelType type) {
    const std::string depth = std::to_string(geometry.size[2]);
    std::string text =
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>"
        "<OME xmlns=\"http://www.openmicroscopy.org/Schemas/OME/2016-06\" "
        "xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" "
        "xsi:schemaLocation=\"http://www.openmicroscopy.org/Schemas/OME/2016-06 "
        "http://www.openmicroscopy.org/Schemas/OME/2016-06/ome.xsd\" Creator=\"covol " COVOL_VERSION_STRING
        "\"><Image ID=\"Image:0\"><Pixels ID=\"Pixels:0\" DimensionOrder=\"XYZCT\" BigEndian=\"false\" Type=\"";
    text += std::string(to_string(type)) + "\"";
    for (int a = 0; a < 3; ++a)
        text += std::string(" Size") + "XYZ"[a] + "=\"" + std::to_string(geometry.size[a]) + "\"";
    text += " SizeC=\"1\" SizeT=\"1\"";
    for (int a = 0; a < 3 && geometry.spacing_known; ++a) {
        const std::string name = std::string(" PhysicalSize") + "XYZ"[a];
        text += name + "=\"" + shortest(geometry.spacing[a]) + "\"" + name + "Unit=\"" + ome_unit(geometry.unit) + "\"";
    }
    return text +
           "><Channel ID=\"Channel:0:0\" SamplesPerPixel=\"1\"/><TiffData IFD=\"0\" FirstZ=\"0\" FirstC=\"0\" "
           "FirstT=\"0\" PlaneCount=\"" +
           depth + "\"/></Pixels></Image></OME>";
}

}  // namespace covol::detail
