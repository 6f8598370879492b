#include "jobs/structure_inputs.h"

#include <algorithm>
#include <set>

#include "covol/safe_text.h"
#include "covol/structures.h"
#include "covol/vdb_io.h"

namespace covol::tool {
namespace {

/// @param given  the name, as somebody wrote it or a file of labels has it
StructureInput& find_or_add(std::vector<StructureInput>& inputs, const std::string& given, const SegmentJob& job) {
    const std::string name = safe_text(given);  // it goes into files, tables and onto terminals
    for (StructureInput& input : inputs)
        if (input.name == name) return input;
    StructureInput added;
    added.name = name;
    added.points = job.points;
    added.points.paths.clear();
    added.contours = job.contours;
    added.contours.paths.clear();
    added.seeds = {};
    inputs.push_back(added);
    return inputs.back();
}

/// Painted labels keep their values; the others get what is free.
void number_labels(std::vector<StructureInput>& inputs) {
    std::set<int> taken;
    for (StructureInput& input : inputs)
        for (const StructureInput::Paint& paint : input.paint)
            if (input.label == 0 && taken.insert(paint.label).second) input.label = paint.label;
    int next = 1;
    for (StructureInput& input : inputs) {
        while (taken.contains(next)) ++next;
        if (input.label == 0) taken.insert(input.label = next);
    }
}

/// The structure that a text NAME=... belongs to.
StructureInput& owner_of(std::vector<StructureInput>& inputs, const std::string& flag, const std::string& given) {
    const std::string name = safe_text(given);
    const auto at =
        std::find_if(inputs.begin(), inputs.end(), [&](const StructureInput& input) { return input.name == name; });
    if (at == inputs.end()) throw UsageError(flag + ": no structure is called '" + name + "'");
    return *at;
}

/// Gives each seed to its structure; one without a name to all.
void share_seeds(std::vector<StructureInput>& inputs, const std::string& flag, const std::vector<std::string>& texts,
                 std::vector<std::string> SeedFlags::*side) {
    for (const std::string& text : texts) {
        const Named seed = split_name(text);
        if (!seed.name.empty())
            (owner_of(inputs, flag, seed.name).seeds.*side).push_back(seed.value);
        else
            for (StructureInput& input : inputs) (input.seeds.*side).push_back(seed.value);
    }
}

void add_paint(std::vector<StructureInput>& inputs, const std::vector<std::shared_ptr<const PaintedFile>>& painted,
               const SegmentJob& job) {
    std::size_t labels = 0;
    bool named = false;
    for (const auto& file : painted) {
        labels += file->labels.size();
        named = named || !file->name.empty();
    }
    const bool one =
        labels == 1 && !named &&
        (inputs.size() == 1 ? inputs.front().name.empty() : inputs.empty() && !painted.front()->labels.front().named);
    for (const auto& file : painted)
        for (const LabelName& label : file->labels)
            find_or_add(inputs, one ? "" : label.name, job).paint.push_back({file, label.label});
}

}  // namespace

std::vector<StructureInput> structures_of(const SegmentJob& job,
                                          const std::vector<std::shared_ptr<const PaintedFile>>& painted) {
    std::vector<StructureInput> inputs;
    for (const std::string& text : job.points.paths) {
        const Named file = split_name(text);
        find_or_add(inputs, file.name, job).points.paths.push_back(file.value);
    }
    for (const std::string& text : job.contours.paths) {
        const Named file = split_name(text);
        find_or_add(inputs, file.name, job).contours.paths.push_back(file.value);
    }
    add_paint(inputs, painted, job);
    for (const std::string& text : job.guess.paths) {
        const Named file = split_name(text);
        StructureInput& input = find_or_add(inputs, file.name, job);
        if (!input.guess.empty())
            throw UsageError("--guess: expected one file for a structure, got " + input.guess + " and " + file.value);
        input.guess = file.value;
    }
    for (const std::string& text : job.seeds.inside)
        if (const Named seed = split_name(text); !seed.name.empty()) find_or_add(inputs, seed.name, job);
    if (inputs.empty()) find_or_add(inputs, "", job);
    for (const StructureInput& input : inputs)
        if (inputs.size() > 1 && input.name.empty()) {
            const std::string first = !input.points.paths.empty()     ? input.points.paths.front()
                                      : !input.contours.paths.empty() ? input.contours.paths.front()
                                                                      : input.guess;
            throw UsageError(
                "--points, --contours: expected a name for every file when one has a name (ve=FILE) or several labels "
                "are painted, got none for " +
                first);
        }
    share_seeds(inputs, "--inside", job.seeds.inside, &SeedFlags::inside);
    share_seeds(inputs, "--outside", job.seeds.outside, &SeedFlags::outside);
    number_labels(inputs);
    for (StructureInput& input : inputs) input.exterior_seeds = job.given.options.exterior_seeds;
    for (const auto& [name, seed] : job.named_seeds)
        owner_of(inputs, "--exterior-seed", name).exterior_seeds.push_back(seed);
    return inputs;
}

std::vector<std::string> names_of(const std::vector<StructureInput>& inputs) {
    std::vector<std::string> names;
    names.reserve(inputs.size());
    for (const StructureInput& input : inputs) names.push_back(input.name);
    return names;
}

std::vector<StructureStart> starts_of(const SegmentJob& job, const std::vector<StructureInput>& inputs) {
    std::vector<StructureStart> starts(inputs.size(), {job.given.options.start});
    if (inputs.size() == 1 || job.given.options.start.kind <= Start::Kind::Tag) return starts;
    if (job.given.options.start.kind != Start::Kind::Vdb)
        throw UsageError(
            "--init: several structures cannot start from one shape; expected tag, or vdb:FILE with a grid for each");
    const std::vector<std::string> grids = make_grid_names(names_of(inputs));
    for (std::size_t n = 0; n < starts.size(); ++n)
        starts[n].start.level_set = read_vdb(job.given.options.start.path, grids[n]);
    return starts;
}

}  // namespace covol::tool
