#include "contour_flags.h"

namespace covol::tool {

void ContourFlags::bind(CLI::App& command) {
    command.add_option("--contours", paths,
                       "ordered marks on slices (CSV slice,contour,x_px,y_px; napari shapes; Fiji selections): joined, "
                       "densified, and closed between the slices and beyond the last")
        ->type_name("FILE...");
    add_choice(command, "--contour-curve", curve, {{"lines", ContourCurve::Lines}, {"spline", ContourCurve::Spline}},
               "how neighbouring marks are joined [lines]");
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

std::shared_ptr<const Contours> ContourFlags::densify(const std::vector<PointCloud>& clouds, const ImageGeometry* geometry,
                                                      double h, Session& session) const {
    if (clouds.empty()) return nullptr;
    const Stopwatch watch;
    const auto contours = std::make_shared<Contours>(covol::densify(clouds, geometry, {h, curve}, session.run()));
    session.note("contours: " + contours->summary);
    Json rules = Json::array();
    for (const PointCloud& cloud : clouds) rules.push_back(cloud.rule);
    session.report()["input"]["contours"] = {{"paths", paths},
                                             {"rules", rules},
                                             {"closed", contours->closed},
                                             {"open", contours->open},
                                             {"slices", contours->slices},
                                             {"slice_distance", contours->slice_distance},
                                             {"along", contours->along.size()},
                                             {"between", contours->between.size()}};
    session.add_seconds("contours", watch.seconds());
    session.add_seconds("total", watch.seconds());
    return contours;
}

}  // namespace covol::tool
