#include "covol/pipeline.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Morphology.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <sstream>
#include <utility>

#include "covol/compare.h"
#include "covol/distance.h"
#include "covol/error.h"
#include "covol/mesh_io.h"
#include "covol/scan_noise.h"
#include "covol/scan_solid.h"
#include "detail/memory_need.h"
#include "detail/vanished.h"

namespace covol {
namespace {

constexpr double kMergeVoxels = 0.25;         // points closer than this do not move the surface apart
constexpr double kFewPoints = 1000;           // fewer get a voxel size at which their surface has as many voxels as this many would
constexpr double kMarginVoxels = 6.0;         // between D and the domain's boundary, for points alone
constexpr double kTubeSlackVoxels = 2.0;      // the upwind scheme looks one voxel beyond the band
constexpr double kAttractionVoxels = 5.0;     // automatic range of the points after starts other than tagging
// After tagging: measured on brain, spleen and nucleus with 300 points each; see the README's table.
constexpr double kTagDeltaVoxels = 0.5, kTagSigmaVoxels = 2.0, kTagAttractionVoxels = 8.0;
constexpr double kCloseFromVoxels = 5.0;      // a tag distance beyond this starts from the closing instead
constexpr double kApproachTau = 3.0;          // time steps of the points' own approach, in tau
constexpr int kApproachSteps = 40;
constexpr double kApproachTolerance = 0.01;
constexpr double kScanRadiusVoxels = 2.5;     // layers of a scan within it are averaged
constexpr double kNoisyShare = 0.3;           // of a voxel: a layer of points thicker than this is averaged
constexpr double kSolidReach = 3.0;           // voxels of the solid's own grid that its start may lie off the points
constexpr double kHoldDepth = 0.75;           // voxels that the surface may sink below such a start
constexpr int kHoldSteps = 2;
constexpr double kHoldTolerance = 0.01;      // voxels a step
constexpr double kFarFromPoints = 3.0;        // voxels and spacings: no point holds the surface there
constexpr double kWarnWithoutPoints = 0.02;   // share of the area
constexpr int kEdgeReachVoxels = 12;          // a band that follows moves this far before g is extended
constexpr int kBodyReachVoxels = 5;           // the same for a start from contours, which lies close to the end
constexpr double kCoarseFactor = 8.0;         // voxels of the coarse distance field, in h
// Coarse to fine, voxels of the coarse level.
constexpr double kRefinement = 2.0;
constexpr double kLeastCoarseSigma = 0.5;
constexpr double kSidesSigmas = 3.0;          // beside a mark, to tell lines from borders
constexpr std::size_t kFeatureMarks = 4000;   // this many are looked at
constexpr double kLeastCoarseAttraction = 3.0;
constexpr double kCoarseTolerance = 5e-3;
constexpr double kStepBack = 2.0;
constexpr int kLeastCoarsened = 64;           // of h: a smaller domain has little to gain, and thin things to lose
constexpr int kRefinedReachVoxels = 4;        // of h: after a coarse level the surface does not move far

std::string number(double value) {
    std::ostringstream text;
    text << value;
    return text.str();
}

/// Adds the wall-clock time of its life to `seconds`.
class Timed {
public:
    explicit Timed(double& seconds) : seconds_(seconds), begin_(std::chrono::steady_clock::now()) {}
    ~Timed() { seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count(); }
    Timed(const Timed&) = delete;
    Timed& operator=(const Timed&) = delete;

private:
    double& seconds_;
    std::chrono::steady_clock::time_point begin_;
};

openvdb::CoordBBox box_of(const Domain& d) {
    return {openvdb::Coord(d.min[0], d.min[1], d.min[2]), openvdb::Coord(d.max[0], d.max[1], d.max[2])};
}

/// The active voxels of u and all within `voxels` of them, inside the domain; values mean nothing.
FloatGridPtr dilated_topology(const FloatGrid& u, int voxels, const Domain& domain) {
    FloatGridPtr topology = u.deepCopy();
    openvdb::tools::dilateActiveValues(topology->tree(), voxels, openvdb::tools::NN_FACE,
                                       openvdb::tools::EXPAND_TILES);
    topology->clip(box_of(domain));
    return topology;
}

/// Every active voxel of u is active in `field`.
bool covers(const FloatGrid& field, const FloatGrid& u) {
    for (auto leaf = u.tree().cbeginLeaf(); leaf; ++leaf) {
        const auto* known = field.tree().probeConstLeaf(leaf->origin());
        auto missing = leaf->valueMask();
        if (known != nullptr) missing -= known->valueMask();
        if (!missing.isOff()) return false;
    }
    return true;
}

/// Where the way to the surface may be long: tagging and a result of another run end beside it.
bool knows_nothing(Start::Kind kind) { return kind == Start::Kind::Sphere || kind == Start::Kind::Box; }

FloatGridPtr read_level_set(const std::string& path) {
    const FloatGridPtr grid = read_solid(path).level_set;
    if (!grid) throw Error(Errc::InvalidInput, "segment: " + path + ": expected a .vdb file with a level set");
    return grid;
}

/// The main job as a sequence of steps over one result.
class Segmentation {
public:
    Segmentation(const Image* image, const std::vector<Vec3>& points, const SegmentOptions& options,
                 const RunContext& run)
        : image_(image), points_(points), sure_(points), given_(points), options_(options), run_(run) {
        if (options.contours) take_contours(*options.contours);
    }

