#pragma once
#include "covol/mesh.h"
#include "covol/run.h"

namespace covol {

struct CleanupOptions {
    double target_edge = 0.0;  ///< > 0: decimate to about this edge length (world units)
    int smooth_iterations = 0; ///< tangential + normal (Taubin-like, volume keeping) smoothing steps
    bool repair = true;        ///< resolve self-intersections and non-manifold spots, fill holes
    [[nodiscard]] std::string why_invalid() const;
};
struct CleanupReport {
    int self_intersections = 0;  ///< pairs found before repair
    int holes_filled = 0;
    bool closed = false, manifold = false, intersection_free = false;  ///< afterwards
};
/// Makes a mesh closed, manifold, outward and free of self-intersections, in place (CGAL, OpenMesh).
CleanupReport clean_mesh(TriangleMesh& mesh, const CleanupOptions& options = {}, const RunContext& run = {});

/// Pairs of triangles that have a point in common beyond the vertices and the edge that they share.
[[nodiscard]] int count_self_intersections(const TriangleMesh& mesh);

}  // namespace covol
