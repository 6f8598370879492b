#pragma once
// Creases in a mesh.
#include <memory>
#include <vector>

#include "cloud/surface/local_fit.h"
#include "covol/mesh.h"
#include "points/point_cells.h"

namespace covol {

/// The creases of a cloud, by position.
class Creases {
public:
    /// @param quadrics  those with a crease
    /// @param reach     for each quadric, the distance from its foot() up to which its crease applies
    Creases(std::vector<cloud::Quadric> quadrics, std::vector<double> reach);
    [[nodiscard]] std::size_t size() const { return quadrics_.size(); }
    /// Of the creases that apply at a position, the one whose foot() is nearest to it; null if none applies.
    [[nodiscard]] const cloud::Crease* nearest(const Vec3& place) const;

private:
    std::vector<cloud::Quadric> quadrics_;
    std::vector<double> reach_;
    double longest_ = 0;
    cloud::PointCells cells_;
};

namespace cloud {

/// Restores edges and corners, which marching cubes cut off, from the creases: vertices beside a crease move to their
/// sheet, or onto the crease if they nearly lie on it, and triangles across it are divided where its sheets meet (as by
/// Attene et al., Sharpen and Bend, IEEE TVCG 11(2), 2005, who estimate the planes from the mesh). A closed or manifold
/// mesh remains so.
/// @param h  voxel size of the level set from which the mesh was extracted
/// @return number of divided edges
std::size_t sharpen(TriangleMesh& mesh, const Creases& creases, double h);

}  // namespace cloud
}  // namespace covol