    SegmentResult go() {
        {
            Timed total(report().seconds.total);
            check_input();
            resolve_lengths();
            if (starts_from_contours())
                start_from_body();
            else if (options_.start.kind == Start::Kind::Tag)
                start_by_tagging();
            else
                start_otherwise();
            if (uses_image()) choose_edge_feature();
            start_from_coarse();
            find_edges();
            find_sure_distance();
            solve();
            make_surface();
        }
        report().resolved = options_;
        return std::move(result_);
    }

private:
    SegmentReport& report() { return result_.report; }
    const SegmentReport& report() const { return result_.report; }
    double h() const { return options_.voxel_size; }
    bool uses_points() const { return options_.evolve.theta > 0; }
    bool uses_image() const { return options_.evolve.rho > 0; }

    void choose(const std::string& what, const std::string& value, const std::string& reason) {
        const std::string line = value + (reason.empty() ? "" : " (" + reason + ")");
        report().automatic[what] = line;
        run_.info(what + ": " + line);
    }

    void take_contours(const Contours& contours) {
        given_.insert(given_.end(), contours.marks.begin(), contours.marks.end());
        sure_.insert(sure_.end(), contours.along.begin(), contours.along.end());
        points_ = sure_;
        points_.insert(points_.end(), contours.between.begin(), contours.between.end());
        report().densified = contours.along.size() + contours.between.size();
    }

    /// What there is decides which terms of Eq. (3) can act.
    void check_input() {
        const std::string why = options_.why_invalid();
        if (!why.empty()) throw Error(Errc::InvalidOptions, "segment: " + why);
        if (image_ == nullptr && points_.empty())
            throw Error(Errc::InvalidInput, "segment: expected an image or points, got neither");
        if (options_.start.kind == Start::Kind::Tag && points_.empty())
            throw Error(Errc::InvalidInput, "segment: the start 'tag' expects points, got none; choose another start "
                                            "(sphere, box, mesh, mask or vdb)");
        report().point_count = given_.size();
        EvolveOptions& evolve = options_.evolve;
        if (points_.empty() && evolve.theta > 0) {
            evolve.theta = 0;
            choose("theta", "0", "there are no points");
        }
        if (image_ == nullptr && evolve.rho > 0) {
            evolve.rho = 0;
            choose("rho", "0", "there is no image");
        }
    }

    void resolve_lengths() {
        if (options_.voxel_size <= 0) {
            const VoxelSizeChoice choice = choose_voxel_size(image_, points_);
            options_.voxel_size = choice.voxel_size;
            choose("voxel_size", number(h()), choice.reason);
        }
        const std::size_t all = points_.size();
        points_ = merge_close_points(points_, kMergeVoxels * h());
        if (points_.size() < all)
            run_.info("points: " + std::to_string(points_.size()) + " of " + std::to_string(all) +
                      " kept, the others are closer than half of " + number(kMergeVoxels * h()));
        marks_ = points_;
        if (image_ == nullptr) average_noise();
        EvolveOptions& evolve = options_.evolve;
        const bool tags = options_.start.kind == Start::Kind::Tag;
        if (evolve.delta < 0) {
            const double voxels = tags ? kTagDeltaVoxels : 1.0;
            choose("delta", number(evolve.delta = voxels * h()), number(voxels) + " voxels");
        }
        if (evolve.tau < 0) choose("tau", number(h()), "1 voxel at unit speed; longer while the surface moves slowly");
        if (options_.edge.sigma < 0 && uses_image()) {
            const double voxels = tags ? kTagSigmaVoxels : 1.0;
            choose("sigma", number(options_.edge.sigma = voxels * h()), number(voxels) + " voxels");
        }
        if (evolve.attraction_range < 0) choose_attraction_range();
        if (evolve.image_yields < 0) {
            evolve.image_yields = tags && uses_points() && uses_image() ? 1.0 : 0.0;
            if (evolve.image_yields > 0) choose("image_yields", "1", "near marks the marks know better than the edges");
        }
    }

    // A thick layer of points, or several beside each other, has its surface in the middle.
    void average_noise() {
        const double radius = kScanRadiusVoxels * h(), thickness = layer_thickness(points_, radius, run_);
        if (!(thickness > kNoisyShare * h())) return;
        points_ = average_layers(points_, radius, run_);
        choose("points_averaged", "within " + number(radius),
               "they lie " + number(thickness) + " from their local plane on the mean, more than " + number(kNoisyShare) + " voxels");
    }

