#pragma once
#include <memory>
#include <string>

#include "bindings.h"
#include "contour_flags.h"
#include "cloud_flags.h"

namespace covol::tool {

/// What `segment` and `reconstruct` share: they differ in the image alone.
struct SegmentJob {
    std::string image_path;  ///< empty: points alone
    ImageFlags image;
    PointFlags points;
    ContourFlags contours;
    CloudFlags cloud;
    DomainFlags domain;
    TagFlags tag;
    EdgeFlags edge;
    EvolveFlags evolve;
    MeshFlags mesh;
    Start start;
    Length min_component;  ///< edge of a cube of the smallest volume that is kept
    std::string output, mask_path, mesh_path, density_path, fields_path;
    bool half = false;

    void bind(CLI::App& command, bool with_image);
    void run(Session& session);
};

}  // namespace covol::tool
