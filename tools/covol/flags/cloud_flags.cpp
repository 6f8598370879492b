#include "flags/cloud_flags.h"

#include "cli/options/option_names.h"
#include "covol/error.h"
#include "flags/bindings.h"

namespace covol::tool {

void CloudFlags::bind(CLI::App& command, bool with_inputs) {
    in_group(command, Group::Clouds);
    for_each_option(options, [&](const OptionInfo& option, auto&) {
        if (option.name == std::string_view("remove_outliers"))
            command.add_flag(flag_of(option.name) + "{3}", outlier_factor, option.text)->option_text("[=FACTOR]");
    });
    if (with_inputs) bind_options(command, inputs, Offered::PointsAlone);
    bind_options(command, *this, Offered::Always, {"remove_outliers"});
}

CloudCleanupOptions CloudFlags::cleanup(double h) const {
    CloudCleanupOptions resolved = resolve(h);
    if (!outlier_factor.empty()) resolved.outlier_factor = parse_number("--remove-outliers", outlier_factor);
    return resolved;
}

void CloudFlags::check() const { require_valid_flags(cleanup(1)); }

void CloudFlags::check_used(bool has_cloud) const {
    if (!has_cloud && cleanup(1).any())
        throw UsageError(
            "--remove-outliers, --simplify, --smooth: they apply to points only, and this run reads none; leave them "
            "out");
}

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

}  // namespace covol::tool