    void choose_attraction_range() {
        has_automatic_range_ = true;
        double& range = options_.evolve.attraction_range;
        range = 0;
        if (!uses_points()) return;
        if (options_.start.kind == Start::Kind::Tag && uses_image()) {
            range = kTagAttractionVoxels * h();
            choose("attraction_range", number(range), number(kTagAttractionVoxels) + " voxels: farther from marks the image decides");
        } else if (options_.start.kind == Start::Kind::Tag) {
            choose("attraction_range", "0", "unlimited: the band around the points bounds it");
        } else {
            range = kAttractionVoxels * h();
            choose("attraction_range", number(range), number(kAttractionVoxels) + " voxels");
        }
    }

    Domain domain_with_margin(double margin) const {
        if (options_.roi) return domain_of_box(*options_.roi, h());
        if (image_ != nullptr) return domain_of_box(image_->geometry().world_box(), h());
        return domain_of_box(bounding_box(points_, margin), h());
    }

    // ---- contours ----------------------------------------------------------------------------------------------

    const ContourSolid* body() const { return options_.contours ? options_.contours->solid.get() : nullptr; }

    /// Tagging where the body cannot be all that there is to start from.
    bool starts_from_contours() {
        if (body() == nullptr || options_.start.kind != Start::Kind::Tag) return false;
        for (const Vec3& seed : options_.exterior_seeds)
            if (body()->level(seed) < 0) return tag_after_all("an exterior seed lies inside the contours");
        const double far = kTagAttractionVoxels * h();
        const std::size_t loose = sure_.size() - options_.contours->along.size();
        for (std::size_t n = 0; n < loose; ++n)
            if (std::abs(body()->level(sure_[n])) > far) return tag_after_all("points lie far from the contours' body");
        choose("start", "contours", "the body between the contours; what inner contours enclose is outside");
        return true;
    }

    bool tag_after_all(const char* reason) {
        choose("start", "tag", reason);
        hole_seeds_ = body()->hole_seeds();
        return false;
    }

    void start_from_body() {
        from_body_ = true;
        options_.evolve.follow = true;
        report().domain = domain_with_margin(options_.margin > 0 ? options_.margin : 2 * kMarginVoxels * h());
        {
            Timed timed(report().seconds.tag);
            result_.u = start_from_contours(report().domain, *body(), run_);
        }
        if (uses_points()) compute_distance(std::max(options_.evolve.attraction_range, kMarginVoxels * h()) + (kHalfWidthVoxels + kTubeSlackVoxels) * h());
    }

    /// Where the image acts, marks outweigh what lies between the slices.
    void find_sure_distance() {
        if (!options_.contours || !uses_points() || !uses_image() || options_.evolve.attraction_range <= 0) return;
        Timed timed(report().seconds.distance);
        sure_distance_ = distance(sure_, report().domain, {options_.evolve.attraction_range + kTubeSlackVoxels * h()}, run_).grid;
    }

    // ---- start -------------------------------------------------------------------------------------------------

    void start_by_tagging() {
        choose_tag();
        if (image_ == nullptr && has_chosen_tag_ && !report().tag.encloses && start_from_solid()) return;
        const double D = options_.tag_distance;
        const double margin = options_.margin > 0 ? options_.margin : D + kMarginVoxels * h();
        report().domain = domain_with_margin(margin);
        compute_distance(D + (kHalfWidthVoxels + kTubeSlackVoxels) * h(), D);
        Timed timed(report().seconds.tag);
        BandResult tagged = band(*result_.distance, {D, seeds_beyond(D)}, run_);
        report().band = tagged.report;
        result_.u = tagged.grid;
        if (tagged.report.leaks) warn_of_leak(tagged.report);
        if (D > kCloseFromVoxels * h()) start_from_closing(D);
        report().tag.tag_distance = D;
    }

    // Nothing is enclosed at any D, as where one side was seen only: the surface of a solid that carries the points.
    bool start_from_solid() {
        Timed timed(report().seconds.tag);
        const ScanSolid solid = solid_from_scan(points_, h(), run_);
        if (!solid.level_set) return false;
        if (has_automatic_range_ && uses_points()) {
            double& range = options_.evolve.attraction_range;
            range = kSolidReach * solid.voxel_size;
            choose("attraction_range", number(range), "the start touches the points, and where there are none nothing should pull");
        }
        const double range = options_.evolve.attraction_range;
        report().domain = domain_with_margin(options_.margin > 0 ? options_.margin : range + kMarginVoxels * h());
        result_.u = start_from_grid(report().domain, *solid.level_set, run_);
        hold_ = result_.u->deepCopy();
        options_.evolve.follow = true;
        choose("start", "solid", "the points enclose nothing; a ball of radius " + number(solid.ball_radius) +
                                     " rolled around them leaves a solid behind " + number(100 * solid.carried) + " % of them, with " +
                                     std::to_string(solid.carved) + " of its hollows opened again");
        if (uses_points()) compute_distance(tube_for_start());
        return true;
    }

