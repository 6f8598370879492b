#pragma once
// Creases in a mesh.
#include <memory>
#include <vector>

#include "cloud/surface/local_fit.h"
#include "covol/mesh.h"
#include "points/point_cells.h"

namespace covol {

/// The creases of a cloud, by place.
class Creases {
public:
    /// @param quadrics  those with a crease
    /// @param reach     how far from its foot each holds
    Creases(std::vector<cloud::Quadric> quadrics, std::vector<double> reach);
    [[nodiscard]] std::size_t size() const { return quadrics_.size(); }
    /// The one with the nearest foot of those that hold there; null if none does.
    [[nodiscard]] const cloud::Crease* nearest(const Vec3& place) const;

private:
    std::vector<cloud::Quadric> quadrics_;
    std::vector<double> reach_;
    double longest_ = 0;
    cloud::PointCells cells_;
};

namespace cloud {

/// Gives a mesh of marching cubes, which cuts edges and corners off, those of the creases: vertices beside a crease
/// move to their sheet, or onto the crease where they nearly lie on it, and triangles across it are divided where its
/// sheets meet (as by Attene and others, Sharpen and Bend, IEEE TVCG 11(2), 2005, whose planes are guessed from the
/// mesh). The mesh stays as closed and manifold as it was.
/// @param h  voxel size of the level set that the mesh was made of
/// @return how many edges were divided
std::size_t sharpen(TriangleMesh& mesh, const Creases& creases, double h);

}  // namespace cloud
}  // namespace covol
