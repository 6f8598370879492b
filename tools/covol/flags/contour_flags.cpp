#include "flags/contour_flags.h"

namespace covol::tool {

void ContourFlags::bind(CLI::App& command, bool names) {
    in_group(command, Group::Marks);
    command
        .add_option(
            "--contours", paths,
            std::string("ordered marks on slices: CSV (slice,contour,x_px,y_px), napari shapes, Fiji selections") +
                (names ? "; NAME= as for points" : ""))
        ->type_name(names ? "[NAME=]FILE..." : "FILE...");
    bind_options(command, *this, Offered::Always);
}

std::vector<PointCloud> ContourFlags::read(const ReadPointsOptions& reading, const ImageGeometry* geometry,
                                           const RunContext& run) const {
    std::vector<PointCloud> clouds;
    for (const std::string& path : paths) {
        run.check();
        clouds.push_back(read_points(path, reading));
        if (geometry != nullptr) check_inside(clouds.back(), *geometry, run);
    }
    return clouds;
}

std::shared_ptr<const Contours> ContourFlags::densify(const std::vector<PointCloud>& clouds,
                                                      const ImageGeometry* geometry, double h, const RunContext& run,
                                                      Json& report) const {
    ContourOptions dense = resolve(h);
    dense.step = h;
    const auto contours = std::make_shared<Contours>(geometry != nullptr ? covol::densify(clouds, *geometry, dense, run)
                                                                         : covol::densify(clouds, dense, run));
    run.info("contours: " + contours->summary);
    Json rules = Json::array();
    for (const PointCloud& cloud : clouds) rules.push_back(cloud.rule);
    report = {{"paths", paths},
              {"rules", rules},
              {"closed", contours->closed},
              {"open", contours->open},
              {"slices", contours->slices},
              {"slice_distance", contours->slice_distance},
              {"along", contours->along.size()},
              {"between", contours->between.size()}};
    return contours;
}

}  // namespace covol::tool
