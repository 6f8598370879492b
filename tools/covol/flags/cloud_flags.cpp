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
    for_each_option(options, [&](const OptionInfo& option, auto&) {
        if (option.name == std::string_view("remove_outliers"))
            command.add_flag(flag_of(option.name) + "{3}", outlier_factor, option.text)->option_text("[=FACTOR]");
    });
    if (with_most) bind_options(command, inputs, Offered::PointsAlone);
    bind_options(command, *this, Offered::Always, {"remove_outliers"});
}

std::vector<std::uint32_t> CloudFlags::used(const std::vector<Vec3>& points, const RunContext& run,
                                            Json& report) const {
    const std::size_t most_points = inputs.options.most_points;
    std::vector<std::uint32_t> order =
        order_spatially(points, most_points > 0 ? most_points : std::numeric_limits<std::size_t>::max());
    if (order.size() < points.size()) {
        report["thinned_to"] = order.size();
        run.info("cloud: " + std::to_string(order.size()) + " of " + std::to_string(points.size()) +
                 " points used, evenly spread; --most-points 0 takes all");
    }
    return order;
}

CloudCleanupOptions CloudFlags::cleanup(double h) const {
    CloudCleanupOptions resolved = resolve(h);
    if (!outlier_factor.empty()) resolved.outlier_factor = parse_number("--remove-outliers", outlier_factor);
    return resolved;
}

void CloudFlags::check() const { require_valid(cleanup(1), "clean_cloud"); }

void CloudFlags::check_used(bool has_cloud) const {
    if (!has_cloud && cleanup(1).any())
        throw UsageError("--remove-outliers, --simplify, --smooth: they are about points, and this run reads none");
}

std::vector<Vec3> CloudFlags::clean(const std::vector<Vec3>& points, double h, const RunContext& run,
                                    Json& report) const {
    const CloudCleanupOptions asked = cleanup(h);
    if (!asked.any()) return points;
    CloudCleanupReport done;
    std::vector<Vec3> cleaned = clean_cloud(points, asked, run, &done);
    if (cleaned.empty() && !points.empty())
        throw Error(Errc::InvalidInput, "clean_cloud: no point is left of " + std::to_string(points.size()));
    report["cleanup"] = to_json(done);
    run.info(one_line(done, asked));
    return cleaned;
}

}  // namespace covol::tool
