// Transfers a surface from one image of a time-lapse to the next.
#include "covol/motion.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tree/LeafManager.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "base/heuristics.h"
#include "base/median.h"
#include "covol/domain.h"
#include "covol/start.h"
#include "covol/surface.h"
#include "guidance/heuristics.h"
#include "guidance/learning.h"
#include "guidance/wide_distance.h"
#include "redistance/redistance.h"

namespace covol {
namespace {

using namespace guidance;

constexpr int kStepsOfSample = kStepsPerVoxel / 2;
constexpr int kParts = 8;  // offsets are compared at multiples of 1 / kParts of a step
// [voxels] The smallest difference between offsets that are compared, and the smallest step in the search for a
// translation.
constexpr double kFinest = 1.0 / (kStepsPerVoxel * kParts);
// [of the variance of intensity] Minimum noise. Between equal images, the measured noise, by which is divided, is 0.
constexpr double kMinNoise = 1e-6;

/// [voxels] Maximum movement of a part of the surface relative to the whole. It is smaller than that of the whole,
/// which accounts for most of the movement of each part.
double part_range() { return 0.5 * kGuide.farthest; }

/// The mean intensity over the vertices of a patch at each step along their normals, outward from the patch.
class Template {
public:
    Template() = default;
    explicit Template(const PatchProfile& profile) : lo_(profile.lo) {
        if (profile.empty()) return;
        values_.assign(std::size_t(profile.steps()), 0.0);
        for (int row = 0; row < profile.rows; ++row)
            for (std::size_t s = 0; s < values_.size(); ++s)
                values_[s] += double(profile.values[std::size_t(row) * values_.size() + s]) / profile.rows;
    }
    [[nodiscard]] bool has(int step) const { return step >= lo_ && step < lo_ + int(values_.size()); }
    [[nodiscard]] double at(int step) const { return values_[std::size_t(step - lo_)]; }
    void scale(double gain, double base) {
        for (double& v : values_) v = gain * v + base;
    }

private:
    int lo_ = 0;
    std::vector<double> values_;
};

/// Means, deviations and correlation of two variables.
class Moments {
public:
    void add(double x, double y) {
        ++count_;
        const double dx = x - x_, dy = y - y_;
        x_ += dx / count_;
        y_ += dy / count_;
        xx_ += dx * (x - x_);
        yy_ += dy * (y - y_);
        xy_ += dx * (y - y_);
    }
    void add(const Moments& other) {
        if (other.count_ == 0) return;
        const double all = count_ + other.count_, dx = other.x_ - x_, dy = other.y_ - y_;
        const double cross = count_ * other.count_ / all;
        xx_ += other.xx_ + dx * dx * cross;
        yy_ += other.yy_ + dy * dy * cross;
        xy_ += other.xy_ + dx * dy * cross;
        x_ += dx * other.count_ / all;
        y_ += dy * other.count_ / all;
        count_ = all;
    }
    [[nodiscard]] double count() const { return count_; }
    [[nodiscard]] double mean_x() const { return x_; }
    [[nodiscard]] double mean_y() const { return y_; }
    [[nodiscard]] double deviation_x() const { return count_ > 0 ? std::sqrt(xx_ / count_) : 0; }
    [[nodiscard]] double deviation_y() const { return count_ > 0 ? std::sqrt(yy_ / count_) : 0; }
    [[nodiscard]] double correlation() const { return xx_ > 0 && yy_ > 0 ? xy_ / std::sqrt(xx_ * yy_) : 0; }

private:
    double count_ = 0, x_ = 0, y_ = 0, xx_ = 0, yy_ = 0, xy_ = 0;
};

}  // namespace

/// The data of a surface that are computed once for all images to which it is transferred.
struct SurfaceTemplate::Data {
    FloatGridPtr given;
    double h = 1;
    Domain domain;         ///< that of `given`, with a margin for the movement
    FloatGridPtr surface;  ///< the surface as a start in this domain
    Patches patches;
    std::optional<WideDistance> distance;
    std::vector<int> window, range;   ///< by patch, steps: maximum depth that is compared, maximum movement
    std::vector<Template> templates;  ///< by patch, over window + range steps to either side

