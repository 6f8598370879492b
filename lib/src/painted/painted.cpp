#include "covol/painted.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <mutex>
#include <optional>
#include <sstream>

#include "base/file.h"
#include "base/heuristics.h"
#include "covol/error.h"
#include "painted/outline.h"
#include "painted/paint.h"
#include "painted/segments.h"
#include "painted/whole_runs.h"

namespace covol {
namespace {

using painted::AxisPaint;
using painted::Paint;

constexpr std::size_t kMaxListed = 8;
constexpr const char* kAxisNames[3] = {"x", "y", "z"};

std::string to_text(const Index3& p) {
    return "(" + std::to_string(p[0]) + ", " + std::to_string(p[1]) + ", " + std::to_string(p[2]) + ")";
}

std::string size_text(const Index3& n) {
    return std::to_string(n[0]) + " x " + std::to_string(n[1]) + " x " + std::to_string(n[2]);
}

/// The numbers as text. Of more than kMaxListed, only the first six and the last are listed: "3, 8, 13, 18, 23, 28,
/// ..., 43".
std::string list_text(const std::vector<int>& numbers) {
    std::ostringstream text;
    for (std::size_t n = 0; n < numbers.size(); ++n) {
        if (numbers.size() > kMaxListed && n == kMaxListed - 2) {
            text << ", ..., " << numbers.back();
            break;
        }
        text << (n == 0 ? "" : ", ") << numbers[n];
    }
    return text.str();
}

std::string count_text(std::size_t count, const char* what) {
    return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

[[noreturn]] void bad_value(const Image& labels, const Index3& at) {
    std::ostringstream text;
    text << labels.path() << ": expected whole numbers >= 0, got " << labels.at(at[0], at[1], at[2]) << " at voxel "
         << to_text(at) << "; is it a label image?";
    throw Error(Errc::InvalidInput, text.str());
}

/// The bounding box of the voxels of each label other than 0.
std::map<int, VoxelBox> boxes_of(const Image& labels) {
    const Index3 size = labels.geometry().size;
    std::vector<std::map<int, VoxelBox>> slices(static_cast<std::size_t>(size[2]));
    std::vector<Index3> bad(slices.size(), {-1, -1, -1});
    tbb::parallel_for(0, size[2], [&](int k) {
        auto& boxes = slices[std::size_t(k)];
        for (int j = 0; j < size[1]; ++j)
            for (int i = 0; i < size[0]; ++i) {
                const double value = labels.at(i, j, k);
                if (value == 0) continue;
                if (value < 0 || value != std::floor(value) || value > 2147483647.0) {
                    if (bad[std::size_t(k)][0] < 0) bad[std::size_t(k)] = {i, j, k};
                    continue;
                }
                const auto [at, added] = boxes.try_emplace(int(value), VoxelBox{{i, j, k}, {i, j, k}});
                VoxelBox& box = at->second;
                box.min[0] = std::min(box.min[0], i);
                box.max[0] = std::max(box.max[0], i);
                box.max[1] = j;
            }
    });
    for (const Index3& at : bad)
        if (at[0] >= 0) bad_value(labels, at);
    std::map<int, VoxelBox> all;
    for (const auto& slice : slices)
        for (const auto& [label, box] : slice) {
            const auto [at, added] = all.try_emplace(label, box);
            for (int a = 0; a < 3; ++a) {
                at->second.min[a] = std::min(at->second.min[a], box.min[a]);
                at->second.max[a] = std::max(at->second.max[a], box.max[a]);
            }
        }
    return all;
}

/// Whether the slices across the axis were painted one by one: no two adjacent ones have an area, or the runs of
/// adjacent ones are at most half as long as the widest patch is wide.
bool is_sliced(const AxisPaint& paint, int axis, const ImageGeometry& geometry) {
    if (paint.areas.empty()) return false;
    if (paint.longest_run == 1) return true;
    const auto [x, y] = Paint::plane(axis);
    const double across = std::max(geometry.spacing[x], geometry.spacing[y]) * paint.widest;
    return kCommon.clear_ratio * paint.longest_run <= paint.widest &&
           kCommon.clear_ratio * paint.longest_run * geometry.spacing[axis] <= across;
}

/// The slices with areas, and those with only small patches and without paint on the adjacent slices: the tips of
/// tapering structures.
std::vector<int> with_tips(const AxisPaint& paint) {
    std::vector<int> slices = paint.areas;
    for (std::size_t n = 0; n < paint.painted.size(); ++n) {
        const bool below = n > 0 && paint.painted[n - 1] == paint.painted[n] - 1;
        const bool above = n + 1 < paint.painted.size() && paint.painted[n + 1] == paint.painted[n] + 1;
        if (paint.small[n] && !below && !above) slices.push_back(paint.painted[n]);
    }
    std::sort(slices.begin(), slices.end());
    return slices;
}

PaintedView view_of(const Paint& paint, int axis, std::vector<int> slices, const std::string& source) {
    const auto [x, y] = Paint::plane(axis);
    std::vector<std::vector<detail::Polygon>> lines(slices.size());
    tbb::parallel_for(std::size_t(0), slices.size(), [&, axis](std::size_t n) {
        lines[n] = painted::outlines(paint.slice(axis, slices[n]), paint.ends(axis));
    });
    PaintedView view;
    view.axis = axis;
    view.outlines.space = PointSpace::Index;
    view.outlines.source = source;
    for (std::size_t n = 0; n < slices.size(); ++n)
        for (const detail::Polygon& polygon : lines[n]) {
            MarkLine line;
            line.begin = view.outlines.points.size();
            line.name = "slice " + std::to_string(slices[n]);
            for (const detail::Vec2& p : polygon) {
                Vec3 at;
                at[axis] = slices[n];
                at[x] = paint.box().min[x] + p[0];
                at[y] = paint.box().min[y] + p[1];
                view.outlines.points.push_back(at);
            }
            line.end = view.outlines.points.size();
            view.outlines.lines.push_back(line);
        }
    view.slices = std::move(slices);
    return view;
}

void summarise(PaintedLabel& label, std::size_t scribbled) {
    std::ostringstream text;
    text << "label " << label.label << ": " << count_text(label.voxels, "voxel");
    for (const PaintedView& view : label.views)
        text << "; " << count_text(view.slices.size(), "slice") << " across " << kAxisNames[view.axis] << " ("
             << list_text(view.slices) << ") taken as completely painted, with "
             << count_text(view.outlines.lines.size(), "outline");
    if (scribbled > 0)
        text << "; " << (label.views.empty() ? "" : "the other ") << count_text(scribbled, "voxel")
             << " taken as scribbles: inside, and outside of the other labels";
    label.summary = text.str();
}

PaintedLabel understand(const Image& labels, const LabelName& name, const VoxelBox& box, PaintedAs as) {
    Paint paint(labels, name.label, box);
    PaintedLabel result;
    result.label = name.label;
    result.name = name.name;
    result.voxels = paint.voxels;
    const std::string source = labels.path() + ": " + name.name;
    if (as != PaintedAs::Scribbles) {
        std::array<AxisPaint, 3> axes;
        for (int a = 0; a < 3; ++a) axes[a] = painted::properties_across(paint, a);
        for (const int a : {2, 1, 0})
            if (is_sliced(axes[a], a, labels.geometry()))
                result.views.push_back(view_of(paint, a, with_tips(axes[a]), source));
        if (result.views.empty())
            if (const std::optional<int> a = painted::find_whole_runs(paint, labels.geometry()))
                result.views.push_back(view_of(paint, *a, with_tips(axes[*a]), source));
        if (result.views.empty() && as == PaintedAs::Slices) {
            // The axis along which the smallest fraction of the slices of the paint's box contains paint.
            const auto fraction = [&](int a) { return double(axes[a].painted.size()) / box.size()[a]; };
            int best = 2;
            for (const int a : {1, 0})
                if (fraction(a) < fraction(best)) best = a;
            result.views.push_back(view_of(paint, best, axes[best].painted, source));
        }
        for (const PaintedView& view : result.views)
            for (const int slice : view.slices) paint.erase(view.axis, slice);
    }
    const std::vector<Vec3> outer = paint.outer();
    for (const Vec3& p : outer) result.inside.push_back(labels.geometry().index_to_world(p));
    summarise(result, outer.size());
    return result;
}

}  // namespace

std::vector<LabelName> find_painted_labels(const Image& labels) {
    std::vector<LabelName> found;
    const std::map<int, std::string> names = painted::segment_names(labels.path());
    for (const auto& [label, box] : boxes_of(labels)) {
        const auto named = names.find(label);
        found.push_back(
            {label, named != names.end() ? named->second : "label" + std::to_string(label), named != names.end()});
    }
    if (found.empty())
        throw Error(Errc::InvalidInput, labels.path() + ": expected painted voxels, got 0 everywhere in " +
                                            size_text(labels.geometry().size));
    return found;
}

Painted understand_painted(const Image& labels, const std::vector<LabelName>& names, const PaintedOptions& options,
                           const RunContext& run) {
    require_valid(options, "understand_painted");
    Painted result;
    result.geometry = labels.geometry();
    with_threads(run, [&] {
        const std::map<int, VoxelBox> boxes = boxes_of(labels);
        if (options.outside_label != 0 && !boxes.contains(options.outside_label)) {
            std::string list;
            for (const auto& [label, box] : boxes) list += (list.empty() ? "" : ", ") + std::to_string(label);
            throw Error(Errc::InvalidInput, labels.path() + ": expected the outside label " +
                                                std::to_string(options.outside_label) + " among its labels, got " +
                                                list + "; correct `painted_outside`");
        }
        for (const LabelName& name : names) {
            run.check();
            const auto box = boxes.find(name.label);
            if (box == boxes.end() || name.label == options.outside_label) continue;
            result.labels.push_back(understand(labels, name, box->second, options.as));
        }
        if (options.outside_label != 0)
            for (const Vec3& p : Paint(labels, options.outside_label, boxes.at(options.outside_label)).outer())
                result.outside.push_back(labels.geometry().index_to_world(p));
    });
    return result;
}

Contours connect_outlines(const PaintedLabel& label, const ImageGeometry& lattice, double step, const RunContext& run) {
    std::vector<PointCloud> clouds;
    for (const PaintedView& view : label.views) clouds.push_back(view.outlines);
    Contours contours = densify(clouds, lattice, {step, ContourCurve::Lines}, run);
    const auto is_cut = [&](const Vec3& world) {
        const Vec3 p = lattice.world_to_index(world);
        for (int a = 0; a < 3; ++a)
            if (std::min(p[a] + 0.5, lattice.size[a] - 0.5 - p[a]) < 1e-6) return true;
        return false;
    };
    std::erase_if(contours.marks, is_cut);
    std::erase_if(contours.along, is_cut);
    return contours;
}

Image placed_on(const Image& labels, const ImageGeometry& image, bool force) {
    const ImageGeometry& own = labels.geometry();
    if (!own.spacing_known || force) {
        if (own.size == image.size) return labels.placed(image);
        if (!own.spacing_known)
            throw Error(Errc::InvalidInput, labels.path() + ": expected as many voxels as the image, " +
                                                size_text(image.size) + ", because the file states no spacing, got " +
                                                size_text(own.size) +
                                                "; save it with the image's geometry, as NRRD or NIfTI");
    }
    std::mutex guard;
    std::size_t painted = 0, outside = 0;
    Index3 first{-1, -1, own.size[2]};
    tbb::parallel_for(0, own.size[2], [&](int k) {
        std::size_t here = 0, beyond = 0;
        Index3 at{-1, -1, k};
        for (int j = 0; j < own.size[1]; ++j)
            for (int i = 0; i < own.size[0]; ++i) {
                if (labels.at(i, j, k) == 0) continue;
                ++here;
                const Vec3 p = image.world_to_index(own.index_to_world({double(i), double(j), double(k)}));
                bool within = true;
                for (int a = 0; a < 3; ++a) within = within && p[a] >= -0.51 && p[a] <= image.size[a] - 0.49;
                if (!within && beyond++ == 0) at = {i, j, k};
            }
        const std::scoped_lock lock(guard);
        painted += here;
        outside += beyond;
        if (beyond > 0 && k < first[2]) first = at;
    });
    if (outside == 0) return labels;
    const auto box_text = [](const WorldBox& box) {
        std::ostringstream text;
        text << "(" << box.min[0] << ", " << box.min[1] << ", " << box.min[2] << ") to (" << box.max[0] << ", "
             << box.max[1] << ", " << box.max[2] << ")";
        return text.str();
    };
    throw Error(Errc::InvalidInput,
                labels.path() + ": " + std::to_string(outside) + " of " + std::to_string(painted) +
                    " painted voxels lie outside the image, the first at " + to_text(first) +
                    "; the labels reach from " + box_text(own.world_box()) + ", the image from " +
                    box_text(image.world_box()) + "; check `spacing`, or save the labels with the image's geometry",
                "spacing");
}

}  // namespace covol
