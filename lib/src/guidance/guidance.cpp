// Image guidance: finds between the marks the border with the same intensity profile as at the marks.
#include "covol/guidance.h"

#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>

#include "base/heuristics.h"
#include "covol/domain.h"
#include "covol/guess.h"
#include "covol/start.h"
#include "covol/surface.h"
#include "guess/heuristics.h"
#include "guidance/grid_sampler.h"
#include "guidance/heuristics.h"
#include "guidance/learning.h"
#include "guidance/wide_distance.h"
#include "mesh/triangle.h"
#include "points/kd_tree.h"
#include "redistance/redistance.h"
#include "surface/pieces.h"

namespace covol {
namespace {

using namespace guidance;

constexpr std::array<double, 3> kSigmas{0.5, 1.0, 2.0};  // voxels, of the image's smoothing

double squared(double x) { return x * x; }

/// Moves a surface step by step from the guess to the border.
class Guide {
public:
    /// @param guess  the initial surface: a signed distance, clamped to the narrow band
    Guide(FloatGridPtr guess, const std::vector<Vec3>& marks, const Image& image, const GuidanceOptions& options,
          GuidanceReport& report, const RunContext& run)
        : marks_(marks),
          image_(image),
          options_(options),
          report_(report),
          run_(run),
          domain_(domain_of(*guess)),
          h_(domain_.voxel_size),
          surface_(std::move(guess)) {}

    /// One iteration. Returns false, with the reason in the report, if the image is not usable.
    bool step(bool first) {
        run_.check();
        cut_surface();
        distance_.emplace(*surface_, patches_.places, domain_, profile_reach(), run_);
        if (first) start_ = distance_->grid();
        if (!place_marks(first)) return false;
        set_ranges();
        const Scene scene{patches_, *distance_->grid(), domain_, ranges_};
        if (!learn(scene, first)) return false;
        run_.check();
        query(scene);
        run_.check();
        weigh(first);
        run_.check();
        move();
        return true;
    }
    [[nodiscard]] const FloatGridPtr& surface() const { return surface_; }

private:
    void cut_surface();
    bool place_marks(bool first);
    void set_ranges();
    bool learn(const Scene& scene, bool first);
    void query(const Scene& scene);
    void weigh(bool first);
    void move();

    struct ValidationResult {
        double prior2, error2, response, slope2;
        std::vector<double> off2;  // by mark: squared difference between mark and offset, world units^2
    };
    [[nodiscard]] ValidationResult cross_validate(const OffsetField& field, double prior) const;
    [[nodiscard]] std::vector<double> local_error2(const ValidationResult& validation) const;
    [[nodiscard]] double mean(const std::vector<double>& by_patch) const {
        double sum = 0;
        for (std::size_t i = 0; i < by_patch.size(); ++i) sum += patches_.area[i] * by_patch[i];
        return sum / area_;
    }

    const std::vector<Vec3>& marks_;
    const Image& image_;
    const GuidanceOptions& options_;
    GuidanceReport& report_;
    const RunContext& run_;
    Domain domain_;
    double h_;
    FloatGridPtr surface_;
    FloatGridPtr start_;                    // the signed distance to the guess in a wide band
    std::optional<WideDistance> distance_;  // the signed distance to surface_ in a wide band

    // about the guess:
    double guess2_ = 0;  // squared error of the guess at the marks, world units^2
    double misfit_ = 0;  // 0: the errors of the marks explain their distances from the guess; 1: they do not
    double prior_ = 0;   // prior standard deviation of the offsets, chosen in the first iteration
    double sigma_ = 0;

    // about this iteration, by patch:
    Patches patches_;
    double area_ = 0, size_ = 0, spacing_ = 0, width_ = 0;
    std::vector<double> to_mark_, home_, offset_;
    std::vector<int> ranges_;
    double broad_ = 0;  // standard deviation of the guess, estimated from the distances to the marks alone
    std::vector<OffsetEvidence> evidence_, held_out_;
    std::vector<std::size_t> nearest_;

