#include "covol/level_set.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Composite.h>
#include <openvdb/tools/ValueTransformer.h>

#include <cmath>
#include <string>
#include <utility>

#include "base/number.h"
#include "covol/error.h"
#include "covol/mesh_stream.h"
#include "covol/start.h"
#include "covol/surface.h"
#include "grid/levels_at.h"
#include "redistance/redistance.h"

namespace covol {
namespace {

/// `other` on the lattice of `first`. @throws Error InvalidInput if none of its surface lies in the domain of `first`.
FloatGridPtr on_lattice_of(const LevelSet& first, const LevelSet& other, const RunContext& run) {
    const Domain domain = first.domain();
    return domain == other.domain() ? other.grid().deepCopy() : start_from_grid(domain, other.grid(), run);
}

template <typename Combine>
LevelSet combined(const LevelSet& a, const LevelSet& b, const RunContext& run, const Combine& combine) {
    const FloatGridPtr mine = a.grid().deepCopy(), theirs = on_lattice_of(a, b, run);
    combine(*mine, *theirs);
    return LevelSet::from(*mine, run);
}

}  // namespace

LevelSet LevelSet::from(const FloatGrid& u, const RunContext& run) { return LevelSet(extract_surface(u, run)); }

LevelSet::LevelSet(FloatGridPtr distance) : grid_(std::move(distance)) {
    const auto require = [](bool is_met, const std::string& expected, const std::string& got) {
        if (!is_met) throw Error(Errc::InvalidInput, "LevelSet: expected " + expected + ", got " + got);
    };
    require(grid_ != nullptr, "a grid", "none");
    require(grid_->getGridClass() == openvdb::GRID_LEVEL_SET, "a grid of class level set",
            "'" + openvdb::GridBase::gridClassToString(grid_->getGridClass()) + "'");
    const double width = kHalfWidthVoxels * domain_of(*grid_).voxel_size;
    require(std::abs(grid_->background() - width) <= 1e-4 * width, "a background of " + detail::number(width),
            detail::number(grid_->background()));
}

Domain LevelSet::domain() const { return domain_of(*grid_); }

std::vector<double> LevelSet::sample(std::span<const Vec3> places) const { return detail::levels_at(*grid_, places); }

double LevelSet::sample(const Vec3& place) const { return sample(std::span(&place, 1)).front(); }

LevelSet LevelSet::offset(double distance, const RunContext& run) const {
    if (!std::isfinite(distance))
        throw Error(Errc::InvalidOptions, "distance: expected a finite number, got " + detail::number(distance));
    const Domain own = domain();
    FloatGridPtr moved;
    with_threads(run, [&] {
        const double half_width = kHalfWidthVoxels + std::abs(distance) / own.voxel_size;
        moved = detail::redistance(*grid_, own, half_width, detail::DomainEnd::Closed, "offset", run);
        const auto shift = float(distance);
        openvdb::tools::foreach (moved->beginValueAll(),
                                 [shift](const auto& value) { value.setValue(*value - shift); });
        moved->tree().root().setBackground(moved->background() - shift, false);
    });
    return from(*moved, run);
}

LevelSet LevelSet::united(const LevelSet& other, const RunContext& run) const {
    return combined(*this, other, run, [](FloatGrid& a, FloatGrid& b) { openvdb::tools::csgUnion(a, b); });
}

LevelSet LevelSet::intersected(const LevelSet& other, const RunContext& run) const {
    return combined(*this, other, run, [](FloatGrid& a, FloatGrid& b) { openvdb::tools::csgIntersection(a, b); });
}

LevelSet LevelSet::without(const LevelSet& other, const RunContext& run) const {
    return combined(*this, other, run, [](FloatGrid& a, FloatGrid& b) { openvdb::tools::csgDifference(a, b); });
}

MeshMeasures LevelSet::measure(const RunContext& run) const { return measure_surface(*grid_, 0, run).measures; }

}  // namespace covol
