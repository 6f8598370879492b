#include "flags/contour_flags.h"

namespace covol::tool {

void ContourFlags::bind(CLI::App& command, bool names) {
    in_group(command, Group::Marks);
    command
        .add_option(
            "--contours", paths,
            std::string("ordered marks on slices: CSV (slice,contour,x_px,y_px), napari shapes, Fiji selections, "
                        "DICOM structure sets") +
                (names ? "; NAME= as for points" : ""))
        ->type_name(names ? "[NAME=]FILE..." : "FILE...");
    bind_options(command, *this, Offered::Always);
}

}  // namespace covol::tool