    // The tagged surface lies D outside the points, as far as the widest gap is large. Its closing by a ball of radius D
    // touches them, needs a band of a few voxels instead of {d <= D + 3h}, and leaves the flow a short way.
    void start_from_closing(double D) {
        FloatGridPtr closed = closing(*result_.u, D, run_);
        if (!closed) return;
        result_.u = closed;
        options_.evolve.follow = true;
        choose("start", "closing", "of the tagged surface by a ball of radius D, for D is wider than " + number(kCloseFromVoxels) + " voxels");
    }

    void choose_tag() {
        if (options_.tag_distance > 0) return;
        Timed timed(report().seconds.tag);
        // Wide enough for any D below a quarter of the cloud: the final domain is made once D is known.
        const WorldBox box = bounding_box(points_);
        double extent = 0;
        for (int a = 0; a < 3; ++a) extent = std::max(extent, box.max[a] - box.min[a]);
        report().tag = choose_tag_distance(points_, domain_with_margin(0.25 * extent + kMarginVoxels * h()),
                                           all_seeds(), run_);
        options_.tag_distance = report().tag.tag_distance;
        has_chosen_tag_ = true;
        choose("tag_distance", number(options_.tag_distance), report().tag.reason);
    }

    std::vector<Vec3> all_seeds() const {
        std::vector<Vec3> seeds = options_.exterior_seeds;
        seeds.insert(seeds.end(), hole_seeds_.begin(), hole_seeds_.end());
        return seeds;
    }

    /// Holes narrower than D are no exterior; a seed that the user gave is band()'s to judge.
    std::vector<Vec3> seeds_beyond(double D) const {
        std::vector<Vec3> seeds = options_.exterior_seeds;
        const auto d_at = result_.distance->getConstAccessor();
        for (const Vec3& seed : hole_seeds_) {
            const Vec3 at = result_.report.domain.world_to_index(seed);
            if (d_at.getValue(openvdb::Coord::round(openvdb::Vec3d(at[0], at[1], at[2]))) > D) seeds.push_back(seed);
        }
        return seeds;
    }

    void warn_of_leak(const BandReport& tagged) {
        std::string line = "the points leave gaps wider than the tag distance " + number(tagged.tag_distance);
        line += tagged.holding_distance > 0 ? "; it would hold at " + number(tagged.holding_distance)
                                            : "; no tag distance that holds was found";
        run_.warn(line);
    }

    void start_otherwise() {
        options_.evolve.follow = true;
        const double margin = options_.margin > 0 ? options_.margin : 2 * kMarginVoxels * h();
        report().domain = domain_with_margin(margin);
        detail::require_band_memory(known_area(), h(), "segment", run_);
        {
            Timed timed(report().seconds.tag);
            result_.u = start_grid();
        }
        if (uses_points()) compute_distance(tube_for_start());
    }

    /// Of the start, where it is known before it is made; else 0.
    double known_area() const {
        const Start& start = options_.start;
        Vec3 side;
        for (int a = 0; a < 3; ++a) side[a] = start.box.max[a] - start.box.min[a];
        if (start.kind == Start::Kind::Sphere) return 4 * std::numbers::pi * start.radius * start.radius;
        return start.kind == Start::Kind::Box ? 2 * (side[0] * side[1] + side[1] * side[2] + side[2] * side[0]) : 0.0;
    }

    FloatGridPtr start_grid() const {
        const Domain& domain = result_.report.domain;
        const Start& start = options_.start;
        switch (start.kind) {
            case Start::Kind::Sphere: return start_from_sphere(domain, start.center, start.radius);
            case Start::Kind::Box: return start_from_box(domain, start.box);
            case Start::Kind::Mesh: return start_from_mesh(domain, read_mesh(start.path), run_);
            case Start::Kind::Mask: return start_from_mask(domain, read_image(start.path, {}, run_), run_);
            case Start::Kind::Vdb: return start_from_grid(domain, start.level_set ? *start.level_set : *read_level_set(start.path), run_);
            case Start::Kind::Tag: break;
        }
        throw Error(Errc::InvalidOptions, "segment: this start makes no grid of its own");
    }

