// Converts marks as given to the input of segment(), once the voxel size is known.
#include <chrono>
#include <cmath>
#include <map>
#include <set>

#include "base/number.h"
#include "covol/error.h"
#include "covol/marks.h"
#include "covol/seeds.h"
#include "covol/structures.h"
#include "marks/with_name.h"

namespace covol {
namespace {

/// The content of painted images. Each image is analysed when it is first needed.
class PaintReader {
public:
    PaintReader(const std::optional<ImageGeometry>& image, bool force) : image_(image), force_(force) {}

    const Painted& of(const PaintedImage& given, const RunContext& run) {
        const auto known = images_.find(&given);
        if (known != images_.end()) return known->second;
        if (!image_) throw Error(Errc::InvalidInput, "expected the image that the painted labels belong to, got none");
        const std::string who = given.image.path().empty() ? "painted" : given.image.path();
        Painted painted = understand_painted(placed_on(given.image, *image_, force_), given.labels, given.options, run);
        for (const PaintedLabel& label : painted.labels) run.info(who + ": " + label.summary);
        if (const int outside = given.options.outside_label; outside != 0)
            run.info(who + ": label " + std::to_string(outside) + ": outside of every structure");
        return images_.emplace(&given, std::move(painted)).first->second;
    }

    const PaintedLabel& label_of(const Marks::Paint& paint, const RunContext& run) {
        for (const PaintedLabel& label : of(*paint.image, run).labels)
            if (label.label == paint.label) return label;
        throw Error(Errc::InvalidInput, paint.image->image.path() + ": expected painted voxels of label " +
                                            std::to_string(paint.label) + ", got none");
    }

private:
    const std::optional<ImageGeometry>& image_;
    bool force_;
    std::map<const PaintedImage*, Painted> images_;
};

/// Rejects a tag distance, half of the widest gap between points that is closed, above the diagonal of the points' box,
/// because no enclosed position is that far from all points.
void check_tag_distance(double tag_distance, const std::vector<Vec3>& points) {
    if (points.empty()) return;
    const WorldBox box = bounding_box(points);
    const double diagonal = std::hypot(box.max[0] - box.min[0], box.max[1] - box.min[1], box.max[2] - box.min[2]);
    if (tag_distance > diagonal)
        throw Error(Errc::InvalidOptions,
                    "`tag_distance`: expected at most the diagonal of the points' bounding box, " +
                        detail::number(diagonal) + ", got " + detail::number(tag_distance) +
                        ": no enclosed position is that far from the points",
                    "tag_distance");
}

/// Makes the StructureInput of one structure after the other.
class Preparer {
public:
    Preparer(std::vector<Marks> structures, const std::optional<ImageGeometry>& image, const SegmentOptions& options,
             const MarksOptions& marks_options)
        : structures_(std::move(structures)),
          image_(image),
          options_(options),
          marks_options_(marks_options),
          paint_(image, marks_options.force_geometry) {
        marks_options_.contours.step = options.voxel_size.value();
    }

    StructureInput prepare(std::size_t n, const std::string& grid, const RunContext& run) {
        Marks& marks = structures_[n];
        StructureInput input;
        static_cast<MarksOrigin&>(input) = marks;
        input.grid = grid;
        input.options = options_;
        const std::shared_ptr<const Contours> painted = own_contours(marks, run);
        if (!painted) add_outlines(marks, run);
        clean(marks, input, run);
        input.marks = marks.points;
        const std::shared_ptr<const Contours> contours = painted ? painted : join_contours(marks, input, run);
        if (contours) input.marks.insert(input.marks.end(), contours->marks.begin(), contours->marks.end());
        const bool is_network = contours && contours->is_network;
        if (!is_network) input.options.contours = contours;
        if (painted) input.count = input.marks.size();
        check_tag_distance(options_.tag_distance.value_or(0), input.marks);
        for (const Marks::Paint& paint : marks.paint)
            input.paint.emplace_back(paint.image->image.path(), paint_.label_of(paint, run));
        input.options.inside = collect("`inside`", marks.inside, run);
        input.options.outside = collect("`outside`", marks.outside, run);
        add_paint_as_seeds(n, input.options, run);
        if (is_network) add_network(*contours, marks, input.options);
        input.options.exterior_seeds.insert(input.options.exterior_seeds.end(), marks.exterior_seeds.begin(),
                                            marks.exterior_seeds.end());
        input.options.hints = std::move(marks.hints);
        if (marks.start) input.options.start = *marks.start;
        if (!input.options.evolve.delta) input.options.evolve.delta = marks.delta;
        input.points = std::move(marks.points);
        input.guess = std::move(marks.guess);
        return input;
    }

private:
    [[nodiscard]] double h() const { return marks_options_.contours.step; }

    /// Adds contours in planes of several directions: their lines as marks, and positions inside and outside of their
    /// sections as seeds.
    static void add_network(const Contours& network, Marks& marks, SegmentOptions& options) {
        const auto append = [](std::vector<Vec3>& list, const std::vector<Vec3>& more) {
            list.insert(list.end(), more.begin(), more.end());
        };
        // Only if there are no other points, because these have no normals, but the list must contain one for each
        // mark.
        if (marks.points.empty()) {
            marks.hints.normals = network.outward;
            marks.hints.is_outward = true;
            options.sections = network.sections;
        }
        append(marks.points, network.along);
        append(options.inside, network.inside);
        append(options.outside, network.outside);
        if (!marks.hints.normals.empty()) marks.hints.normals.resize(marks.points.size(), Vec3{0, 0, 0});
        if (!marks.hints.to_sensor.empty()) marks.hints.to_sensor.resize(marks.points.size());
    }

