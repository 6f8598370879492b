#include "jobs/brick_folder.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <limits>

#include "covol/domain.h"
#include "covol/error.h"
#include "covol/file_set.h"
#include "covol/vdb_io.h"
#include "covol/version.h"

namespace covol::tool {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxFactsBytes = 1 << 20;  // maximum size of a file of BrickFacts
constexpr std::int64_t kMaxVoxels = std::int64_t(1) << 40;

/// An integer of a JSON object, in the given range. @throws std::out_of_range, as Json does for missing fields
template <typename Number = int>
Number whole(const Json& json, const char* name, std::int64_t low, std::int64_t high) {
    const Json& value = json.at(name);
    const bool fits = value.is_number_unsigned() ? value.get<std::uint64_t>() <= std::uint64_t(high)
                                                 : value.is_number_integer() && value.get<std::int64_t>() <= high;
    if (!fits || value.get<std::int64_t>() < low)
        throw std::out_of_range(std::string(name) + ": expected a whole number, " + std::to_string(low) + " to " +
                                std::to_string(high) + ", got " + value.dump().substr(0, 40));
    return Number(value.get<std::int64_t>());
}

double real(const Json& json, const char* name) {
    const Json& value = json.at(name);
    if (!value.is_number())
        throw std::out_of_range(std::string(name) + ": expected a number, got " + value.dump().substr(0, 40));
    return value.get<double>();
}

/// An array of three numbers, one for each axis.
const Json& three(const Json& json, const char* name) {
    const Json& value = json.at(name);
    if (!value.is_array() || value.size() != 3)
        throw std::out_of_range(std::string(name) + ": expected three numbers, got " + value.dump().substr(0, 40));
    return value;
}

Index3 index_of(const Json& json, const char* name) {
    constexpr std::int64_t kMaxIndex = 1 << 24;  // voxels; less than half of this in a valid plan: domain_of_plan()
    Index3 index{};
    for (int a = 0; a < 3; ++a)
        index[a] = whole(Json{{name, three(json, name)[std::size_t(a)]}}, name, -kMaxIndex, kMaxIndex);
    return index;
}

Vec3 place_of(const Json& json, const char* name) {
    Vec3 place{};
    for (int a = 0; a < 3; ++a) place[a] = real(Json{{name, three(json, name)[std::size_t(a)]}}, name);
    return place;
}

Json as_json(const EdgeOptions& edge) {
    const auto [low, high] = edge.intensities.value_or(std::array{0.0, 0.0});
    Json json{{"feature", int(edge.feature)}, {"low", low}, {"high", high}};
    if (edge.sigma) json["sigma"] = *edge.sigma;
    if (edge.edge_k) json["edge_k"] = *edge.edge_k;
    if (edge.contrast_percentile) json["contrast_percentile"] = *edge.contrast_percentile;
    return json;
}

EdgeOptions edge_of(const Json& json) {
    EdgeOptions edge;
    edge.feature = EdgeFeature(whole(json, "feature", 0, int(EdgeFeature::DarkLine)));
    if (const double low = real(json, "low"), high = real(json, "high"); low != high) edge.intensities = {low, high};
    const auto optional = [&](const char* name) {
        return json.contains(name) ? std::optional(real(json, name)) : std::nullopt;
    };
    edge.sigma = optional("sigma");
    edge.edge_k = optional("edge_k");
    edge.contrast_percentile = optional("contrast_percentile");
    return edge;
}

Json as_json(const Brick& brick) {
    return {{"min", brick.core.min},
            {"max", brick.core.max},
            {"active_voxels", brick.active_voxels},
            {"neighbours", brick.neighbours}};
}

Brick brick_of(const Json& json, const Domain& domain, std::size_t bricks) {
    Brick brick{
        {index_of(json, "min"), index_of(json, "max")}, whole<std::int64_t>(json, "active_voxels", 0, kMaxVoxels), {}};
    for (int a = 0; a < 3; ++a)
        if (brick.core.min[a] > brick.core.max[a] || brick.core.min[a] < domain.min[a] ||
            brick.core.max[a] > domain.max[a])
            throw std::out_of_range("bricks: expected boxes within that of the plan");
    const Json& neighbours = json.at("neighbours");
    if (!neighbours.is_array() || neighbours.size() >= bricks)
        throw std::out_of_range("neighbours: expected a list of at most " + std::to_string(bricks - 1) +
                                " other bricks");
    for (const Json& neighbour : neighbours)
        brick.neighbours.push_back(
            whole<std::size_t>(Json{{"neighbours", neighbour}}, "neighbours", 0, std::int64_t(bricks) - 1));
    return brick;
}

/// Reads a domain, and validates it. @throws std::out_of_range, Error
Domain domain_of_plan(const Json& json) {
    const Domain domain{real(json, "voxel_size"), place_of(json, "origin"), index_of(json, "min"),
                        index_of(json, "max")};
    for (int a = 0; a < 3; ++a)
        if (domain.min[a] > domain.max[a]) throw std::out_of_range("min: expected at most max");
    const Domain same = covering(domain, domain.world_box());
    if (same.min != domain.min || same.max != domain.max)
        throw std::out_of_range("origin: expected a position that is not too far from 0 for voxels of " +
                                std::to_string(domain.voxel_size));
    return domain;
}

/// The size of a file, bytes; 0 for a folder, such as a Zarr store.
std::uintmax_t bytes_of(const std::string& path, std::error_code& status) {
    return fs::is_directory(path, status) ? 0 : fs::file_size(path, status);
}

Json input_of(const std::string& path) {
    std::error_code status;
    const std::uintmax_t bytes = bytes_of(path, status);
    if (status) throw Error(Errc::Io, path + ": cannot read: " + status.message());
    return {{"path", path}, {"bytes", bytes}};
}

/// The facts about the solution of a brick in one sweep, stored in sweep-N/brick-B.json.
struct BrickFacts {
    bool same = false;
    int steps = 0;
    double seconds = 0;
    std::string stop_reason;
};

BrickFacts read_facts(const std::string& path) {
    const Json json = read_json(path, kMaxFactsBytes);
    try {
        BrickFacts facts;
        facts.same = json.at("same").get<bool>();
        if (json.contains("steps")) facts.steps = whole(json, "steps", 0, std::numeric_limits<int>::max());
        if (json.contains("seconds")) facts.seconds = real(json, "seconds");
        if (json.contains("stop_reason")) facts.stop_reason = json["stop_reason"].get<std::string>();
        return facts;
    } catch (const std::exception& error) {
        throw Error(Errc::InvalidInput,
                    path + ": expected the state of a brick, written by covol brick run: " + error.what());
    }
}

/// Creates the folder of a file. A symbolic link is refused: a plan from an untrusted source may contain links to other
/// folders.
void make_folder_of(const std::string& file) {
    const fs::path folder = fs::path(file).parent_path();
    std::error_code status;
    fs::create_directories(folder, status);
    const std::error_code failed = status;
    const fs::file_status made = fs::symlink_status(folder, status);
    if (failed && !fs::exists(made))
        throw Error(Errc::Io, folder.string() + ": cannot make the folder: " + failed.message());
    if (!fs::is_directory(made))
        throw Error(Errc::Io, folder.string() + ": cannot write: expected a folder, got a link or a file");
}

void check_inputs(const Json& plan, const std::string& path) {
    for (const Json& input : plan.at("inputs")) {
        const std::string name = input.at("path").get<std::string>();
        std::error_code status;
        const std::uintmax_t bytes = bytes_of(name, status);
        if (status)
            throw Error(Errc::Io, name + ": cannot read; " + path +
                                      " refers to it: run covol brick in the folder in which the plan was made");
        if (bytes != whole<std::uintmax_t>(input, "bytes", 0, std::numeric_limits<std::int64_t>::max()))
            throw Error(Errc::InvalidInput, name + ": its size has changed since " + path + " was made: plan again");
    }
}

}  // namespace