    /// Beyond the attraction range d is not needed. Without one it must reach from the start to the points: the
    /// surface moves down d, so the largest d on the start bounds what it meets.
    double tube_for_start() {
        const double slack = (kHalfWidthVoxels + kTubeSlackVoxels) * h();
        if (options_.evolve.attraction_range > 0) return options_.evolve.attraction_range + slack;
        Domain coarse = domain_of_box(report().domain.world_box(), kCoarseFactor * h());
        const WorldBox box = bounding_box(points_);
        double diagonal = 0;
        for (int a = 0; a < 3; ++a) {
            const WorldBox all = report().domain.world_box();
            const double side = std::max(all.max[a], box.max[a]) - std::min(all.min[a], box.min[a]);
            diagonal += side * side;
        }
        const FloatGridPtr d = distance(points_, coarse, {std::sqrt(diagonal)}, run_).grid;
        double largest = 0;
        const auto d_at = d->getConstAccessor();
        for (auto leaf = result_.u->tree().cbeginLeaf(); leaf; ++leaf) {
            const openvdb::Coord center = leaf->origin().offsetBy(4);
            const openvdb::Vec3d where = d->worldToIndex(result_.u->indexToWorld(center));
            largest = std::max(largest, double(d_at.getValue(openvdb::Coord::round(where))));
        }
        const double radius = largest + kCoarseFactor * h() + slack;
        choose("distance_tube", number(radius), "the attraction is unlimited: it covers the way from the start");
        return radius;
    }

    /// @param reach  the part of the radius that does not depend on h
    void compute_distance(double radius, double reach = 0) {
        Timed timed(report().seconds.distance);
        detail::require_tube_memory(points_, report().domain, {reach, (radius - reach) / h(), true}, "segment", run_);
        result_.distance = distance(points_, report().domain, {radius}, run_).grid;
    }

    // ---- coarse to fine ----------------------------------------------------------------------------------------

    // The way from the start is long in voxels of h. In voxels of 2h a step costs a quarter and goes twice as far; what is
    // left to do at h is near the surface that the coarse level finds.
    void start_from_coarse() {
        if (options_.coarse_levels < 0) options_.coarse_levels = knows_nothing(options_.start.kind) && is_large() ? 1 : 0;
        if (options_.coarse_levels == 0 || hold_ || from_body_) return;
        SegmentOptions options = options_;
        options.voxel_size = kRefinement * h();
        options.coarse_levels = options_.coarse_levels - 1;
        options.contours = nullptr;  // their points are among the others
        const double coarse_h = options.voxel_size;
        options.edge.sigma = std::max(options.edge.sigma, kLeastCoarseSigma * coarse_h);
        EvolveOptions& evolve = options.evolve;
        evolve.follow = true;
        evolve.tolerance = std::max(evolve.tolerance, kCoarseTolerance);
        if (evolve.tau > 0) evolve.tau *= kRefinement;
        if (evolve.attraction_range > 0)
            evolve.attraction_range = std::max(evolve.attraction_range, kLeastCoarseAttraction * coarse_h);
        Segmentation coarse(image_, points_, options, run_);
        const std::string why_not = coarse.run_coarse(*result_.u, report().domain);
        report().seconds.coarse += coarse.report().seconds.total;
        report().coarse = coarse.report().coarse;
        report().coarse.push_back({coarse_h, coarse.report().solve.steps, coarse.report().active_voxels, why_not});
        if (!why_not.empty()) {
            run_.info("coarse level " + number(coarse_h) + " left out: " + why_not);
            return;
        }
        Timed timed(report().seconds.coarse);
        uncoarsened_ = result_.u;
        uncoarsened_edge_ = options_.edge;
        result_.u = start_from_grid(report().domain, *coarse.result_.u, run_);
        options_.evolve.follow = true;
    }

    [[nodiscard]] bool is_large() const {
        const Domain& d = result_.report.domain;
        int least = d.max[0] - d.min[0];
        for (int a = 1; a < 3; ++a) least = std::min(least, d.max[a] - d.min[a]);
        return least >= kLeastCoarsened;
    }

    /// The flow from `start`, a level set on a finer lattice. @return empty, or why its result is of no use
    std::string run_coarse(const FloatGrid& start, const Domain& fine) {
        Timed total(report().seconds.total);
        report().domain = domain_of_box(fine.world_box(), h());
        try {
            result_.u = start_from_grid(report().domain, start, run_);
        } catch (const Error& error) {
            if (error.code() != Errc::InvalidInput) throw;
            return "nothing of the start is left on so coarse a lattice";
        }
        const FloatGridPtr before = result_.u->deepCopy();
        if (uses_points()) compute_distance(tube_for_coarse());
        start_from_coarse();
        find_edges();
        flow();
        if (report().solve.stop_reason == StopReason::Vanished) return "the surface vanished there";
        if (options_.start.kind != Start::Kind::Tag) step_back(*before);
        return {};
    }

    double tube_for_coarse() {
        const double slack = (kHalfWidthVoxels + kTubeSlackVoxels) * h();
        if (options_.start.kind == Start::Kind::Tag) return options_.tag_distance + slack;
        return tube_for_start();
    }

