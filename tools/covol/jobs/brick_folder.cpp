#include "jobs/brick_folder.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "covol/error.h"
#include "covol/file_set.h"
#include "covol/vdb_io.h"
#include "covol/version.h"

namespace covol::tool {
namespace {

constexpr std::uintmax_t kMostBytes = std::uintmax_t(1) << 30;  // of a plan's text

Json to_json(const EdgeOptions& edge) {
    Json json{{"feature", int(edge.feature)}, {"low", edge.low}, {"high", edge.high}};
    if (edge.sigma) json["sigma"] = *edge.sigma;
    if (edge.edge_k) json["edge_k"] = *edge.edge_k;
    if (edge.contrast_percentile) json["contrast_percentile"] = *edge.contrast_percentile;
    return json;
}

EdgeOptions edge_of(const Json& json) {
    EdgeOptions edge;
    const int feature = json.at("feature").get<int>();
    if (feature < 0 || feature > int(EdgeFeature::DarkLine)) throw std::out_of_range("feature");
    edge.feature = EdgeFeature(feature);
    edge.low = json.at("low").get<double>();
    edge.high = json.at("high").get<double>();
    const auto optional = [&](const char* name) {
        return json.contains(name) ? std::optional(json.at(name).get<double>()) : std::nullopt;
    };
    edge.sigma = optional("sigma");
    edge.edge_k = optional("edge_k");
    edge.contrast_percentile = optional("contrast_percentile");
    return edge;
}

Json to_json(const Brick& brick) {
    return {{"min", brick.core.min},
            {"max", brick.core.max},
            {"active_voxels", brick.active_voxels},
            {"neighbours", brick.neighbours}};
}

Brick brick_of(const Json& json) {
    return {{json.at("min").get<Index3>(), json.at("max").get<Index3>()},
            json.at("active_voxels").get<std::int64_t>(),
            json.at("neighbours").get<std::vector<std::size_t>>()};
}

Json input_of(const std::string& path) { return {{"path", path}, {"bytes", std::filesystem::file_size(path)}}; }

Json read_json(const std::string& path) {
    std::error_code status;
    if (std::filesystem::file_size(path, status) > kMostBytes || status)
        throw Error(Errc::Io, path + ": cannot read; expected a file of covol brick");
    std::ifstream file(path);
    Json json = Json::parse(file, nullptr, false);
    if (!json.is_object()) throw Error(Errc::InvalidInput, path + ": expected JSON of covol brick; it is damaged");
    return json;
}

void check_inputs(const Json& plan, const std::string& path) {
    for (const Json& input : plan.at("inputs")) {
        const std::string name = input.at("path").get<std::string>();
        std::error_code status;
        const std::uintmax_t bytes = std::filesystem::file_size(name, status);
        if (status)
            throw Error(Errc::Io, name + ": cannot read; " + path +
                                      " was planned with it: run covol brick where the plan was made");
        if (bytes != input.at("bytes").get<std::uintmax_t>())
            throw Error(Errc::InvalidInput, name + ": has another size than when " + path + " was made: plan again");
    }
}

}  // namespace

void BrickFolder::write_plan(const BrickPlan& plan, const std::vector<std::string>& job,
                             const std::vector<std::string>& inputs, const WriteVdbOptions& options) const {
    const std::string file = plan_file(path_);
    std::error_code status;
    if (std::filesystem::exists(file, status))
        throw Error(Errc::InvalidOptions, path_ + ": there is a plan already; remove the folder to plan again");
    std::filesystem::create_directories(path_, status);
    if (status) throw Error(Errc::Io, path_ + ": cannot make the folder: " + status.message());
    write_vdb(path_ + "/coarse.vdb", {plan.coarse}, options);
    Json json{{"covol", version()},
              {"job", job},
              {"inputs", Json::array()},
              {"overlap", plan.options.overlap},
              {"tolerance", plan.options.tolerance},
              {"most_sweeps", plan.options.most_sweeps},
              {"most_voxels", plan.options.most_voxels},
              {"has_sweeps", plan.has_sweeps},
              {"voxel_size", plan.domain.voxel_size},
              {"origin", plan.domain.origin},
              {"min", plan.domain.min},
              {"max", plan.domain.max},
              {"edge", to_json(plan.edge)},
              {"bricks", Json::array()}};
    for (const std::string& input : inputs) json["inputs"].push_back(input_of(input));
    for (const Brick& brick : plan.bricks) json["bricks"].push_back(to_json(brick));
    write_text_file(file, json.dump(1) + "\n");
}

BrickPlan BrickFolder::read_plan() const {
    const std::string file = plan_file(path_);
    const Json json = read_json(file);
    BrickPlan plan;
    try {
        check_inputs(json, file);
        plan.options.overlap = json.at("overlap").get<int>();
        plan.options.tolerance = json.at("tolerance").get<double>();
        plan.options.most_sweeps = json.at("most_sweeps").get<int>();
        plan.options.most_voxels = json.at("most_voxels").get<std::int64_t>();
        plan.has_sweeps = json.at("has_sweeps").get<bool>();
        plan.domain = {json.at("voxel_size").get<double>(), json.at("origin").get<Vec3>(), json.at("min").get<Index3>(),
                       json.at("max").get<Index3>()};
        plan.edge = edge_of(json.at("edge"));
        for (const Json& brick : json.at("bricks")) plan.bricks.push_back(brick_of(brick));
        for (const Brick& brick : plan.bricks)
            for (const std::size_t neighbour : brick.neighbours) (void)plan.bricks.at(neighbour);
    } catch (const nlohmann::json::exception& error) {
        throw Error(Errc::InvalidInput, file + ": expected a plan of covol brick plan: " + error.what());
    } catch (const std::out_of_range& error) {
        throw Error(Errc::InvalidInput, file + ": expected a plan of covol brick plan: " + error.what());
    }
    if (const std::string why = plan.options.why_invalid(); !why.empty())
        throw Error(Errc::InvalidInput, file + ": " + why);
    plan.coarse = read_vdb(path_ + "/coarse.vdb", "coarse");
    return plan;
}

std::string BrickFolder::name(int sweep, std::size_t brick, const char* ending) const {
    char text[64];
    std::snprintf(text, sizeof text, "/sweep-%02d/brick-%05zu%s", sweep, brick, ending);
    return path_ + text;
}

bool BrickFolder::is_done(int sweep, std::size_t brick) const {
    std::error_code status;
    return std::filesystem::exists(name(sweep, brick, ".json"), status);
}

int BrickFolder::sweep_of_state(int sweep, std::size_t brick) const {
    while (sweep > 0 && is_done(sweep, brick)) {
        if (!read_json(name(sweep, brick, ".json")).value("same", false)) return sweep;
        --sweep;
    }
    return 0;
}

FloatGridPtr BrickFolder::state(int sweep, std::size_t brick) const {
    const int found = sweep_of_state(sweep, brick);
    return found > 0 ? read_vdb(name(found, brick, ".vdb"), "u") : nullptr;
}

void BrickFolder::write_state(int sweep, std::size_t brick, const FloatGridPtr& state, Json facts) const {
    const std::string file = name(sweep, brick, ".vdb");
    std::error_code status;
    std::filesystem::create_directories(std::filesystem::path(file).parent_path(), status);
    write_vdb(file, {state});
    facts["same"] = false;
    write_text_file(name(sweep, brick, ".json"), facts.dump() + "\n");
}

void BrickFolder::write_same(int sweep, std::size_t brick, Json facts) const {
    const std::string file = name(sweep, brick, ".json");
    std::error_code status;
    std::filesystem::create_directories(std::filesystem::path(file).parent_path(), status);
    facts["same"] = true;
    write_text_file(file, facts.dump() + "\n");
}

BrickFolder::Spent BrickFolder::spent(int sweep, std::size_t bricks) const {
    Spent all;
    for (std::size_t n = 0; n < bricks; ++n) {
        int steps = 0;
        std::string last;
        for (int s = 1; s <= sweep; ++s) {
            const Json facts = read_json(name(s, n, ".json"));
            steps += facts.value("steps", 0);
            all.seconds += facts.value("seconds", 0.0);
            last = facts.value("stop_reason", last);
        }
        all.steps = std::max(all.steps, steps);
        all.unsteady += last == to_string(StopReason::MaxSteps) ? 1 : 0;
    }
    return all;
}

int BrickFolder::last_sweep(std::size_t bricks) const {
    for (int sweep = 1;; ++sweep)
        for (std::size_t n = 0; n < bricks; ++n)
            if (!is_done(sweep, n)) return sweep - 1;
}

BrickStates BrickFolder::states(int sweep) const {
    return [this, sweep](std::size_t brick) { return state(sweep, brick); };
}

}  // namespace covol::tool
