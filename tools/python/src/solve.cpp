#include "solve.h"

#include "covol/error.h"
#include "covol/read_marks.h"
#include "covol/safe_text.h"

namespace covol::python {
namespace {

std::optional<Start> start_of(const Shape& shape, const RunContext& run) {
    if (const auto* text = std::get_if<std::string>(&shape)) {
        const tool::StartChoice choice = tool::parse_start("init", *text);
        return read_start(choice.start, choice.path, run);
    }
    if (const auto* level_set = std::get_if<LevelSet>(&shape)) return LevelSetStart{level_set->grid};
    if (const auto* mask = std::get_if<Image>(&shape)) return MaskStart{std::make_shared<const Image>(*mask)};
    return std::nullopt;
}

class Solver {
public:
    Solver(const Problem& problem, const GivenOptions& given, const RunContext& run)
        : problem_(problem), given_(given), run_(run) {
        if (problem_.image) geometry_ = problem_.image->geometry();
    }

    StructuresResult solve(TimeLapse* lapse) {
        const Settings defaults = given_.resolve(1, geometry_.has_value());
        std::vector<Marks> structures;
        for (const GivenMarks& given : problem_.structures) structures.push_back(marks_of(given, defaults));
        if (problem_.painted) {
            const bool one = structures.size() == 1 && structures.front().name.empty();
            add_paint(structures,
                      {std::make_shared<const PaintedImage>(make_painted(*problem_.painted, problem_.painting))});
            if (one && structures.size() > 1)
                throw Error(Errc::InvalidInput,
                            "painted: expected one label, got several; structures() makes a structure of each",
                            "painted");
        }
        if (structures.empty()) throw Error(Errc::InvalidInput, "marks: expected a structure, got none", "marks");
        SegmentOptions requested = defaults.segment;
        if (const auto start = start_of(problem_.init, run_)) requested.start = *start;
        const Settings settings = given_.resolve(voxel_size(structures.front(), requested), geometry_.has_value());
        StructuresOptions options{settings.segment, {settings.contours, settings.cloud, false}};
        options.segment.start = requested.start;
        require_valid(settings, geometry_ ? "segment" : "reconstruct");
        return lapse != nullptr ? lapse->segment(*problem_.image, std::move(structures), options, run_)
                                : segment_structures(problem_.image, std::move(structures), options, run_);
    }

private:
    [[nodiscard]] Marks marks_of(const GivenMarks& given, const Settings& settings) const {
        Marks marks;
        marks.name = safe_text(given.name);
        for (const PointCloud& cloud : given.points) add_points(marks, cloud, geometry_, run_);
        if (!geometry_) thin_points(marks, settings.inputs.max_points, run_);
        for (const PointCloud& lines : given.contours) add_contours(marks, lines, geometry_, run_);
        marks.inside = given.inside;
        marks.outside = given.outside;
        marks.exterior_seeds = given.exterior_seeds;
        marks.start = start_of(given.init, run_);
        if (given.painted) {
            PaintedImage painted = make_painted(*given.painted);
            painted.is_shared = false;
            const int label = painted.labels.front().label;
            marks.paint.push_back({std::make_shared<const PaintedImage>(std::move(painted)), label});
        }
        if (const auto* path = std::get_if<std::string>(&given.guess)) marks.files.guess = *path;
        if (given.guess.index() != 0)
            marks.guess = [this, &shape = given.guess, label = settings.inputs.guess_label](const RunContext& run) {
                if (const auto* path = std::get_if<std::string>(&shape))
                    return read_guess(*path, geometry_, {{}, label, false, {}}, run);
                if (const auto* mask = std::get_if<Image>(&shape)) return make_guess(*mask, label, geometry_);
                return GivenGuess{*start_of(shape, run), std::nullopt};
            };
        return marks;
    }

    [[nodiscard]] double voxel_size(const Marks& marks, const SegmentOptions& requested) const {
        const Length wanted = given_.voxel_size();
        if (wanted.given && !wanted.in_voxels) return wanted.value;
        const VoxelSizeChoice choice = choose_voxel_size(problem_.image, marks, requested);
        run_.info("voxel_size: " + choice.reason);
        return wanted.resolve(choice.voxel_size, choice.voxel_size);
    }

    const Problem& problem_;
    const GivenOptions& given_;
    const RunContext& run_;
    std::optional<ImageGeometry> geometry_;
};

}  // namespace

Solution solve(const Problem& problem, const GivenOptions& given, const Call& call, TimeLapse* lapse) {
    StructuresResult made;
    std::vector<std::string> log;
    call.run([&](const RunContext& run) {
        RunContext noted = run;
        noted.log = [&](LogLevel level, const std::string& line) {
            log.push_back(line);
            if (run.log) run.log(level, line);
        };
        made = Solver(problem, given, noted).solve(lapse);
    });
    Solution solution{{}, std::move(made.overlaps)};
    for (StructureResult& structure : made.structures)
        solution.structures.push_back(std::make_shared<Result>(Result{std::move(structure), problem.image, log}));
    return solution;
}

}  // namespace covol::python
