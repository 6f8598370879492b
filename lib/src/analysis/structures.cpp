// Makes several solids disjoint, and closes narrow gaps between them.
#include "covol/structures.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Composite.h>
#include <openvdb/tools/LevelSetUtil.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <set>
#include <sstream>

#include "covol/domain.h"
#include "covol/error.h"
#include "covol/surface.h"
#include "grid/leaf_band.h"
#include "redistance/redistance.h"

namespace covol {
namespace {

using detail::kLeafSize;
using openvdb::Coord;
using Accessor = FloatGrid::ConstAccessor;

std::string quoted(const std::string& name) { return "'" + name + "'"; }

std::string percent(double fraction) {
    std::ostringstream text;
    text.precision(3);
    text << 100 * fraction << " %";
    return text.str();
}

/// Makes structures disjoint. The object holds their level sets while overlaps are found and removed.
class Separation {
public:
    Separation(const std::vector<Structure>& structures, const SeparateOptions& options, const RunContext& run)
        : structures_(structures), options_(options), run_(run) {
        check_input();
        h_ = domain_of(*structures.front().surface).voxel_size;
        gap_ = options.gap.value_or(h_);
        for (const Structure& s : structures) phi_.push_back(s.surface);
        report_.changed.assign(structures.size(), false);
    }

    SeparateResult go() {
        find_overlaps();
        carve();
        deepen();
        std::vector<FloatGridPtr> surfaces;
        for (std::size_t i = 0; i < phi_.size(); ++i) surfaces.push_back(separated(i));
        return {surfaces, report_};
    }

private:
    void check_input() const {
        require_valid(options_, "separate");
        if (structures_.empty()) throw Error(Errc::InvalidInput, "structures: expected at least one, got none");
        std::set<std::string> names;
        for (const Structure& s : structures_) {
            if (s.name.empty() || !names.insert(s.name).second)
                throw Error(Errc::InvalidInput,
                            "structures: expected unique names, got " + quoted(s.name) + " twice or empty");
            if (!s.surface || s.surface->transform() != structures_.front().surface->transform())
                throw Error(Errc::InvalidInput,
                            quoted(s.name) + " and " + quoted(structures_.front().name) +
                                ": expected grids with the same transform; compute both on one domain");
        }
    }

    // ---- overlaps ------------------------------------------------------------------------------------------------

    using Mask = openvdb::BoolGrid::Ptr;
    [[nodiscard]] Mask inside(std::size_t i, double below) const {
        return openvdb::tools::sdfInteriorMask(*phi_[i], static_cast<float>(below));
    }
    static std::uint64_t common(const Mask& a, const Mask& b) {
        openvdb::BoolTree both(a->tree());
        both.topologyIntersection(b->tree());
        return both.activeVoxelCount();
    }

    void find_overlaps() {
        std::vector<Mask> solids;
        std::vector<openvdb::CoordBBox> boxes;
        for (std::size_t i = 0; i < phi_.size(); ++i) {
            run_.check();
            solids.push_back(inside(i, 0));
            boxes.push_back(solids.back()->evalActiveVoxelBoundingBox());
        }
        for (std::size_t a = 0; a < phi_.size(); ++a)
            for (std::size_t b = a + 1; b < phi_.size(); ++b) {
                if (!boxes[a].hasOverlap(boxes[b])) continue;
                run_.check();
                const std::uint64_t both = common(solids[a], solids[b]);
                if (both == 0) continue;
                StructureOverlap overlap{a, b, double(both) * h_ * h_ * h_, std::nullopt};
                const std::uint64_t in_a = solids[a]->activeVoxelCount(), in_b = solids[b]->activeVoxelCount();
                const double fraction = double(both) / double(std::min(in_a, in_b));
                if (fraction >= options_.nested_fraction) {
                    if (in_a == in_b)
                        throw Error(Errc::InvalidInput, quoted(structures_[a].name) + " and " +
                                                            quoted(structures_[b].name) +
                                                            " are the same solid: " + percent(fraction) +
                                                            " of their voxels coincide; mark each with its own points");
                    overlap.inner = in_a < in_b ? a : b;
                }
                report_.overlaps.push_back(overlap);
            }
    }

    void carve() {
        std::vector<FloatGridPtr> carved = phi_;
        for (const StructureOverlap& overlap : report_.overlaps) {
            if (!overlap.inner) continue;
            const std::size_t outer = *overlap.inner == overlap.a ? overlap.b : overlap.a;
            run_.info(quoted(structures_[*overlap.inner].name) + " lies inside " + quoted(structures_[outer].name) +
                      " and is subtracted from it");
            const FloatGridPtr inner = phi_[*overlap.inner]->deepCopy();
            carved[outer] = carved[outer]->deepCopy();
            openvdb::tools::csgDifference(*carved[outer], *inner);
            report_.changed[outer] = true;
        }
        phi_ = carved;
    }