    // Two edges closer than a few coarse voxels are one there: the fine level comes from the same side as the start would.
    void step_back(const FloatGrid& start) {
        const auto back = static_cast<float>(kStepBack * h());
        const auto start_at = start.getConstAccessor();
        for (auto v = result_.u->beginValueOn(); v; ++v)
            v.setValue(std::clamp(start_at.getValue(v.getCoord()), *v - back, *v + back));
    }

    // ---- fields and flow ---------------------------------------------------------------------------------------

    // The marks of contours tell what the border looks like in this image.
    void choose_edge_feature() {
        EdgeOptions& edge = options_.edge;
        if (edge.feature != EdgeFeature::Automatic || body() == nullptr) return;
        std::vector<Vec3> places, normals;
        const std::vector<Vec3>& along = options_.contours->along;
        const std::size_t stride = 1 + along.size() / kFeatureMarks;
        for (std::size_t n = 0; n < along.size(); n += stride) {
            Vec3 normal;
            for (int a = 0; a < 3; ++a) {
                Vec3 low = along[n], high = along[n];
                low[a] -= 0.5 * h();
                high[a] += 0.5 * h();
                normal[a] = body()->level(high) - body()->level(low);
            }
            const double length = std::hypot(normal[0], normal[1], normal[2]);
            if (!(length > 0)) continue;
            for (double& component : normal) component /= length;
            places.push_back(along[n]);
            normals.push_back(normal);
        }
        const MarkedFeature found = feature_at(*image_, places, normals, kSidesSigmas * std::max(edge.sigma, h()));
        edge.feature = found.feature;
        const bool is_line = found.feature != EdgeFeature::Slope;
        choose("edge_feature", to_string(found.feature),
               is_line ? "at the marks the image is " + number(std::abs(found.line)) + (found.line > 0 ? " brighter" : " darker") +
                             " than on both sides, which differ by " + number(2 * std::abs(found.step))
                       : "no line runs along the marks");
    }

    void find_edges() {
        if (!uses_image()) return;
        Timed timed(report().seconds.edge);
        const FloatGridPtr reach =
            options_.evolve.follow ? dilated_topology(*result_.u, edge_reach(), report().domain) : result_.u;
        EdgeResult found = edge(*image_, *reach, options_.edge, run_);
        report().edge = found.report;
        result_.edge = found.grid;
        const EdgeReport& e = found.report;
        if (options_.edge.edge_k <= 0 && options_.edge.edge_contrast <= 0)
            choose("edge_k", number(e.edge_k), std::string("g = 1/2 at a ") + (options_.edge.feature <= EdgeFeature::Slope ? "gradient" : "brightness") + " of " + number(e.edge_contrast));
        if (options_.edge.low == options_.edge.high)
            choose("intensities", number(e.low) + " to " + number(e.high), "mapped to 0 and 1, percentiles");
        // Fixed from here on: a band that moves must not change the meaning of g.
        options_.edge.edge_k = e.edge_k;
        options_.edge.edge_contrast = 0;
        options_.edge.low = e.low;
        options_.edge.high = e.high;
    }

    [[nodiscard]] int edge_reach() const { return uncoarsened_ ? kRefinedReachVoxels : from_body_ ? kBodyReachVoxels : kEdgeReachVoxels; }

    void extend(const FloatGrid& u, EvolveFields& fields) {
        if (fields.edge == nullptr || covers(*fields.edge, u)) return;
        Timed timed(report().seconds.edge);
        result_.edge = edge(*image_, *dilated_topology(u, edge_reach(), report().domain), options_.edge, run_).grid;
        fields.edge = result_.edge.get();
    }

    void solve() {
        flow();
        if (uncoarsened_ && report().solve.stop_reason == StopReason::Vanished) {
            report().coarse.back().why_not = "the surface vanished after it";
            run_.info("coarse level left out: " + report().coarse.back().why_not);
            result_.u = std::exchange(uncoarsened_, nullptr);
            options_.edge = uncoarsened_edge_;
            find_edges();
            flow();
        }
        run_.check();
        result_.u->setName("u");
        const EvolveReport& solved = report().solve;
        if (solved.stop_reason == StopReason::Vanished)
            throw Error(Errc::InvalidInput, "segment: the surface vanished after " + std::to_string(solved.steps) + " steps: " +
                                                why_vanished());
        if (solved.stop_reason == StopReason::MaxSteps)
            run_.warn("not steady after " + std::to_string(solved.steps) + " steps: the last change was " +
                      number(solved.last_change) + " voxels");
    }

    std::string why_vanished() const {
        if (options_.start.kind == Start::Kind::Tag && !from_body_) {
            const bool encloses = has_chosen_tag_ ? report().tag.encloses : !report().band.leaks;
            if (image_ == nullptr) return detail::why_nothing_held(points_, options_.tag_distance, encloses);
            if (!encloses)
                return "the points enclose nothing and nothing held it; where the structure is cut off by the image's end mark the cut "
                       "too, or give a --tag-distance beyond its radius; or draw --contours, or choose another start (--init)";
        }
        return "nothing held it; lower --delta, or start closer to the edges (--init)";
    }

