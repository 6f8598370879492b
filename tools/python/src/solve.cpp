#include "solve.h"

#include <algorithm>
#include <limits>

#include "covol/error.h"
#include "covol/painted.h"
#include "covol/seeds.h"
#include "flags/one_label.h"
#include "flags/world_points.h"

namespace covol::python {
namespace {

std::vector<Vec3> taken(const std::vector<Vec3>& list, const std::vector<std::uint32_t>& which) {
    std::vector<Vec3> result;
    if (list.empty()) return result;
    result.reserve(which.size());
    for (const std::uint32_t n : which) result.push_back(list[n]);
    return result;
}

/// Points without an image: sorted in space, and no more than asked for.
void thin(tool::WorldPoints& all, std::size_t most) {
    const std::vector<std::uint32_t> used =
        order_spatially(all.points, most > 0 ? most : std::numeric_limits<std::size_t>::max());
    all.points = taken(all.points, used);
    all.hints.normals = taken(all.hints.normals, used);
    all.hints.to_sensor = taken(all.hints.to_sensor, used);
}

/// The only label that is painted, or the wanted one.
LabelName choose_label(const char* option, const Image& labels, int wanted) {
    const std::vector<LabelName> all = find_painted_labels(labels);
    std::string list;
    for (const LabelName& label : all) {
        if (label.label == wanted || (wanted == 0 && all.size() == 1)) return label;
        list += (list.empty() ? "" : ", ") + std::to_string(label.label);
    }
    throw Error(Errc::InvalidInput,
                std::string(option) + ": expected one label" + (wanted > 0 ? ", " + std::to_string(wanted) : "") +
                    ", got " + list,
                option);
}

class Solver {
public:
    Solver(const std::optional<Image>& image, const Marks& marks, const GivenOptions& given, const RunContext& run)
        : image_(image), marks_(marks), given_(given), run_(run), out_(std::make_shared<Result>()) {
        if (image_) {
            geometry_ = &image_->geometry();
            out_->image = *image_;
        }
    }

    std::shared_ptr<Result> solve() {
        for (const PointCloud& cloud : marks_.points) tool::add_cloud(cloud, geometry_, world_, run_);
        if (!image_) thin(world_, given_.resolve(1, false).inputs.most_points);
        drawn_ = marks_.contours;
        for (const PointCloud& lines : drawn_)
            if (geometry_ != nullptr) check_inside(lines, *geometry_, run_);
        const double h = voxel_size();
        settings_ = given_.resolve(h, image_.has_value());
        require_valid(settings_, image_ ? "segment" : "reconstruct");
        SegmentOptions& options = settings_.segment;
        read_paint(h);
        clean();
        densify_contours();
        options.hints = world_.hints;
        add_seeds(marks_.inside, h, options.inside);
        add_seeds(marks_.outside, h, options.outside);
        if (const auto start = start_of(marks_.init, "init")) options.start = *start;
        read_guess();
        out_->result =
            image_ ? segment(*image_, world_.points, options, run_) : reconstruct(world_.points, options, run_);
        return out_;
    }

private:
    [[nodiscard]] double voxel_size() const {
        const Length wanted = given_.voxel_size();
        if (wanted.given && !wanted.in_voxels) return wanted.value;
        std::vector<Vec3> all = world_.points;
        for (const PointCloud& lines : drawn_) {
            const std::vector<Vec3> world = to_world_of(lines);
            all.insert(all.end(), world.begin(), world.end());
        }
        SegmentOptions asked = given_.resolve(1, image_.has_value()).segment;
        if (const auto start = start_of(marks_.init, "init")) asked.start = *start;
        const VoxelSizeChoice choice =
            image_ ? choose_voxel_size(*image_) : choose_voxel_size(all, !drawn_.empty() || asked.tags_points());
        run_.info("voxel_size: " + choice.reason);
        return wanted.resolve(choice.voxel_size, choice.voxel_size);
    }

    [[nodiscard]] std::vector<Vec3> to_world_of(const PointCloud& cloud) const {
        return geometry_ != nullptr ? to_world(cloud, *geometry_) : to_world(cloud);
    }

    void clean() {
        if (settings_.cloud.any()) {
            std::vector<Vec3> cleaned = clean_cloud(world_.points, settings_.cloud, run_);
            if (cleaned.empty() && !world_.points.empty())
                throw Error(Errc::InvalidInput, "clean_cloud: no point is left");
            world_.hints = carried(world_.hints, world_.points, cleaned);
            world_.points = std::move(cleaned);
        }
        out_->marks = world_.points;
    }