    /// The contours of the only painted label, on the lattice of its image. Null if no label is painted, if there are
    /// further painted labels or contours, which need a common lattice, or if all paint of the label is scribbles.
    std::shared_ptr<const Contours> own_contours(const Marks& marks, const RunContext& run) {
        if (marks.paint.size() != 1 || !marks.contours.empty()) return nullptr;
        const PaintedLabel& label = paint_.label_of(marks.paint.front(), run);
        if (label.views.empty()) return nullptr;
        const ImageGeometry& lattice = paint_.of(*marks.paint.front().image, run).geometry;
        auto contours = std::make_shared<Contours>(connect_outlines(label, lattice, h(), run));
        run.info("painted: " + contours->summary);
        return contours;
    }

    /// Adds the outlines of painted labels in world coordinates, to be combined with other contours.
    void add_outlines(Marks& marks, const RunContext& run) {
        for (const Marks::Paint& paint : marks.paint)
            for (const PaintedView& view : paint_.label_of(paint, run).views) {
                PointCloud outlines = view.outlines;
                outlines.points = to_world(outlines, paint_.of(*paint.image, run).geometry);
                outlines.space = PointSpace::World;
                marks.contours.push_back(std::move(outlines));
            }
    }

    void clean(Marks& marks, StructureInput& input, const RunContext& run) const {
        if (!marks_options_.cleanup.any()) return;
        std::vector<Vec3> cleaned = clean_cloud(marks.points, marks_options_.cleanup, run, &input.cleanup.emplace());
        if (cleaned != marks.points) marks.hints = carried(marks.hints, marks.points, cleaned);
        marks.points = std::move(cleaned);
    }

    std::shared_ptr<const Contours> join_contours(const Marks& marks, StructureInput& input,
                                                  const RunContext& run) const {
        if (marks.contours.empty()) return nullptr;
        const auto begin = std::chrono::steady_clock::now();
        auto contours =
            std::make_shared<Contours>(image_ ? densify(marks.contours, *image_, marks_options_.contours, run)
                                              : densify(marks.contours, marks_options_.contours, run));
        run.info("contours: " + contours->summary);
        for (const PointCloud& lines : marks.contours) input.contour_rules.push_back(lines.rule);
        input.contour_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
        return contours;
    }

    std::vector<Vec3> collect(const char* side, const std::vector<PointCloud>& clouds, const RunContext& run) const {
        std::vector<Vec3> seeds;
        for (const PointCloud& cloud : clouds) {
            if (image_) check_inside(cloud, *image_, run);
            const std::vector<Vec3> found = image_ ? collect_seeds(cloud, *image_, h()) : collect_seeds(cloud, h());
            seeds.insert(seeds.end(), found.begin(), found.end());
            if (!cloud.rule.empty())
                run.info(side + (" " + cloud.source) + ": " + std::to_string(found.size()) + " seeds, " + cloud.rule);
        }
        return seeds;
    }

    /// Adds the paint of the structure itself as seeds inside, and the paint of the other structures as seeds outside.
    void add_paint_as_seeds(std::size_t own, SegmentOptions& options, const RunContext& run) {
        const std::size_t given = options.inside.size() + options.outside.size();
        std::set<const PaintedImage*> images;
        for (std::size_t n = 0; n < structures_.size(); ++n)
            for (const Marks::Paint& paint : structures_[n].paint) {
                if (n != own && !paint.image->is_shared) continue;
                const std::vector<Vec3>& seeds = paint_.label_of(paint, run).inside;
                std::vector<Vec3>& side = n == own ? options.inside : options.outside;
                side.insert(side.end(), seeds.begin(), seeds.end());
            }
        for (const Marks& marks : structures_)
            for (const Marks::Paint& paint : marks.paint)
                if (images.insert(paint.image.get()).second) {
                    const std::vector<Vec3>& outside = paint_.of(*paint.image, run).outside;
                    options.outside.insert(options.outside.end(), outside.begin(), outside.end());
                }
        options.painted_seeds = options.inside.size() + options.outside.size() - given;
    }

    std::vector<Marks> structures_;
    const std::optional<ImageGeometry>& image_;
    const SegmentOptions& options_;
    MarksOptions marks_options_;
    PaintReader paint_;
};

}  // namespace

std::vector<StructureInput> prepare_marks(std::vector<Marks> structures, const std::optional<ImageGeometry>& image,
                                          const SegmentOptions& options, const MarksOptions& marks_options,
                                          const RunContext& run) {
    std::vector<std::string> names;
    for (const Marks& marks : structures) names.push_back(marks.name);
    std::set<std::string> unique(names.begin(), names.end());
    if (names.empty()) throw Error(Errc::InvalidInput, "structures: expected at least one, got none");
    if (unique.size() < names.size() || (names.size() > 1 && unique.contains("")))
        throw Error(Errc::InvalidInput, "expected a unique name for each of several structures");
    number_labels(structures);
    const std::vector<std::string> grids = make_grid_names(names);
    Preparer preparer(std::move(structures), image, options, marks_options);
    std::vector<StructureInput> prepared;
    for (std::size_t n = 0; n < names.size(); ++n)
        prepared.push_back(detail::with_name(
            names[n], [&] { return preparer.prepare(n, grids[n], speaking_for(names[n], names.size(), run)); }));
    return prepared;
}

}  // namespace covol