    // Extends the range of the stored distances until it includes the middle of each overlap. The two distances are
    // equal there, which defines the new border; distances that are clamped before cannot show it.
    void deepen() {
        if (report_.overlaps.empty()) return;
        const double margin = 2 * h_;
        for (double width = kHalfWidthVoxels * h_;; width *= 2) {
            std::vector<Mask> cores;
            for (std::size_t i = 0; i < phi_.size(); ++i) cores.push_back(inside(i, margin - width));
            std::set<std::size_t> shallow;
            for (const StructureOverlap& overlap : report_.overlaps)
                if (common(cores[overlap.a], cores[overlap.b]) > 0) shallow.insert({overlap.a, overlap.b});
            if (shallow.empty()) return;
            run_.check();
            // All distances are computed up to the same depth, because distances that are clamped at different depths
            // cannot be compared.
            for (FloatGridPtr& phi : phi_)
                phi = detail::redistance(*phi, domain_of(*phi), 2 * width / h_, detail::DomainEnd::Closed, "surface",
                                         run_);
        }
    }

    // ---- interfaces ----------------------------------------------------------------------------------------------

    static openvdb::Vec3d gradient(const Accessor& phi, const Coord& at) {
        openvdb::Vec3d g;
        for (int a = 0; a < 3; ++a) {
            Coord step(0, 0, 0);
            step[a] = 1;
            g[a] = double(phi.getValue(at + step)) - phi.getValue(at - step);
        }
        return g;
    }

    /// For each voxel of a leaf, the minimum of the signed distances to the other structures. `matters` is false if the
    /// leaf lies outside all of them and their narrow bands; the leaf is then left unchanged.
    struct Nearest {
        std::array<float, kLeafSize> value;
        bool matters = false;
    };

    void gather(std::size_t i, const Coord& origin, Nearest& nearest) const {
        nearest.value.fill(std::numeric_limits<float>::max());
        nearest.matters = false;
        for (std::size_t j = 0; j < phi_.size(); ++j) {
            if (j == i) continue;
            const auto* leaf = phi_[j]->tree().probeConstLeaf(origin);
            const float tile = leaf == nullptr ? phi_[j]->tree().getValue(origin) : 0.0F;
            if (leaf == nullptr && tile > 0) continue;
            nearest.matters = true;
            const float* values = leaf == nullptr ? nullptr : leaf->buffer().data();
            for (int p = 0; p < kLeafSize; ++p)
                nearest.value[p] = std::min(nearest.value[p], values == nullptr ? tile : values[p]);
        }
    }

    /// Whether `at` lies between the surface of structure i and that of another structure at the signed distance m: the
    /// two distances then increase in opposite directions.
    [[nodiscard]] bool is_between(std::size_t i, float m, const Coord& at, const std::vector<Accessor>& phi) const {
        const openvdb::Vec3d mine = gradient(phi[i], at);
        for (std::size_t j = 0; j < phi.size(); ++j)
            if (j != i && phi[j].getValue(at) == m && mine.dot(gradient(phi[j], at)) < 0) return true;
        return false;
    }

    /// The surface of structure i, separated from the others.
    FloatGridPtr separated(std::size_t i) {
        run_.check();
        const FloatGridPtr u = phi_[i]->deepCopy();
        std::vector<FloatGrid::TreeType::LeafNodeType*> leaves;
        u->tree().getNodes(leaves);
        std::atomic<bool> moved = false;
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 8), [&](const auto& range) {
            std::vector<Accessor> phi;
            for (const FloatGridPtr& grid : phi_) phi.push_back(grid->getConstAccessor());
            Nearest nearest;
            for (std::size_t n = range.begin(); n != range.end(); ++n) {
                gather(i, leaves[n]->origin(), nearest);
                if (nearest.matters && separate_leaf(i, *leaves[n], nearest, phi)) moved = true;
            }
        });
        if (!moved && !report_.changed[i]) return structures_[i].surface;
        report_.changed[i] = true;
        try {
            return extract_surface(*u, run_);
        } catch (const Error& error) {
            if (error.code() != Errc::InvalidInput) throw;
            throw Error(Errc::InvalidInput, "nothing is left of " + quoted(structures_[i].name) +
                                                ": the other structures cover it; mark each with its own points");
        }
    }

    template <typename Leaf>
    bool separate_leaf(std::size_t i, Leaf& leaf, const Nearest& nearest, const std::vector<Accessor>& phi) const {
        float* values = leaf.buffer().data();
        const float gap = static_cast<float>(gap_);
        bool moved = false;
        for (int p = 0; p < kLeafSize; ++p) {
            const float mine = values[p], other = nearest.value[p];
            const float between = mine + other;  // width of the gap between both; negative if they overlap
            if (!(between < gap)) continue;
            const Coord at = leaf.origin().offsetBy(p >> 6, p >> 3 & 7, p & 7);
            if (!(between <= 0) && !is_between(i, other, at, phi)) continue;
            values[p] = (mine - other) / 2;
            // The new value does not move the surface of structure i if the structures touch exactly (between == 0), or
            // if this voxel is more than two voxels away from that surface.
            moved = moved || (between != 0 && std::abs(mine) < 2 * h_);
        }
        return moved;
    }

