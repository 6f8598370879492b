#include "jobs/structure_inputs.h"

#include <algorithm>
#include <functional>
#include <iomanip>
#include <sstream>

#include "covol/file_kind.h"
#include "covol/point_structures.h"
#include "covol/study.h"
#include "covol/study_files.h"
#include "covol/vdb_io.h"
#include "jobs/doubtful_reading.h"

namespace covol::tool {
namespace {

/// The structure with this name. @throws UsageError
Marks& owner_of(std::vector<Marks>& structures, const std::string& flag, const std::string& name) {
    Marks* const found = find_structure(structures, name);
    if (found == nullptr) throw UsageError(flag + ": no structure is called '" + name + "'");
    return *found;
}

/// The column that names the structure of each mark in a file: the given one, or "roi" for a DICOM structure set that
/// was given without NAME=; empty if all marks of the file belong to one structure.
std::string column_of(const SegmentJob& job, const std::string& text) {
    if (!job.structure_column.empty()) return job.structure_column;
    const bool names_itself = !job.images.empty() && split_name(text).name.empty() && long_ending(text) == ".dcm";
    return names_itself ? "roi" : "";
}

using TakePoints = std::function<void(Marks& owner, const std::string& file, const KindedPoints& points)>;

/// For files whose marks name their structures, calls `take` with the marks of each structure.
void assign_files(const SegmentJob& job, const std::vector<std::string>& texts, std::vector<Marks>& structures,
                  const TakePoints& take) {
    for (const std::string& text : texts) {
        const std::string column = column_of(job, text);
        if (column.empty()) continue;
        if (text == "-" || !split_name(text).name.empty())
            throw UsageError(
                "--structure-column: expected a file, without NAME=, whose marks name their structures, got " + text);
        for (const auto& [name, points] : job.shared->read(text, column, job.points.options))
            take(find_or_add_structure(structures, name), text, points);
    }
}

/// Adds the structures of all files. Files with marks of one structure are added to its list of files.
void add_files(const SegmentJob& job, const std::vector<std::string>& texts, std::vector<Marks>& structures,
               std::vector<std::string> MarkFiles::*kind) {
    for (const std::string& text : texts) {
        if (!column_of(job, text).empty()) {
            assign_files(job, {text}, structures, [](Marks&, const std::string&, const KindedPoints&) {});
            continue;
        }
        const Named file = split_name(text);
        (find_or_add_structure(structures, file.name).files.*kind).push_back(file.value);
    }
}

/// Assigns each seed to its structure; seeds without a name are assigned to all.
void assign_seeds(std::vector<Marks>& structures, const std::string& flag, const std::vector<std::string>& texts,
                  std::vector<std::string> MarkFiles::*files, std::vector<PointCloud> Marks::*clouds) {
    for (const std::string& text : texts) {
        const Named seed = split_name(text);
        if (!seed.name.empty()) (void)owner_of(structures, flag, seed.name);
        for (Marks& marks : structures)
            if (seed.name.empty() || &marks == find_structure(structures, seed.name))
                add_seed(flag, seed.value, marks.files.*files, marks.*clouds);
    }
}

/// Warns if marks that were read as lengths are probably voxel indices: although they are inside the image if read as
/// lengths, the image has stronger edges at the marks if they are read as indices.
void warn_of_voxels(const Marks& marks, const std::optional<Image>& image, const ReadPointsOptions& reading,
                    const RunContext& run) {
    if (!image || reading.space != PointSpace::Unstated || marks.points.empty()) return;
    const bool in_lengths = std::all_of(marks.rules.begin(), marks.rules.end(), [](const std::string& rule) {
        return rule.ends_with("x, y, z in world units");  // the text for coordinates that were read as lengths
    });
    if (!in_lengths) return;
    const std::optional<double> ratio = edges_if_voxels(marks.points, *image);
    if (!ratio) return;
    std::ostringstream rounded;
    rounded << std::setprecision(2) << *ratio;
    run.warn("the marks lie inside the image, but with `points_space = index` they would lie where its edges are " +
             rounded.str() + " times as strong: perhaps they are voxels, not world units");
}

}  // namespace

const std::vector<StructurePoints>& SharedMarks::read(const std::string& file, const std::string& column,
                                                      const ReadPointsOptions& options) {
    const auto known = read_.find(file);
    if (known != read_.end()) return known->second;
    return read_.emplace(file, read_structures_of_points(file, column, options)).first->second;
}

std::vector<Marks> structures_of(const SegmentJob& job,
                                 const std::vector<std::shared_ptr<const PaintedImage>>& painted) {
    std::vector<Marks> structures;
    if (!job.study.empty())
        structures = marks_of(read_study(job.study), open_study_site(job.study, read_study_image(job.study).geometry));
    add_files(job, job.points.paths, structures, &MarkFiles::points);
    add_files(job, job.contours.paths, structures, &MarkFiles::contours);
    add_paint(structures, painted);
    for (const std::string& text : job.guess.paths) {
        const Named file = split_name(text);
        std::string& guess = find_or_add_structure(structures, file.name).files.guess;
        if (!guess.empty())
            throw UsageError("--guess: expected one file for a structure, got " + guess + " and " + file.value);
        guess = file.value;
    }
    for (const std::string& text : job.seeds.inside)
        if (const Named seed = split_name(text); !seed.name.empty()) find_or_add_structure(structures, seed.name);
    if (structures.empty()) structures.emplace_back();
    for (const Marks& marks : structures)
        if (structures.size() > 1 && marks.name.empty()) {
            const MarkFiles& files = marks.files;
            throw UsageError(
                "--points, --contours, --guess, --painted: expected a name for every file when one has a name "
                "(ve=FILE) or several labels are painted, got none for " +
                (!files.points.empty()     ? files.points.front()
                 : !files.contours.empty() ? files.contours.front()
                 : marks.paint.empty()     ? files.guess
                                           : marks.paint.front().image->image.path()));
        }
    assign_seeds(structures, "--inside", job.seeds.inside, &MarkFiles::inside, &Marks::inside);
    assign_seeds(structures, "--outside", job.seeds.outside, &MarkFiles::outside, &Marks::outside);
    for (const auto& [name, seed] : job.named_seeds)
        owner_of(structures, "--exterior-seed", name).exterior_seeds.push_back(seed);
    return structures;
}

bool names_structures(const SegmentJob& job) {
    const auto names = [&](const std::vector<std::string>& texts) {
        return std::any_of(texts.begin(), texts.end(),
                           [&](const std::string& text) { return !column_of(job, text).empty(); });
    };
    return !job.structure_column.empty() || names(job.points.paths) || names(job.contours.paths);
}

std::vector<std::string> names_of(const std::vector<Marks>& structures) {
    std::vector<std::string> names;
    names.reserve(structures.size());
    for (const Marks& marks : structures) names.push_back(marks.name);
    return names;
}

void add_starts(const SegmentJob& job, std::vector<Marks>& structures, const RunContext& run) {
    const Start& start = job.given.options.start;
    if (!is_named(start)) return;
    if (structures.size() == 1) {
        structures.front().start = read_start(start, job.start_path, run);
        return;
    }
    if (!is_any<LevelSetStart>(start))
        throw UsageError(
            "--init: several structures cannot start from one shape; expected auto, guess, tag, or vdb:FILE with a "
            "grid for each");
    const std::vector<std::string> grids = make_grid_names(names_of(structures));
    for (std::size_t n = 0; n < structures.size(); ++n)
        structures[n].start = LevelSetStart{read_vdb(job.start_path, grids[n])};
}

std::map<std::string, MarkFiles> read_shared_files(const SegmentJob& job, std::vector<Marks>& structures,
                                                   const std::optional<ImageGeometry>& geometry,
                                                   const RunContext& run) {
    std::map<std::string, MarkFiles> files;
    assign_files(job, job.points.paths, structures,
                 [&](Marks& owner, const std::string& file, const KindedPoints& points) {
                     add_marks(owner, file, points, geometry, speaking_for(owner.name, structures.size(), run));
                     files[owner.name].points.push_back(file);
                 });
    assign_files(job, job.contours.paths, structures,
                 [&](Marks& owner, const std::string& file, const KindedPoints& points) {
                     add_contours(owner, points.cloud, geometry, speaking_for(owner.name, structures.size(), run));
                     files[owner.name].contours.push_back(file);
                 });
    return files;
}

StructuresOptions read_structures(const SegmentJob& job, std::vector<Marks>& structures,
                                  const std::optional<Image>& image, Session& session, const RunContext& run) {
    std::optional<ImageGeometry> geometry;
    if (image) geometry = image->geometry();
    const ReadMarksOptions reading = job.reading(run);
    std::optional<double> h;
    const std::map<std::string, MarkFiles> shared = read_shared_files(job, structures, geometry, run);
    for (Marks& marks : structures) {
        const RunContext own = speaking_for(marks.name, structures.size(), run);
        const Stopwatch watch;
        read_marks(marks, geometry, reading, own);
        if (const auto own_files = shared.find(marks.name); own_files != shared.end()) {
            const auto append = [](std::vector<std::string>& all, const std::vector<std::string>& some) {
                all.insert(all.end(), some.begin(), some.end());
            };
            append(marks.files.points, own_files->second.points);
            append(marks.files.contours, own_files->second.contours);
        }
        warn_of_voxels(marks, image, reading.points, own);
        if (!image) thin_points(marks, job.cloud.inputs.options.max_points, own);
        session.add_seconds("read", watch.seconds());
        if (!image && marks.points.empty() && marks.contours.empty())
            throw UsageError("expected points or contours, got none");
        if (!h) h = job.resolve_voxel_size(image ? &*image : nullptr, marks, geometry, session);
    }
    return {job.resolve(*h), job.marks_options(*h)};
}

StructureInput prepare_structure(const SegmentJob& job, std::vector<Marks> structures,
                                 const std::optional<Image>& image, Session& session, const RunContext& run) {
    std::optional<ImageGeometry> geometry;
    if (image) geometry = image->geometry();
    const StructuresOptions options = read_structures(job, structures, image, session, run);
    StructureInput input =
        std::move(prepare_marks(std::move(structures), geometry, options.segment, options.marks, run).front());
    if (input.guess) input.options.guess = input.guess(run).start;
    return input;
}

}  // namespace covol::tool
