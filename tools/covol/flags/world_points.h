#pragma once
#include <string>
#include <vector>

#include "covol/orientation.h"
#include "covol/points.h"

namespace covol::tool {

/// Clouds read and moved to the world; with an image, points outside it are an error.
struct WorldPoints {
    std::vector<Vec3> points;
    PointHints hints;                ///< of them
    std::vector<std::string> rules;  ///< how each file was understood
};

/// One more cloud. @param geometry  of the image; null: there is none
void add_cloud(const PointCloud& cloud, const ImageGeometry* geometry, WorldPoints& all, const RunContext& run);

}  // namespace covol::tool