    void flow() {
        EvolveFields fields;
        fields.distance = uses_points() ? result_.distance.get() : nullptr;
        fields.edge = result_.edge.get();
        fields.sure = sure_distance_.get();
        if (options_.evolve.follow) fields.extend = [this](const FloatGrid& u, EvolveFields& f) { extend(u, f); };
        {
            Timed timed(report().seconds.solve);
            const double edge_before = report().seconds.edge;
            EvolveReport& solved = report().solve;
            const EvolveReport before = approach(fields);
            if (before.stop_reason == StopReason::Vanished) {
                solved = before;
            } else {
                solved = hold_ ? evolve_held(fields) : evolve(*result_.u, fields, options_.evolve, run_);
                add(before, solved);
            }
            report().seconds.solve -= report().seconds.edge - edge_before;
        }
        report().active_voxels = report().solve.active_voxels;
        report().leaf_count = report().solve.leaf_count;
    }

    // Where a scan has no points its surface rests on nothing, and would slide along the walls that have some: it may not sink
    // deeper below the solid that it started from than a share of a voxel.
    EvolveReport evolve_held(const EvolveFields& fields) {
        EvolveReport total;
        EvolveOptions few = options_.evolve;
        for (int left = options_.evolve.max_steps; left > 0 && total.stop_reason != StopReason::Vanished; left -= kHoldSteps) {
            const FloatGridPtr before = result_.u->deepCopy();
            few.max_steps = std::min(left, kHoldSteps);
            EvolveReport round = evolve(*result_.u, fields, few, run_);
            hold_up(*result_.u);
            add(total, round);
            total = round;
            total.last_change = mean_motion(*before, *result_.u) / few.max_steps;
            if (total.stop_reason != StopReason::Vanished && total.last_change < kHoldTolerance) {
                total.stop_reason = StopReason::Steady;
                break;
            }
        }
        return total;
    }

    void hold_up(FloatGrid& u) const {
        const auto start = hold_->getConstAccessor();
        const auto depth = static_cast<float>(kHoldDepth * h());
        for (auto leaf = u.tree().beginLeaf(); leaf; ++leaf)
            for (auto value = leaf->beginValueOn(); value; ++value)
                value.setValue(std::min(*value, start.getValue(value.getCoord()) + depth));
    }

    /// Of u, over the voxels beside the surface, voxels.
    double mean_motion(const FloatGrid& before, const FloatGrid& after) const {
        const auto old = before.getConstAccessor();
        double sum = 0;
        std::int64_t count = 0;
        for (auto leaf = after.tree().cbeginLeaf(); leaf; ++leaf)
            for (auto value = leaf->cbeginValueOn(); value; ++value)
                if (std::abs(*value) < h()) {
                    sum += std::abs(*value - old.getValue(value.getCoord()));
                    ++count;
                }
        return count > 0 ? sum / (double(count) * h()) : 0.0;
    }

    // Edges of other structures lie between the tagged surface and the points: with an image the points pull alone first.
    EvolveReport approach(EvolveFields fields) {
        if (from_body_ || options_.start.kind != Start::Kind::Tag || uncoarsened_ || !uses_points() || !uses_image()) return {};
        EvolveOptions alone = options_.evolve;
        alone.rho = 0;
        alone.attraction_range = 0;
        alone.image_yields = 0;
        if (options_.evolve.follow) alone.tau = kApproachTau * (alone.tau < 0 ? h() : alone.tau);
        alone.max_steps = std::min(alone.max_steps, kApproachSteps);
        alone.tolerance = std::max(alone.tolerance, kApproachTolerance);
        fields.edge = nullptr;
        fields.extend = nullptr;
        return evolve(*result_.u, fields, alone, run_);
    }

    static void add(const EvolveReport& before, EvolveReport& total) {
        const double sweeps = before.sweeps_per_step * before.steps + total.sweeps_per_step * total.steps;
        total.steps += before.steps;
        total.sweeps_per_step = total.steps > 0 ? sweeps / total.steps : 0.0;
        total.leaf_visits += before.leaf_visits;
        total.leaf_visits_saved += before.leaf_visits_saved;
        total.seconds_assembly += before.seconds_assembly;
        total.seconds_sweeps += before.seconds_sweeps;
    }

