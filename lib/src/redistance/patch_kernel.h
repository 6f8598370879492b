#pragma once
#include <array>
#include <cstdint>

// Distances to a polygon of the zero level set, plain functions on arrays. Lengths are voxels.
namespace covol::detail {

/// A polygon of the zero level set.
struct PatchOutline {
    const float* axis;    ///< unit normal of the whole polygon
    const float* center;  ///< three values
    const std::array<float, 3>* vertices;
    int count;  ///< 3 to PatchFan::kMaxTriangles
};

/// The polygon as a fan of triangles around its centre.
struct PatchFan {
    static constexpr int kMaxTriangles = 12;  ///< a cell has twelve edges
    /// The triangle of the centre and two consecutive vertices.
    struct Triangle {
        float from[3];  ///< the first vertex, from the centre
        float edge[3];  ///< from the first to the second vertex
        float normal[3];
        float from_from, from_to, to_to;   ///< scalar products of the vectors from the centre to the vertices
        float area;                        ///< squared length of the normal; 0 if the triangle is too small for one
        float inverse_area;                ///< 1 / area; infinite if there is no normal
        float inverse_from, inverse_edge;  ///< 1 / squared length of `from` and of `edge`; 0 if that length is 0
    };
    int count = 0;  ///< number of triangles; 0 before make()
    Triangle triangles[kMaxTriangles];

    PatchFan() {}  // NOLINT: the triangles are large and may not be needed
    explicit PatchFan(const PatchOutline& outline);
    void make(const PatchOutline& outline);
};

struct PatchHit {
    float squared;     ///< squared distance
    bool is_interior;  ///< the nearest point lies within the polygon, not on its outline
};

/// @param arm  from the polygon's centre to the query point
[[nodiscard]] PatchHit nearest_on(const PatchFan& fan, const float arm[3]);

/// A cylinder above and below a polygon; positions are in voxels relative to the leaf's first voxel.
struct PatchCylinder {
    float center[3];     ///< of the polygon
    float radius;        ///< of the cylinder
    float half_width;    ///< voxels farther from the polygon's plane are ignored
    float patch_radius;  ///< maximum distance of the polygon from the axis
    float patch_height;  ///< maximum distance of the polygon from the plane through the center
};
/// The nearest patch that was found so far, for each voxel of a leaf.
struct PatchLeaf {
    float* squared;           ///< 512 squared distances
    std::int32_t* patch;      ///< by voxel: the nearest patch
    std::uint64_t* interior;  ///< 512 bits, PatchHit::is_interior

    /// Voxel p takes the patch `index` if that is nearer than its current one. @return whether it did
    [[nodiscard]] bool offer(int p, const PatchHit& hit, std::int32_t index) const {
        if (!(hit.squared < squared[p])) return false;
        take(p, hit, index);
        return true;
    }
    void take(int p, const PatchHit& hit, std::int32_t index) const {
        squared[p] = hit.squared;
        patch[p] = index;
        const std::uint64_t bit = std::uint64_t(1) << (p & 63);
        interior[p >> 6] = hit.is_interior ? interior[p >> 6] | bit : interior[p >> 6] & ~bit;
    }
};

/// Assigns the patch `index` to the voxels of the leaf within the cylinder that are nearer to it than to their current
/// one.
/// @param fan  the fan of `outline`; made when it is first needed
void offer_patch(const PatchOutline& outline, const PatchCylinder& cylinder, std::int32_t index, const PatchLeaf& leaf,
                 PatchFan& fan);

}  // namespace covol::detail