    /// Outlines of painted slices are contours, other paint is seeds.
    void read_paint(double h) {
        if (!marks_.painted) return;
        const Image labels = placed_on(*marks_.painted, *geometry_);
        const LabelName label = choose_label("painted", labels, 0);
        const Painted painted = understand_painted(labels, {label}, {}, run_);
        const PaintedLabel& paint = painted.labels.front();
        run_.info("painted: " + paint.summary);
        std::vector<Vec3>& inside = painted_inside_;
        inside = paint.inside;
        if (!paint.views.empty() && drawn_.empty()) {
            contours_ = std::make_shared<Contours>(connect_outlines(paint, painted.geometry, h, run_));
            return;
        }
        for (const PaintedView& view : paint.views) {
            PointCloud outlines = view.outlines;
            outlines.points = to_world(outlines, painted.geometry);
            outlines.space = PointSpace::World;
            drawn_.push_back(std::move(outlines));
        }
    }

    void densify_contours() {
        if (!contours_ && !drawn_.empty())
            contours_ =
                std::make_shared<Contours>(geometry_ != nullptr ? densify(drawn_, *geometry_, settings_.contours, run_)
                                                                : densify(drawn_, settings_.contours, run_));
        settings_.segment.inside = painted_inside_;
        settings_.segment.contours = contours_;
        if (!contours_) return;
        run_.info("contours: " + contours_->summary);
        out_->marks.insert(out_->marks.end(), contours_->marks.begin(), contours_->marks.end());
    }

    void add_seeds(const std::vector<PointCloud>& clouds, double h, std::vector<Vec3>& seeds) const {
        for (const PointCloud& cloud : clouds) {
            if (geometry_ != nullptr) check_inside(cloud, *geometry_, run_);
            const std::vector<Vec3> found =
                geometry_ != nullptr ? collect_seeds(cloud, *geometry_, h) : collect_seeds(cloud, h);
            seeds.insert(seeds.end(), found.begin(), found.end());
        }
    }

    static std::optional<Start> start_of(const Shape& shape, const char* option) {
        Start start;
        if (const auto* text = std::get_if<std::string>(&shape)) return tool::parse_start(option, *text);
        if (const auto* level_set = std::get_if<LevelSet>(&shape)) {
            start.kind = Start::Kind::Vdb;
            start.level_set = level_set->grid;
            return start;
        }
        if (const auto* mask = std::get_if<Image>(&shape)) {
            start.kind = Start::Kind::Mask;
            start.mask = std::make_shared<const Image>(*mask);
            return start;
        }
        return std::nullopt;
    }

    void read_guess() {
        settings_.segment.guess = start_of(marks_.guess, "guess");
        const auto* mask = std::get_if<Image>(&marks_.guess);
        if (mask == nullptr) return;
        const Image labels = geometry_ != nullptr ? placed_on(*mask, *geometry_) : *mask;
        out_->label = choose_label("guess", labels, settings_.inputs.guess_label).label;
        out_->guess_mask = labels;
        settings_.segment.guess->mask = std::make_shared<const Image>(tool::only(labels, out_->label));
    }

    const std::optional<Image>& image_;
    const Marks& marks_;
    const GivenOptions& given_;
    const RunContext& run_;
    std::shared_ptr<Result> out_;
    const ImageGeometry* geometry_ = nullptr;
    Settings settings_;
    tool::WorldPoints world_;
    std::vector<PointCloud> drawn_;
    std::vector<Vec3> painted_inside_;
    std::shared_ptr<const Contours> contours_;
};

}  // namespace

std::shared_ptr<Result> solve(const std::optional<Image>& image, const Marks& marks, const GivenOptions& given,
                              const Call& call) {
    std::shared_ptr<Result> result;
    std::vector<std::string> log;
    call.run([&](const RunContext& run) {
        RunContext noted = run;
        noted.log = [&](LogLevel level, const std::string& line) {
            log.push_back(line);
            if (run.log) run.log(level, line);
        };
        Solver solver(image, marks, given, noted);
        result = solver.solve();
    });
    result->log = std::move(log);
    return result;
}

}  // namespace covol::python
