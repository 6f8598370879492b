#include "flags/cloud_flags.h"

#include <limits>
#include <sstream>

#include "covol/error.h"
#include "covol/points.h"
#include "flags/bindings.h"

namespace covol::tool {
namespace {

Json to_json(const CloudCleanupReport& r) {
    return {{"given", r.given},
            {"duplicates", r.duplicates},
            {"outliers", r.outliers},
            {"outlier_passes", r.outlier_passes},
            {"simplified", r.simplified},
            {"smoothed", r.smoothed},
            {"mean_shift", r.mean_shift},
            {"max_shift", r.max_shift},
            {"kept", r.kept}};
}

std::string one_line(const CloudCleanupReport& r, const CloudCleanupOptions& options) {
    std::ostringstream text;
    text << "cloud: " << r.kept << " of " << r.given << " points kept; " << r.duplicates << " duplicates";
    if (options.outlier_factor > 0) text << ", " << r.outliers << " outliers in " << r.outlier_passes << " passes";
    if (options.simplify > 0) text << ", " << r.simplified << " by cells of " << options.simplify;
    if (options.smooth == CloudSmoothing::Jets)
        text << "; jets moved " << r.smoothed << " by " << r.mean_shift << " on average, " << r.max_shift << " at most";
    if (options.smooth == CloudSmoothing::Wlop) text << "; WLOP made " << r.smoothed;
    return text.str();
}

}  // namespace

void CloudFlags::bind(CLI::App& command, bool with_most) {
    in_group(command, Group::Clouds);
    const CloudCleanupOptions lib;
    const std::string factor = "3";
    command
        .add_flag("--remove-outliers{" + factor + "}", outlier_factor,
                  "drop marks that lie apart from all others, and points whose distance to their " +
                      std::to_string(lib.neighbours) + " neighbours is more than " + factor +
                      " (or FACTOR) times the cloud's mean")
        ->option_text("[=FACTOR]");
    if (with_most)
        command
            .add_option("--most-points", most_points,
                        "of larger clouds so many points are used, evenly spread over the surface; 0: all")
            ->type_name("N")
            ->default_str(std::to_string(most_points));
    add_length(command, "--simplify", simplify, "", "keep one point in each cell of this edge, 1vx for example");
    add_choice(command, "--smooth", smooth,
               {{"none", CloudSmoothing::None}, {"jets", CloudSmoothing::Jets}, {"wlop", CloudSmoothing::Wlop}},
               "move the points to fitted quadrics (jets), or make " + to_text(lib.wlop_share) +
                   " times as many by projection, evenly spread (wlop)");
}

std::vector<std::uint32_t> CloudFlags::used(const std::vector<Vec3>& points, const RunContext& run,
                                            Json& report) const {
    std::vector<std::uint32_t> order =
        order_spatially(points, most_points > 0 ? most_points : std::numeric_limits<std::size_t>::max());
    if (order.size() < points.size()) {
        report["thinned_to"] = order.size();
        run.info("cloud: " + std::to_string(order.size()) + " of " + std::to_string(points.size()) +
                 " points used, evenly spread; --most-points 0 takes all");
    }
    return order;
}

CloudCleanupOptions CloudFlags::resolve(double h) const {
    CloudCleanupOptions options;
    if (!outlier_factor.empty()) options.outlier_factor = parse_number("--remove-outliers", outlier_factor);
    options.simplify = simplify.resolve(h, 0);
    options.smooth = smooth;
    return options;
}

void CloudFlags::check() const {
    const std::string why = resolve(1).why_invalid();
    if (!why.empty()) throw Error(Errc::InvalidOptions, why);
}

std::vector<Vec3> CloudFlags::clean(const std::vector<Vec3>& points, double h, const RunContext& run,
                                    Json& report) const {
    const CloudCleanupOptions options = resolve(h);
    if (!options.any()) return points;
    CloudCleanupReport done;
    std::vector<Vec3> cleaned = clean_cloud(points, options, run, &done);
    if (cleaned.empty() && !points.empty())
        throw Error(Errc::InvalidInput, "clean_cloud: no point is left of " + std::to_string(points.size()));
    report["cleanup"] = to_json(done);
    run.info(one_line(done, options));
    return cleaned;
}

}  // namespace covol::tool