void BrickFolder::write_plan(const BrickPlan& plan, const JobOptions& job, const std::vector<std::string>& inputs,
                             const WriteVdbOptions& options) const {
    const std::string file = plan_file(path_);
    std::error_code status;
    if (std::filesystem::exists(file, status))
        throw Error(Errc::InvalidOptions, path_ + ": there is a plan already; remove the folder to plan again");
    std::filesystem::create_directories(path_, status);
    if (status) throw Error(Errc::Io, path_ + ": cannot make the folder: " + status.message());
    write_vdb(path_ + "/coarse.vdb", {plan.coarse}, options);
    Json json{{"covol", version()},
              {"job", to_json(job)},
              {"inputs", Json::array()},
              {"overlap", plan.options.overlap},
              {"tolerance", plan.options.tolerance},
              {"most_sweeps", plan.options.max_sweeps},
              {"most_voxels", plan.options.max_voxels},
              {"has_sweeps", plan.has_sweeps},
              {"voxel_size", plan.domain.voxel_size},
              {"origin", plan.domain.origin},
              {"min", plan.domain.min},
              {"max", plan.domain.max},
              {"edge", as_json(plan.edge)},
              {"bricks", Json::array()}};
    for (const std::string& input : inputs) json["inputs"].push_back(input_of(input));
    for (const Brick& brick : plan.bricks) json["bricks"].push_back(as_json(brick));
    write_text_file(file, json.dump(1) + "\n");
}

