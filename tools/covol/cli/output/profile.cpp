#include "cli/output/profile.h"

#include <cstdarg>
#include <cstdio>

namespace covol::tool {
namespace {

__attribute__((format(printf, 1, 2))) std::string format(const char* how, ...) {
    char text[256];
    va_list values;
    va_start(values, how);
    std::vsnprintf(text, sizeof text, how, values);
    va_end(values);
    return text;
}

void add_stages(const Json& seconds, std::vector<std::string>& lines) {
    const double total = seconds.value("total", 0.0);
    const auto line = [&](const std::string& stage, double s) {
        lines.push_back(format("%-12s %9.3f s  %5.1f %%", stage.c_str(), s, total > 0 ? 100 * s / total : 0.0));
    };
    double known = 0;
    for (const auto& [stage, s] : seconds.items()) {
        if (stage == "total") continue;
        line(stage, s);
        known += s.get<double>();
    }
    if (total > known) line("other", total - known);
    line("total", total);
}

void add_solve(const Json& result, double peak, std::vector<std::string>& lines) {
    for (const Json& level : result.value("coarse", Json::array()))
        lines.push_back(format("coarse level %g: %d steps, %.0f active voxels%s%s", level.value("voxel_size", 0.0),
                               level.value("steps", 0), level.value("active_voxels", 0.0),
                               level.contains("left_out") ? "; left out: " : "",
                               level.value("left_out", std::string()).c_str()));
    if (!result.contains("solve") || !result.contains("grid")) return;
    const Json& solve = result.at("solve");
    const double voxels = result.at("grid").value("active_voxels", 0.0), steps = solve.value("steps", 0.0);
    lines.push_back(
        format("%.0f active voxels in %.0f leaves%s", voxels, result.at("grid").value("leaf_count", 0.0),
               peak > 0 && voxels > 0 ? format("; %.0f bytes of peak memory for each", peak / voxels).c_str() : ""));
    if (!(steps > 0) || !(voxels > 0)) return;
    const double visits = solve.value("leaf_visits", 0.0), saved = solve.value("leaf_visits_saved", 0.0);
    lines.push_back(format("%.0f steps (%s) of %.1f sweeps, %.0f leaf visits, %.1f %% saved", steps,
                           solve.value("stop_reason", "").c_str(), solve.value("sweeps_per_step", 0.0), visits,
                           visits + saved > 0 ? 100 * saved / (visits + saved) : 0.0));
    lines.push_back(format("for each active voxel and step: assembly %.1f ns, sweeps %.1f ns",
                           1e9 * solve.value("seconds_assembly", 0.0) / voxels / steps,
                           1e9 * solve.value("seconds_sweeps", 0.0) / voxels / steps));
}

}  // namespace

std::vector<std::string> profile_lines(const Json& report) {
    std::vector<std::string> lines;
    add_stages(report.at("seconds"), lines);
    const double peak = report.value("peak_rss_bytes", 0.0);
    lines.push_back(format("peak memory %.0f MiB", peak / (1 << 20)));
    add_solve(report, peak, lines);
    for (const Json& structure : report.value("structures", Json::array())) {
        lines.push_back(structure.value("name", "") + ":");
        add_solve(structure, 0, lines);
    }
    return lines;
}

}  // namespace covol::tool
