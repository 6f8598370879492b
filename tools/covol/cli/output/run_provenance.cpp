#include "cli/output/run_provenance.h"

#include "cli/options/job_options.h"
#include "cli/options/parsed_options.h"
#include "cli/output/grid_metadata.h"
#include "cli/output/provenance.h"
#include "covol/evolve.h"
#include "covol/safe_text.h"
#include "covol/version.h"

namespace covol::tool {

void RunProvenance::set_world(const ImageGeometry& geometry) {
    unit_ = geometry.unit.empty() ? "not stated" : geometry.unit;
    space_ = "LPS";
}

void RunProvenance::set_world_of_points() {
    unit_ = "not stated";
    space_ = "none";
}

void RunProvenance::set_world(const FloatGrid& grid) {
    const std::map<std::string, std::string> facts = text_metadata(grid);
    const auto fact = [&](const char* name) { return facts.contains(name) ? facts.at(name) : ""; };
    unit_ = fact("covol_unit");
    space_ = fact("covol_space");
}

std::map<std::string, std::string> RunProvenance::metadata() const {
    std::vector<std::string> own = given_names(command_);
    for (const std::string& name : names_of(command_, OptionRole::Conduct)) std::erase(own, name);
    const auto text = [](const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); };
    std::map<std::string, std::string> facts{{"covol_version", version()},
                                             {"covol_instruction_set", instruction_set()},
                                             {"covol_options", text(options_of_result())},
                                             {"covol_given", text(own)},
                                             {"covol_inputs", text(described_inputs())}};
    if (report_.contains("bricks")) facts["covol_bricks"] = text(report_.at("bricks").at("count"));
    if (!unit_.empty()) facts["covol_unit"] = unit_;
    if (!space_.empty()) facts["covol_space"] = space_;
    if (report_.contains("resolved")) facts["covol_resolved"] = text(report_.at("resolved"));
    return facts;
}

Json RunProvenance::options_of_result() const {
    Json options = without_folders(report_.at("options"));
    options["command"] = report_.at("command");
    for (const std::string& name : names_of(command_, OptionRole::Conduct)) options.erase(name);
    return options;
}

std::string RunProvenance::job_text() const {
    Json options = options_of_result();
    for (const std::string& name : names_of(command_, OptionRole::Output)) options.erase(name);
    return Json{{"version", version()},
                {"instruction_set", instruction_set()},
                {"options", options},
                {"inputs", described_inputs()}}
               .dump(2, ' ', false, Json::error_handler_t::replace) +
           "\n";
}

const Json& RunProvenance::described_inputs() const {
    if (inputs_described_.is_null()) inputs_described_ = describe_inputs(inputs_);
    return inputs_described_;
}

std::vector<std::string> RunProvenance::comments() const {
    std::vector<std::string> lines;
    for (const auto& [key, value] : metadata()) lines.push_back(safe_text(key + " " + value));
    return lines;
}

std::string RunProvenance::comment() const {
    std::string text;
    for (const std::string& line : comments()) text += (text.empty() ? "" : "\n") + line;
    return text;
}

}  // namespace covol::tool