    void make_surface() {
        Timed timed(report().seconds.surface);
        result_.surface = surface(*result_.u, run_);
        result_.mesh = extract_mesh(*result_.surface, options_.extract, run_);
        report().surface = measure(result_.mesh);
        if (points_.empty()) return;
        // Most of the fit is the making of a search tree, on one thread.
        double reach = 0;
        tbb::parallel_invoke([&] { report().fit = points_to_surface(options_.contours ? given_ : marks_, result_.mesh, run_); },
                             [&] { if (image_ == nullptr) reach = find_bare_surface(); });
        if (report().share_without_points > kWarnWithoutPoints)
            run_.warn(number(std::round(1000 * report().share_without_points) / 10) + " % of the surface lie farther than " +
                      number(reach) + " from every point: there curvature alone closes it");
    }

    /// @return what counts as far
    double find_bare_surface() {
        RunContext quiet;  // beside another task nothing may be reported
        quiet.threads = run_.threads;
        quiet.cancel = run_.cancel;
        const double reach = kFarFromPoints * std::max(h(), nearest_neighbour_spacing(points_).median);
        report().share_without_points = share_without_points(result_.mesh, points_, reach, quiet);
        return reach;
    }

    const Image* image_;
    std::vector<Vec3> points_;  ///< all that attract
    std::vector<Vec3> sure_;    ///< those of them that are no guess between slices
    std::vector<Vec3> given_;   ///< as the caller has them
    std::vector<Vec3> marks_;   ///< without contours: the same without duplicates, for the fit
    std::vector<Vec3> hole_seeds_;
    bool from_body_ = false;
    FloatGridPtr sure_distance_;
    FloatGridPtr hold_;         ///< the start that the surface may not leave, or null
    bool has_automatic_range_ = false, has_chosen_tag_ = false;
    SegmentOptions options_;
    const RunContext& run_;
    SegmentResult result_;
    FloatGridPtr uncoarsened_;  ///< the start, where u comes from a coarse level instead
    EdgeOptions uncoarsened_edge_;
};

}  // namespace

EvolveOptions SegmentOptions::automatic_evolve() {
    EvolveOptions options;
    options.attraction_range = -1;
    options.image_yields = -1;
    return options;
}

std::string SegmentOptions::why_invalid() const {
    std::string why;
    const auto expect = [&](bool ok, const char* field, const char* expected, double got) {
        if (!ok) why += std::string(why.empty() ? "" : "\n") + field + ": expected " + expected + ", got " + number(got);
    };
    expect(std::isfinite(voxel_size) && voxel_size >= 0, "voxel_size", ">= 0", voxel_size);
    expect(std::isfinite(margin) && margin >= 0, "margin", ">= 0", margin);
    expect(std::isfinite(tag_distance) && tag_distance >= 0, "tag_distance", ">= 0", tag_distance);
    if (start.kind == Start::Kind::Sphere)
        expect(std::isfinite(start.radius) && start.radius > 0, "start.radius", "> 0", start.radius);
    if (roi)
        for (int a = 0; a < 3; ++a)
            expect(roi->max[a] > roi->min[a], "roi", "min < max along each axis", roi->max[a] - roi->min[a]);
    EvolveOptions chosen = evolve;
    if (chosen.attraction_range == -1) chosen.attraction_range = 0;  // automatic
    if (chosen.image_yields == -1) chosen.image_yields = 0;
    for (const std::string& part : {edge.why_invalid(), chosen.why_invalid()})
        if (!part.empty()) why += (why.empty() ? "" : "\n") + part;
    return why;
}

VoxelSizeChoice choose_voxel_size(const Image* image, const std::vector<Vec3>& world_points) {
    if (image != nullptr) {
        const Vec3& spacing = image->geometry().spacing;
        return {*std::min_element(spacing.begin(), spacing.end()), "the image's smallest spacing"};
    }
    const std::vector<Vec3> distinct = merge_close_points(world_points, 0);
    if (distinct.size() < 2)
        throw Error(Errc::InvalidInput, "choose_voxel_size: expected an image or at least 2 distinct points, got " +
                                            std::to_string(distinct.size()));
    const double spacing = nearest_neighbour_spacing(distinct).median;
    const ScanVoxelSize scan = scan_voxel_size(distinct, spacing);
    if (scan.voxel_size <= spacing) {
        // A surface of few points is so few spacings wide that in voxels as large as they are curvature would outweigh them.
        const double finer = std::sqrt(double(distinct.size()) / kFewPoints);
        if (finer >= 1) return {spacing, "the median distance between neighbouring points"};
        return {finer * spacing, "finer than the median distance between neighbouring points, " + number(spacing) + ", for there are few"};
    }
    return {scan.voxel_size, "points lie " + number(scan.thickness) + " from their local plane on the mean, noise wider than their median distance " +
                                 number(spacing)};
}

SegmentResult segment(const Image* image, const std::vector<Vec3>& world_points, const SegmentOptions& options,
                      const RunContext& run) {
    SegmentResult result;
    with_threads(run, [&] { result = Segmentation(image, world_points, options, run).go(); });
    return result;
}

}  // namespace covol
