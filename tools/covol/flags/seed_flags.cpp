#include "flags/seed_flags.h"

#include <algorithm>
#include <filesystem>

#include "covol/seeds.h"

namespace covol::tool {
namespace {

/// "1.5,-2,3e1" and the like, which is no file.
bool is_position(const std::string& text) {
    std::error_code status;
    return text.find_first_not_of("0123456789+-.eE, ") == std::string::npos &&
           std::count(text.begin(), text.end(), ',') > 0 && !std::filesystem::exists(text, status);
}

std::vector<Vec3> read_side(const std::string& flag, const std::vector<std::string>& texts,
                            const ReadPointsOptions& reading, const ImageGeometry* geometry, double step,
                            const RunContext& run) {
    std::vector<Vec3> seeds;
    for (const std::string& text : texts) {
        run.check();
        PointCloud cloud;
        if (is_position(text)) {
            cloud.points = {parse_vec3(flag, text)};
            cloud.source = flag + " " + text;
            cloud.stated = true;
        } else {
            cloud = read_points(text, reading);
        }
        if (geometry != nullptr) check_inside(cloud, *geometry, run);
        const std::vector<Vec3> found =
            geometry != nullptr ? collect_seeds(cloud, *geometry, step) : collect_seeds(cloud, step);
        seeds.insert(seeds.end(), found.begin(), found.end());
        if (!is_position(text))
            run.info(flag + " " + text + ": " + std::to_string(found.size()) + " seeds" +
                     (cloud.rule.empty() ? "" : ", " + cloud.rule));
    }
    return seeds;
}

}  // namespace

void SeedFlags::bind(CLI::App& command, bool names) {
    in_group(command, Group::Marks);
    const std::string more = ": a position, or a file as for points; repeatable";
    const char* type = names ? "[NAME=]FILE|X,Y,Z" : "FILE|X,Y,Z";
    command.add_option("--inside", inside, "seeds inside the structure" + more)
        ->type_name(type)
        ->allow_extra_args(false);
    command.add_option("--outside", outside, "seeds outside of it, in cavities too" + more)
        ->type_name(type)
        ->allow_extra_args(false);
}

Seeds read_seeds(const SeedFlags& flags, const ReadPointsOptions& reading, const ImageGeometry* geometry, double step,
                 const RunContext& run) {
    return {read_side("--inside", flags.inside, reading, geometry, step, run),
            read_side("--outside", flags.outside, reading, geometry, step, run)};
}

}  // namespace covol::tool