    Data(FloatGridPtr level_set, const Image& image, const RunContext& run);
    [[nodiscard]] WorldBox box(double around) const { return bounding_box(patches.places, around); }
    /// @param shift  from positions on the surface to positions in the image
    [[nodiscard]] Template read(std::size_t i, const SmoothImage& image, const Vec3& shift) const {
        return Template(
            read_profile({patches, *distance->grid(), domain, range, shift}, i, window[i] + range[i], image));
    }
};

SurfaceTemplate::Data::Data(FloatGridPtr level_set, const Image& image, const RunContext& run)
    : given(std::move(level_set)),
      h(given->voxelSize()[0]),
      domain(widened(domain_of(*given), int(std::ceil(kGuide.farthest)))),
      surface(start_from_grid(domain, *given, run)) {
    SurfaceVertices vertices = vertices_of(extract_mesh(*surface, {}, run), kGuide.patch_width);
    patches = cut_patches(vertices, image.geometry(), kGuide.patch_width * h);
    find_borders(std::move(vertices), patches);
    distance.emplace(*surface, patches.places, domain, profile_reach(), run);
    for (const double voxel : patches.voxel) {
        window.push_back(int(std::ceil(kHalfWidthVoxels * h * kStepsPerVoxel / voxel)));
        range.push_back(int(std::ceil(part_range() * h * kStepsPerVoxel / voxel)));
    }
    const SmoothImage smooth(image, box(profile_reach() * h), h, run);
    templates.resize(patches.size());
    tbb::parallel_for(std::size_t(0), patches.size(), [&](std::size_t i) { templates[i] = read(i, smooth, {}); });
}

namespace {

/// A level set in a wide band, moved by `part` voxels (at most half a voxel) along each axis.
FloatGridPtr moved_by(const FloatGrid& level, const Vec3& part) {
    FloatGridPtr result = level.deepCopy();
    if (part == Vec3{0, 0, 0}) return result;
    const openvdb::Vec3d back(part[0], part[1], part[2]);
    using Leaves = openvdb::tree::LeafManager<FloatGrid::TreeType>;
    Leaves(result->tree()).foreach ([&](FloatGrid::TreeType::LeafNodeType& leaf, std::size_t) {
        const auto values = level.getConstAccessor();
        for (auto value = leaf.beginValueOn(); value; ++value)
            value.setValue(openvdb::tools::QuadraticSampler::sample(values, value.getCoord().asVec3d() - back));
    });
    return result;
}

/// Computes the movement of a surface from its image to another one.
class Motion {
public:
    Motion(const SurfaceTemplate::Data& known, const Image& image, const RunContext& run)
        : known_(known),
          patches_(known.patches),
          h_(known.h),
          run_(run),
          image_(image, known.box((profile_reach() + kGuide.farthest) * known.h), known.h, run) {}

    Followed follow() {
        translate();
        match();
        return moved();
    }

private:
    /// Mean squared differences between a patch's template and the new image, by offset.
    struct Mismatch {
        int first = 0;  ///< offset to which squares[0] belongs, steps
        std::vector<double> squares;
        double minimum = std::numeric_limits<double>::infinity();  ///< over all offsets that for_each_offset() visits
        /// Calls visit(offset, square) at fractions of a step, with parabolic interpolation between steps.
        template <typename Visit>
        void for_each_offset(const Visit& visit) const {
            for (std::size_t n = 0; n < squares.size(); ++n) {
                const bool is_end = n == 0 || n + 1 == squares.size();
                const double below = squares[is_end ? n : n - 1], here = squares[n],
                             above = squares[is_end ? n : n + 1];
                for (int part = 1 - kParts / 2; part <= kParts / 2; ++part) {
                    const double x = double(part) / kParts;
                    visit(first + double(n) + x,
                          std::max(here + 0.5 * x * (above - below) + 0.5 * x * x * (above + below - 2 * here), 0.0));
                }
            }
        }
    };

    /// The offset of one patch, estimated without the others.
    struct Estimate {
        double offset = 0, variance = 0;  ///< world units; variance 0: the offset is unknown
    };

    void translate();
    [[nodiscard]] double mismatch(const Vec3& shift) const;
    void match();
    void fit(const OffsetField& field, const std::vector<double>& measured, const std::vector<double>& precision);
    [[nodiscard]] std::vector<Template> read_now();
    template <typename Pair>
    bool for_each_pair(std::size_t i, const Template& later, int offset, const Pair& pair) const;
    [[nodiscard]] std::vector<Mismatch> compare(const std::vector<Template>& later) const;
    [[nodiscard]] std::vector<Estimate> estimates(const std::vector<Mismatch>& mismatches, double noise) const;
    [[nodiscard]] double radius() const;
    [[nodiscard]] Followed moved() const;

