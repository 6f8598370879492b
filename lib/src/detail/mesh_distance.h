#pragma once
#include <memory>

#include "covol/mesh.h"

namespace covol::detail {

/// Distances from points to a mesh, exact to its triangles; safe to query from many threads.
class MeshDistance {
public:
    /// @pre mesh.triangles is not empty
    explicit MeshDistance(const TriangleMesh& mesh);
    ~MeshDistance();
    [[nodiscard]] double operator()(const Vec3& point) const;

private:
    struct Tree;
    std::unique_ptr<Tree> tree_;
};

}  // namespace covol::detail