    const std::vector<Structure>& structures_;
    const SeparateOptions& options_;
    const RunContext& run_;
    double h_ = 0, gap_ = 0;
    std::vector<FloatGridPtr> phi_;
    SeparateReport report_;
};

}  // namespace

SeparateResult separate(const std::vector<Structure>& structures, const SeparateOptions& options,
                        const RunContext& run) {
    SeparateResult result;
    with_threads(run, [&] { result = Separation(structures, options, run).go(); });
    return result;
}

std::vector<std::string> make_grid_names(const std::vector<std::string>& names) {
    if (names.size() == 1) return {"surface"};
    std::vector<std::string> result;
    std::set<std::string> taken;
    for (const std::string& name : names) {
        std::string id;
        for (const char c : name) {
            const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
            id += letter || (c >= '0' && c <= '9') ? c : '_';
        }
        if (id.empty() || (id[0] >= '0' && id[0] <= '9')) id.insert(0, "_");
        std::string unique = id;
        for (int n = 2; !taken.insert(unique).second; ++n) unique = id + "_" + std::to_string(n);
        result.push_back(unique);
    }
    return result;
}

std::array<std::uint8_t, 3> structure_color(std::size_t n) {
    // Paul Tol's "bright" scheme and then "muted" ones, which colour-blind readers can distinguish too.
    static constexpr std::array<std::array<std::uint8_t, 3>, 12> kColors{{{68, 119, 170},
                                                                          {238, 102, 119},
                                                                          {34, 136, 51},
                                                                          {204, 187, 68},
                                                                          {102, 204, 238},
                                                                          {170, 51, 119},
                                                                          {238, 119, 51},
                                                                          {0, 153, 136},
                                                                          {136, 34, 85},
                                                                          {153, 153, 51},
                                                                          {51, 34, 136},
                                                                          {187, 187, 187}}};
    return kColors[n % kColors.size()];
}

std::vector<std::pair<std::string, std::string>> make_slicer_segments(const std::vector<std::string>& names,
                                                                      const std::vector<VoxelBox>& extents,
                                                                      const std::vector<int>& values) {
    std::vector<std::pair<std::string, std::string>> fields{
        {"Segmentation_ContainedRepresentationNames", "Binary labelmap|"},
        {"Segmentation_MasterRepresentation", "Binary labelmap"},
        {"Segmentation_SourceRepresentation", "Binary labelmap"},
        {"Segmentation_ReferenceImageExtentOffset", "0 0 0"}};
    for (std::size_t n = 0; n < names.size(); ++n) {
        const std::string key = "Segment" + std::to_string(n) + "_";
        std::ostringstream color, extent;
        const auto rgb = structure_color(n);
        color.precision(6);
        color << rgb[0] / 255.0 << " " << rgb[1] / 255.0 << " " << rgb[2] / 255.0;
        const VoxelBox& e = extents[n];
        for (int a = 0; a < 3; ++a) extent << (a == 0 ? "" : " ") << e.min[a] << " " << e.max[a];
        for (const auto& [field, value] : std::vector<std::pair<std::string, std::string>>{
                 {"ID", make_grid_names({names[n], {}})[0]},
                 {"Name", names[n]},
                 {"NameAutoGenerated", "0"},
                 {"Color", color.str()},
                 {"ColorAutoGenerated", "0"},
                 {"LabelValue", std::to_string(values.empty() ? int(n) + 1 : values[n])},
                 {"Layer", "0"},
                 {"Extent", extent.str()},
                 {"Tags", "|"}})
            fields.emplace_back(key + field, value);
    }
    return fields;
}

std::string make_itksnap_labels(const std::vector<std::string>& names, const std::vector<int>& values) {
    std::ostringstream text;
    text << "################################################\n"
            "# ITK-SnAP Label Description File\n"
            "# File format:\n"
            "# IDX   -R-  -G-  -B-  -A--  VIS MSH  LABEL\n"
            "################################################\n"
            "    0     0    0    0        0  0  0    \"Clear Label\"\n";
    for (std::size_t n = 0; n < names.size(); ++n) {
        const auto rgb = structure_color(n);
        std::string name = names[n];
        std::replace(name.begin(), name.end(), '"', '\'');
        text << "    " << (values.empty() ? int(n) + 1 : values[n]) << "   " << int(rgb[0]) << "  " << int(rgb[1])
             << "  " << int(rgb[2]) << "        1  1  1    \"" << name << "\"\n";
    }
    return text.str();
}

}  // namespace covol