    const SurfaceTemplate::Data& known_;
    const Patches& patches_;
    double h_;
    const RunContext& run_;
    SmoothImage image_;
    Vec3 translation_{0, 0, 0};
    std::vector<double> offset_;  // of each patch along its normal, world units
    Moments both_;                // intensities in the previous and the new image, along the whole surface
};

/// 1 - correlation of the templates with the shifted new image.
double Motion::mismatch(const Vec3& shift) const {
    const std::size_t every = patches_.size() / kCommon.sample + 1;
    std::vector<Moments> of_patch(patches_.size() / every + 1);
    std::vector<double> samples(of_patch.size(), 0.0);
    tbb::parallel_for(std::size_t(0), of_patch.size(), [&](std::size_t n) {
        const std::size_t i = n * every;
        if (i >= patches_.size()) return;
        const Template& known = known_.templates[i];
        const double step = patches_.voxel[i] / kStepsPerVoxel;
        const Vec3 &center = patches_.centers[i], &normal = patches_.directions[i];
        const SmoothImage::Line line = image_.along({center[0] + shift[0], center[1] + shift[1], center[2] + shift[2]},
                                                    {step * normal[0], step * normal[1], step * normal[2]});
        for (int s = -known_.window[i]; s <= known_.window[i]; s += kStepsOfSample) {
            if (!known.has(s)) continue;
            ++samples[n];
            float value = 0;
            if (line.sample(s, value)) of_patch[n].add(known.at(s), double(value));
        }
    });
    Moments all;
    double expected = 0;
    for (std::size_t n = 0; n < of_patch.size(); ++n) {
        all.add(of_patch[n]);
        expected += samples[n];
    }
    // A shift by which most samples leave the image is rejected: the result is the maximum of 1 - correlation.
    return 2 * all.count() < expected ? 2.0 : 1 - all.correlation();
}

/// Searches the translation with the smallest mismatch() by a pattern search (Hooke and Jeeves, J. ACM 8(2), 1961),
/// with steps from half of the maximum movement down to a fraction of a voxel.
void Motion::translate() {
    double best = mismatch(translation_);
    const double standing = best;
    const double maximum = kGuide.farthest * h_;
    for (double step = 0.5 * maximum; step >= kFinest * h_; step *= 0.5)
        for (bool moved = true; moved;) {
            moved = false;
            Vec3 to = translation_;
            for (int n = 0; n < 27; ++n) {
                const Vec3 tried{translation_[0] + (n % 3 - 1) * step, translation_[1] + (n / 3 % 3 - 1) * step,
                                 translation_[2] + (n / 9 - 1) * step};
                if (*std::max_element(tried.begin(), tried.end()) > maximum ||
                    *std::min_element(tried.begin(), tried.end()) < -maximum)
                    continue;
                const double now = mismatch(tried);
                if (now >= best) continue;
                best = now;
                to = tried;
                moved = true;
            }
            translation_ = to;
            run_.check();
        }
    // A small gain may result from noise alone; the translation is then not used.
    if (!(best < (1 - kCommon.minority) * standing)) translation_ = {0, 0, 0};
}

/// Matches in several passes: an estimated offset is a few percent too small, because the image between the old and
/// the new surface does not resemble the image at either of them.
void Motion::match() {
    offset_.assign(patches_.size(), 0.0);
    const OffsetField field(patches_, std::max(kTimeLapse.alike * radius(), 4 * h_));
    const std::vector<Mismatch> of_itself = compare(known_.templates);
    for (int pass = 0; pass < kGuide.iterations; ++pass) {
        const std::vector<Mismatch> now = compare(read_now());
        std::vector<double> minimum;
        for (const Mismatch& m : now)
            if (!m.squares.empty()) minimum.push_back(m.minimum);
        const double spread = both_.deviation_x();
        if (minimum.empty() || !(spread > 0)) return;
        const double noise = std::max(cloud::median(minimum), kMinNoise * spread * spread);
        const std::vector<Estimate> seen = estimates(now, noise);
        // If intensity changes on one side of a patch only, its estimated offset is biased towards the other side, even
        // if it has not moved. The estimate for the unmoved template is this bias.
        const std::vector<Estimate> unmoved = estimates(of_itself, noise);
        std::vector<double> measured(offset_), precision(offset_.size(), 0.0);
        for (std::size_t i = 0; i < measured.size(); ++i) {
            measured[i] += seen[i].offset - unmoved[i].offset;
            precision[i] = seen[i].variance > 0 ? 1 / seen[i].variance : 0;
        }
        fit(field, measured, precision);
    }
}

/// Fits a smooth field of offsets to the measured ones. The standard deviation of the field, whose mean is 0, and the
/// weights of the measurements are estimated at the same time by expectation maximisation.
/// @param precision  1 / variance of the measured offsets; 0: unknown
void Motion::fit(const OffsetField& field, const std::vector<double>& measured, const std::vector<double>& precision) {
    const std::size_t count = patches_.size();
    const std::vector<OffsetEvidence> none(count);
    const std::vector<double> zero(count, 0.0);
    double deviation = 0.5 * part_range() * h_;
    std::vector<double> believed = precision;
    for (int round = 0; round < kCommon.rounds; ++round) {
        run_.check();
        offset_ = field.fit(zero, std::vector<double>(count, deviation), none, measured, believed, nullptr).offset;
        double squares = 0, area = 0;
        for (std::size_t i = 0; i < count; ++i) {
            const double unknown = 1 / (1 / (deviation * deviation) + believed[i]), off = measured[i] - offset_[i];
            squares += patches_.area[i] * (offset_[i] * offset_[i] + unknown);
            area += patches_.area[i];
            // Weights of Student's t-distribution with three degrees of freedom: large residuals count less, because
            // an offset is not a valid measurement if the image has changed at its patch.
            believed[i] = precision[i] * 4 / (3 + off * off * precision[i]);
        }
        deviation = std::max(std::sqrt(squares / area), kFinest * h_);
    }
}

/// Calls pair(intensity before, intensity later) for all samples of a patch that exist in both images if the patch has
/// moved by `offset` steps.
/// @return false if fewer than half of the samples before have a pair
template <typename Pair>
bool Motion::for_each_pair(std::size_t i, const Template& later, int offset, const Pair& pair) const {
    const Template& was = known_.templates[i];
    int all = 0, both = 0;
    for (int s = -known_.window[i]; s <= known_.window[i]; ++s) {
        if (!was.has(s)) continue;
        ++all;
        if (!later.has(s + offset)) continue;
        ++both;
        pair(was.at(s), later.at(s + offset));
    }
    return both > 0 && 2 * both >= all;
}

/// Reads a template for each patch: the intensities of the new image along the patch's normal, after the patch has been
/// moved by the current translation and its offset. The intensities are mapped linearly to those of the previous image.
/// both_ receives the means, deviations and correlation of the intensities of both images.
std::vector<Template> Motion::read_now() {
    std::vector<Template> now(patches_.size());
    std::vector<Moments> best(now.size());
    tbb::parallel_for(std::size_t(0), now.size(), [&](std::size_t i) {
        Vec3 to = translation_;
        for (int a = 0; a < 3; ++a) to[a] += offset_[i] * patches_.directions[i][a];
        now[i] = known_.read(i, image_, to);
        for (int offset = -known_.range[i]; offset <= known_.range[i]; ++offset) {
            Moments both;
            if (!for_each_pair(i, now[i], offset, [&](double was, double is) { both.add(was, is); })) continue;
            if (both.correlation() > best[i].correlation()) best[i] = both;
        }
    });
    // Illumination varies and stains bleach: one gain and one offset of intensity for the whole image, from the best
    // match of each patch.
    both_ = {};
    for (const Moments& of_patch : best) both_.add(of_patch);
    const double gain = both_.deviation_y() > 0 ? both_.deviation_x() / both_.deviation_y() : 1.0;
    for (Template& t : now) t.scale(gain, both_.mean_x() - gain * both_.mean_y());
    return now;
}

std::vector<Motion::Mismatch> Motion::compare(const std::vector<Template>& later) const {
    std::vector<Mismatch> result(later.size());
    tbb::parallel_for(std::size_t(0), later.size(), [&](std::size_t i) {
        for (int offset = -known_.range[i]; offset <= known_.range[i]; ++offset) {
            double sum = 0;
            int count = 0;
            const bool enough = for_each_pair(i, later[i], offset, [&](double was, double is) {
                sum += (is - was) * (is - was);
                ++count;
            });
            if (!enough) continue;  // too few samples, as at the ends of the range
            if (result[i].squares.empty()) result[i].first = offset;
            result[i].squares.push_back(sum / count);
        }
        result[i].for_each_offset(
            [&](double, double square) { result[i].minimum = std::min(result[i].minimum, square); });
    });
    return result;
}

std::vector<Motion::Estimate> Motion::estimates(const std::vector<Mismatch>& mismatches, double noise) const {
    std::vector<Estimate> result(mismatches.size());
    tbb::parallel_for(std::size_t(0), result.size(), [&](std::size_t i) {
        const Mismatch& m = mismatches[i];
        if (m.squares.empty()) return;
        int seen = 0;
        for (int s = -known_.window[i]; s <= known_.window[i]; ++s) seen += known_.templates[i].has(s);
        const double samples = double(seen) / kStepsPerVoxel;  // the samples within a voxel count as one
        double mass = 0, first = 0, second = 0;
        m.for_each_offset([&](double offset, double square) {
            const double weight = std::exp(-0.5 * samples * (square - m.minimum) / noise);
            mass += weight;
            first += weight * offset;
            second += weight * offset * offset;
        });
        const double step = patches_.voxel[i] / kStepsPerVoxel, mean = first / mass;
        result[i].offset = mean * step;
        // Samples are a step apart, so that each offset is uncertain by half a step.
        result[i].variance = (std::max(second / mass - mean * mean, 0.0) + 0.5 * 0.5) * step * step;
    });
    return result;
}

/// Radius of a ball with the surface's ratio of volume to area.
double Motion::radius() const {
    double area = 0, volume = 0;
    const Vec3& origin = patches_.centers.front();
    for (std::size_t i = 0; i < patches_.size(); ++i) {
        area += patches_.area[i];
        for (int a = 0; a < 3; ++a)
            volume += patches_.area[i] * patches_.directions[i][a] * (patches_.centers[i][a] - origin[a]) / 3;
    }
    return 3 * std::abs(volume) / area;
}

Followed Motion::moved() const {
    Followed result;
    MotionReport& report = result.report;
    report.translation = translation_;
    report.correlation = both_.correlation();
    double area = 0;
    for (std::size_t i = 0; i < patches_.size(); ++i) {
        report.mean_offset += patches_.area[i] * offset_[i];
        area += patches_.area[i];
        report.max_offset = std::max(report.max_offset, std::abs(offset_[i]));
    }
    report.mean_offset /= area;
    result.u = known_.given;
    const bool is_still = translation_ == Vec3{0, 0, 0} && !(report.max_offset > kFinest * h_);
    if (is_still) return result;
    const FloatGridPtr level = known_.distance->less(on_vertices(patches_, kGuide.patch_width * h_, offset_));
    // The lattice is shifted by whole voxels, and only the remaining fraction is interpolated, quadratically: linear
    // interpolation would shrink convex shapes from image to image.
    Vec3 whole, part;
    for (int a = 0; a < 3; ++a) {
        whole[a] = std::round(translation_[a] / h_);
        part[a] = translation_[a] / h_ - whole[a];
    }
    result.u = detail::redistance(*moved_by(*level, part), known_.domain, kHalfWidthVoxels, detail::DomainEnd::Closed,
                                  "motion", run_);
    if (whole == Vec3{0, 0, 0}) return result;
    result.u->transform().postTranslate(h_ * openvdb::Vec3d(whole[0], whole[1], whole[2]));
    result.u = start_from_grid(known_.domain, *result.u, run_);
    return result;
}

}  // namespace

SurfaceTemplate::SurfaceTemplate(const FloatGridPtr& surface, const Image& image, const RunContext& run) {
    with_threads(run, [&] { data_ = std::make_shared<const Data>(surface, image, run); });
}

Followed SurfaceTemplate::follow(const Image& image, const RunContext& run) const {
    Followed result;
    with_threads(run, [&] { result = Motion(*data_, image, run).follow(); });
    return result;
}

}  // namespace covol
