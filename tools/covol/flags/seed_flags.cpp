#include "flags/seed_flags.h"

#include <algorithm>
#include <filesystem>

namespace covol::tool {
namespace {

/// Whether `text` is a position such as "1.5,-2,3e1", and not the name of a file.
bool is_position(const std::string& text) {
    std::error_code status;
    return text.find_first_not_of("0123456789+-.eE, ") == std::string::npos &&
           std::count(text.begin(), text.end(), ',') > 0 && !std::filesystem::exists(text, status);
}

}  // namespace

void SeedFlags::bind(CLI::App& command, bool names) {
    in_group(command, Group::Marks);
    const std::string more = ": a position, or a file as for points; repeatable";
    const char* type = names ? "[NAME=]FILE|X,Y,Z" : "FILE|X,Y,Z";
    command.add_option("--inside", inside, "seeds inside the structure" + more)
        ->type_name(type)
        ->allow_extra_args(false);
    command.add_option("--outside", outside, "seeds outside the structure, also in cavities" + more)
        ->type_name(type)
        ->allow_extra_args(false);
}

void add_seed(const std::string& flag, const std::string& text, std::vector<std::string>& files,
              std::vector<PointCloud>& clouds) {
    if (!is_position(text)) return files.push_back(text);
    PointCloud& cloud = clouds.emplace_back();
    cloud.points = {parse_vec3(flag, text)};
    cloud.source = flag + " " + text;
    cloud.stated = true;
}

}  // namespace covol::tool