BrickPlan BrickFolder::read_plan() const {
    const std::string file = plan_file(path_);
    const Json json = read_plan_file(path_);
    constexpr int kMaxInt = std::numeric_limits<int>::max();
    BrickPlan plan;
    const auto refuse = [&](const std::exception& error) {
        throw Error(Errc::InvalidInput, file + ": expected a plan written by covol brick plan: " + error.what());
    };
    try {
        check_inputs(json, file);
    } catch (const Error&) {
        throw;  // about an input, not about the plan
    } catch (const std::exception& error) {
        refuse(error);
    }
    try {
        plan.options.overlap = whole(json, "overlap", 0, kMaxInt);
        plan.options.tolerance = real(json, "tolerance");
        plan.options.max_sweeps = whole(json, "most_sweeps", 0, kMaxInt);
        plan.options.max_voxels = whole<std::int64_t>(json, "most_voxels", 0, kMaxVoxels);
        plan.has_sweeps = json.at("has_sweeps").get<bool>();
        plan.domain = domain_of_plan(json);
        plan.edge = edge_of(json.at("edge"));
        const Json& bricks = json.at("bricks");
        if (!bricks.is_array() || bricks.empty())
            throw std::out_of_range("bricks: expected a list of at least one brick");
        for (const Json& brick : bricks) plan.bricks.push_back(brick_of(brick, plan.domain, bricks.size()));
        if (const std::string why = why_invalid(plan.edge); !why.empty()) throw std::out_of_range(why);
    } catch (const std::exception& error) {
        refuse(error);
    }
    if (const std::string why = why_invalid(plan.options); !why.empty())
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
        if (!read_facts(name(sweep, brick, ".json")).same) return sweep;
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
    make_folder_of(file);
    write_vdb(file, {state});
    facts["same"] = false;
    write_text_file(name(sweep, brick, ".json"), facts.dump() + "\n");
}

void BrickFolder::write_same(int sweep, std::size_t brick, Json facts) const {
    const std::string file = name(sweep, brick, ".json");
    make_folder_of(file);
    facts["same"] = true;
    write_text_file(file, facts.dump() + "\n");
}

BrickFolder::Spent BrickFolder::spent(int sweep, std::size_t bricks) const {
    Spent all;
    for (std::size_t n = 0; n < bricks; ++n) {
        int steps = 0;
        std::string last;
        for (int s = 1; s <= sweep; ++s) {
            const BrickFacts facts = read_facts(name(s, n, ".json"));
            steps += std::min(facts.steps, std::numeric_limits<int>::max() - steps);
            all.seconds += facts.seconds;
            if (!facts.stop_reason.empty()) last = facts.stop_reason;
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
