#pragma once
#include <vector>

#include "covol/domain.h"
#include "covol/mesh.h"
#include "covol/run.h"

namespace covol {

/// A solid that carries the points of a scan which encloses nothing.
struct ScanSolid {
    FloatGridPtr level_set;  ///< signed distance, negative inside, on a grid of its own; null where no solid was found
    double ball_radius = 0;  ///< R, world units
    double carried = 0;      ///< share of the voxels with points that have solid behind them
    double voxel_size = 0;   ///< of the grid that it was found on
    int carved = 0;          ///< hollows that were opened again
};

/// The solid behind a scan with gaps as wide as the thing itself (one side seen, an open bottom, walls seen from one side).
///
/// A ball of radius R that rolls outside over the points leaves a body behind (their closing). R is the smallest at which
/// that body is a solid and no longer a skin: 95 % of the voxels with points have room for a ball of two voxels behind them. What so
/// large a ball has bridged as well is then opened again where that costs no point what is behind it: the body falls into
/// the basins of the distance to the points and to its own surface, and a basin that lies at the surface is cut out when the
/// points around it lose nothing. Larger balls fill wide gaps less deeply, smaller ones open dents, piece by piece, each
/// where more points gain than lose by it.
/// @param voxel_size  of the result's user: the analysis is no finer, and at most 110 voxels along the longest side.
/// @throws Error InvalidOptions (voxel_size), InvalidInput (no point).
[[nodiscard]] ScanSolid solid_from_scan(const std::vector<Vec3>& points, double voxel_size, const RunContext& run = {});

/// Share of a surface's area that lies farther than `reach` from every point: where the points do not determine it.
/// @param distance  to the points; its background, for what lies beyond its tube, is at least `reach`
[[nodiscard]] double share_without_points(const TriangleMesh& mesh, const FloatGrid& distance, double reach,
                                          const RunContext& run = {});
/// The same, on a distance grid of its own with a third of `reach` as voxel size.
[[nodiscard]] double share_without_points(const TriangleMesh& mesh, const std::vector<Vec3>& points, double reach,
                                          const RunContext& run = {});

}  // namespace covol