    std::vector<PatchMark> on_;  // the marks near the surface, combined by patch
    double mark2_ = 0;           // mean variance of the positions in on_
    std::optional<SmoothImage> smooth_;
    std::optional<LearntProfile> learnt_;
};

void Guide::cut_surface() {
    const TriangleMesh mesh = extract_mesh(*surface_, {}, run_);
    SurfaceVertices vertices = vertices_of(mesh, kGuide.patch_width);
    const auto place = [&](std::uint32_t v) { return vertices.places[v]; };
    const Vec3 origin = mesh.empty() ? Vec3{} : place(mesh.triangles.front()[0]);
    double volume = 0;
    for (const auto& t : mesh.triangles)
        volume += meshing::six_volumes({place(t[0]), place(t[1]), place(t[2])}, origin) / 6;
    area_ = std::accumulate(vertices.area.begin(), vertices.area.end(), 0.0);
    size_ = 3 * std::abs(volume) / area_;  // the radius if the body is a ball
    const detail::KdTree tree(marks_);
    const auto cut = [&](double width) {
        width_ = width;
        patches_ = cut_patches(vertices, image_.geometry(), width);
        to_mark_.resize(patches_.size());
        tbb::parallel_for(std::size_t(0), patches_.size(),
                          [&](std::size_t i) { to_mark_[i] = std::sqrt(tree.nearest(patches_.centers[i])); });
        // If points are spread randomly with a mean density of one in an area of s^2, the mean distance to the nearest
        // is s / 2.
        spacing_ = std::max(2 * mean(to_mark_), 2 * h_);
    };
    cut(kGuide.patch_width * h_);
    if (spacing_ > kGuide.patches_per_spacing * width_) cut(spacing_ / kGuide.patches_per_spacing);
    find_borders(std::move(vertices), patches_);
}

bool Guide::place_marks(bool first) {
    std::vector<std::size_t> patch(marks_.size());
    std::vector<double> residual(marks_.size());
    tbb::parallel_for(std::size_t(0), marks_.size(), [&](std::size_t m) {
        double nearest = std::numeric_limits<double>::infinity();
        for (std::size_t i = 0; i < patches_.size(); ++i) {
            const double to = detail::squared_distance(patches_.centers[i], marks_[m]);
            if (to < nearest) {
                nearest = to;
                patch[m] = i;
            }
        }
        residual[m] = GridSampler(*distance_->grid(), domain_)(marks_[m]);
    });
    // The marks of one patch are combined. Marks farther than kGuide.farthest voxels from the surface belong to another
    // one, and are ignored.
    std::map<std::size_t, std::vector<std::size_t>> by_patch;
    for (std::size_t m = 0; m < marks_.size(); ++m)
        if (std::abs(residual[m]) < kGuide.farthest * h_) by_patch[patch[m]].push_back(m);
    on_.clear();
    const std::size_t every = by_patch.size() / kMarks.whole + 1;
    std::size_t count = 0;
    for (const auto& [i, members] : by_patch) {
        if (count++ % every != 0) continue;
        PatchMark mark;
        mark.patch = i;
        const double fraction = 1.0 / double(members.size());
        for (const std::size_t m : members) {
            mark.residual += fraction * residual[m];
            for (int a = 0; a < 3; ++a) mark.at[a] += fraction * marks_[m][a];
        }
        const double width = options_.mark_precision ? *options_.mark_precision / kUniformDeviation : patches_.voxel[i];
        mark.deviation = width * std::sqrt(fraction / 12);  // of the mean of uniform errors
        on_.push_back(mark);
    }
    if (on_.size() < kCommon.ring) {
        report_.reason =
            "only " + std::to_string(on_.size()) +
            " positions on the guess have marks near them, too few to learn how the image looks at the border";
        return false;
    }
    double residual2 = 0;
    mark2_ = 0;
    for (const PatchMark& mark : on_) {
        residual2 += squared(mark.residual) / double(on_.size());
        mark2_ += squared(mark.deviation) / double(on_.size());
    }
    mark2_ = std::max(mark2_, squared(0.05 * h_));
    if (first) {
        // If the guess follows the errors of the marks in part, the residuals are smaller than these errors, and the
        // difference is negative.
        guess2_ = std::max(std::abs(residual2 - mark2_), 0.1 * mark2_);
        misfit_ = std::clamp((residual2 - mark2_) / mark2_, 0.0, 1.0);
    }
    return true;
}

void Guide::set_ranges() {
    const std::size_t count = patches_.size();
    home_.assign(count, 0.0);
    std::vector<double> reach(count), broad2(count);
    tbb::parallel_for(std::size_t(0), count, [&](std::size_t i) {
        GridSampler to_start(*start_, domain_);
        for (std::uint32_t n = patches_.first[i]; n < patches_.first[i + 1]; ++n)
            home_[i] -= to_start(patches_.places[patches_.members[n]]) / (patches_.first[i + 1] - patches_.first[i]);
        reach[i] = std::min(0.5 * to_mark_[i] + 2 * patches_.voxel[i], kGuide.farthest * h_);
        broad2[i] = squared(0.5 * reach[i]);
    });
    broad_ = std::sqrt(mean(broad2));
    if (options_.range) broad_ = std::min(broad_, 0.5 * *options_.range);
    ranges_.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
        // At least twice the deviation of the whole guess is searched, also at marks, where the guess is more accurate.
        double range = std::max(reach[i], 2 * broad_);
        if (options_.range) range = std::min(range, *options_.range);
        range = std::min(range + std::abs(home_[i]), kGuide.farthest * h_);
        ranges_[i] = int(std::ceil(range * kStepsPerVoxel / patches_.voxel[i]));
    }
}

bool Guide::learn(const Scene& scene, bool first) {
    WorldBox box{patches_.places.front(), patches_.places.front()};
    for (const Vec3& x : patches_.places)
        for (int a = 0; a < 3; ++a) {
            box.min[a] = std::min(box.min[a], x[a]);
            box.max[a] = std::max(box.max[a], x[a]);
        }
    for (int a = 0; a < 3; ++a) {
        box.min[a] -= profile_reach() * h_;
        box.max[a] += profile_reach() * h_;
    }
    learnt_.reset();
    const auto try_sigma = [&](double sigma) {
        SmoothImage image(image_, box, sigma, run_);
        if (image.empty()) return;
        LearntProfile lesson(scene, on_, image, std::sqrt(guess2_), broad_, 2 * width_);
        if (learnt_ && lesson.sure_gain() <= learnt_->sure_gain()) return;
        sigma_ = sigma;
        learnt_.emplace(std::move(lesson));
        smooth_.emplace(std::move(image));
    };
    if (first)
        for (const double sigma : kSigmas) try_sigma(sigma * h_);
    else
        try_sigma(sigma_);
    if (!learnt_) {
        report_.reason = "the guess lies outside of the image";
        return false;
    }
    std::vector<Vec3> places, normals;
    for (const PatchMark& mark : on_) {
        places.push_back(mark.at);
        normals.push_back(patches_.directions[mark.patch]);
    }
    report_.feature = detect_feature(image_, places, normals, kHalfWidthVoxels * h_);
    report_.inside = learnt_->brightness(-2 * kStepsPerVoxel);
    report_.border = learnt_->brightness(0);
    report_.outside = learnt_->brightness(2 * kStepsPerVoxel);
    if (!(learnt_->sure_gain() > 0)) {
        report_.reason = "the image at some marks does not predict where the others lie";
        return false;
    }
    report_.sigma = sigma_;
    report_.local = learnt_->local();
    report_.gain = learnt_->gain();
    return true;
}

void Guide::query(const Scene& scene) {
    const std::size_t count = patches_.size();
    evidence_.assign(count, {});
    held_out_.assign(count, {});
    nearest_.resize(count);
    tbb::parallel_for(std::size_t(0), count, [&](std::size_t i) {
        LearntProfile::ProfileEvidence answer = learnt_->query(scene, i, *smooth_);
        evidence_[i] = std::move(answer.all);
        held_out_[i] = std::move(answer.held_out);
        nearest_[i] = answer.nearest;
    });
}

/// Cross-validates the image: computes the offsets at each mark from a profile that was learnt without this mark, for a
/// guess whose standard deviation is `prior` everywhere. Returns the squared error at the marks, increased by a
/// standard error; as `response` the fraction of a wave in the guess, with a wavelength of two spacings, that the image
/// removes; and as `slope2` the square of the offsets' growth with the distance from the marks, reduced by a standard
/// error.
Guide::ValidationResult Guide::cross_validate(const OffsetField& field, double prior) const {
    const std::size_t count = patches_.size();
    const std::vector<double> none(count, 0.0), deviation(count, prior);
    std::vector<double> wave(count);
    for (std::size_t i = 0; i < count; ++i) {
        const Vec3& x = patches_.centers[i];
        wave[i] = std::cos(M_PI / spacing_ * (x[0] + x[1] + x[2]) / std::sqrt(3.0));
    }
    const OffsetField::Fit fit = field.fit(home_, deviation, held_out_, none, none, &wave);

    const double marks = double(on_.size());
    double off2 = 0, off4 = 0;
    std::vector<double> each;
    for (const PatchMark& mark : on_) {
        each.push_back(squared(fit.offset[mark.patch] - mark.residual));
        off2 += each.back() / marks;
        off4 += squared(each.back()) / marks;
    }
    const double error = std::sqrt(std::max(off4 - squared(off2), 0.0) / marks);
    const double error2 = std::max(off2 + error - mark2_, mark2_ * std::sqrt(2 / marks));

    double kept = 0, waves = 0, distance4 = 0;
    std::vector<double> slopes(on_.size(), 0.0);
    for (std::size_t i = 0; i < count; ++i) {
        kept += patches_.area[i] * fit.carried[i] * wave[i];
        waves += patches_.area[i] * squared(wave[i]);
        const double weight = patches_.area[i] * squared(to_mark_[i]);
        distance4 += weight * squared(to_mark_[i]);
        slopes[nearest_[i]] += weight * (squared(fit.offset[i] - home_[i]) - guess2_ - error2);
    }
    double slope2 = 0, spread2 = 0;
    for (const double s : slopes) slope2 += s;
    for (const double s : slopes) spread2 += squared(s - slope2 / marks);
    slope2 = std::max(slope2 - std::sqrt(spread2), 0.0) / distance4;
    return {squared(prior), error2, std::clamp(1 - kept / waves, 0.01, 1.0), slope2, std::move(each)};
}

/// The image's squared error by patch: the mean of the squared errors at nearby marks and of the mean at all marks,
/// which has the weight of kGuide.belief marks.
std::vector<double> Guide::local_error2(const ValidationResult& validation) const {
    const double all = validation.error2 + mark2_;
    std::vector<double> result(patches_.size());
    tbb::parallel_for(std::size_t(0), result.size(), [&](std::size_t i) {
        double sum = kGuide.belief * all, total = kGuide.belief;
        for (std::size_t n = 0; n < on_.size(); ++n) {
            const double weight =
                std::exp(-0.5 * detail::squared_distance(on_[n].at, patches_.centers[i]) / squared(spacing_));
            sum += weight * validation.off2[n];
            total += weight;
        }
        result[i] = std::max(sum / total - mark2_, mark2_ * std::sqrt(2 / total));
    });
    return result;
}

/// Computes offset_ of each patch as a mean of guess and image, weighted by the inverse of their squared errors.
void Guide::weigh(bool first) {
    const std::size_t count = patches_.size();
    const OffsetField field(patches_, std::max(spacing_, 4 * h_));
    std::vector<double> distance2(count), min2(count), max2(count, std::numeric_limits<double>::infinity());
    for (std::size_t i = 0; i < count; ++i) {
        distance2[i] = squared(to_mark_[i]);
        const double sagitta = distance2[i] / (2 * size_);
        min2[i] = squared(kGuide.fraction_of_sagitta * sagitta);
        if (options_.range) max2[i] = squared(std::min(sagitta, 0.5 * *options_.range));
    }
    std::vector<ValidationResult> validations;
    if (first) {
        constexpr int kPriors = 4;  // number of prior deviations that are tried; each is half of the one before
        for (int n = 0; n < kPriors; ++n) validations.push_back(cross_validate(field, broad_ * std::pow(0.5, n)));
    } else {
        validations.push_back(cross_validate(field, prior_));
    }
    double slope2 = 0;
    for (const ValidationResult& w : validations) slope2 = std::max(slope2, w.slope2);
    if (options_.error_slope) slope2 = std::min(slope2, squared(*options_.error_slope));
    double needed2 = guess2_ + std::max(slope2 * mean(distance2), mean(min2));
    if (options_.range) needed2 = std::min(needed2, guess2_ + mean(max2));
    ValidationResult chosen = validations.front();
    for (const ValidationResult& w : validations)
        if (w.prior2 >= needed2 && w.error2 / squared(w.response) < chosen.error2 / squared(chosen.response))
            chosen = w;
    prior_ = std::sqrt(chosen.prior2);

    std::vector<double> guess2(count), deviation(count), zero(count, 0.0);
    for (std::size_t i = 0; i < count; ++i)
        guess2[i] = guess2_ + std::min(std::max(slope2 * distance2[i], min2[i]), max2[i]);
    const double mean2 = mean(guess2);
    const std::vector<double> error2 = local_error2(chosen);
    for (std::size_t i = 0; i < count; ++i)
        deviation[i] = prior_ * std::sqrt((chosen.error2 + guess2[i]) / (chosen.error2 + mean2));
    const OffsetField::Fit fit = field.fit(home_, deviation, evidence_, zero, zero, nullptr);

    offset_.resize(count);
    std::vector<double> left(count), sure(count, 0.0);
    for (std::size_t i = 0; i < count; ++i) {
        const double both = squared(chosen.response) * guess2[i] + error2[i];
        const double fraction = options_.weight * std::min(chosen.response * guess2[i] / both, 1.0);
        offset_[i] = home_[i] + fraction * (fit.offset[i] - home_[i]);
        left[i] = std::sqrt(guess2[i] * error2[i] / both);
        if (fit.precision[i] * squared(deviation[i]) > 1 && fraction > 0.5) sure[i] = 1;
    }
    if (misfit_ > 0) {
        // A guess that does not pass through its marks, such as the result of another tool, is moved towards them.
        std::vector<double> rest(count, 0.0), precision(count, 0.0);
        for (const PatchMark& mark : on_) {
            rest[mark.patch] = mark.residual - offset_[mark.patch];
            precision[mark.patch] = misfit_ / (squared(mark.deviation) + squared(0.1 * h_));
        }
        const OffsetField::Fit to_marks =
            field.fit(zero, left, std::vector<OffsetEvidence>(count), rest, precision, nullptr);
        for (std::size_t i = 0; i < count; ++i) offset_[i] += options_.weight * to_marks.offset[i];
    }
    report_.image_error = std::sqrt(chosen.error2);
    report_.guess_error = std::sqrt(mean2);
    report_.confident_fraction = mean(sure);
    std::vector<double> whole(count);
    report_.max_offset = 0;
    for (std::size_t i = 0; i < count; ++i) {
        whole[i] = offset_[i] - home_[i];
        report_.max_offset = std::max(report_.max_offset, std::abs(whole[i]));
    }
    report_.mean_offset = mean(whole);
}

/// Moves the surface: the offset of the nearest vertex is subtracted from the distance, which is then recomputed.
void Guide::move() {
    const FloatGridPtr moved = distance_->less(on_vertices(patches_, width_, offset_));
    detail::drop_unmarked_pieces(*moved, marks_);
    surface_ = detail::redistance(*moved, domain_, kHalfWidthVoxels, detail::DomainEnd::Closed, "guess", run_);
}

}  // namespace

Guided guide(const FloatGrid& guess, const std::vector<Vec3>& marks, const Image& image, const GuidanceOptions& options,
             const RunContext& run) {
    require_valid(options, "guide");
    Guided guided;
    auto& [result, report] = guided;
    with_threads(run, [&, &result = result, &report = report] {
        result = start_from_grid(domain_of(guess), guess, run);
        if (marks.empty() || !(options.weight > 0) || options.range == 0.0) {
            report.reason = marks.empty() ? "there are no marks to learn the border from" : "the image has no weight";
            return;
        }
        Guide surface(result, marks, image, options, report, run);
        int done = 0;
        while (done < kGuide.iterations && surface.step(done == 0))
            run.report("image guidance", double(++done) / kGuide.iterations);
        report.used = done > 0;
        if (report.used) {
            report.reason.clear();
            result = start_from_grid(domain_of(guess), *surface.surface(), run);
        }
        run.report("image guidance", 1);
    });
    return guided;
}

}  // namespace covol
