#include "study/paint.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "study/refuse.h"

namespace covol {
namespace {

using detail::refuse;

constexpr double kMaxVoxels = double(1 << 28);  // maximum number in the box around a structure's paint
constexpr double kMaxVisits = double(1 << 30);  // maximum of visited voxels per stroke: some seconds
constexpr int kMargin = 10;  // voxels around the paint: more than the 8 over which outlines are smoothed

/// A segment of a stroke's line.
struct Piece {
    Vec3 from, to;  // world
};

/// Computes with vectors that are given as lengths along an image's axes, which need not be orthogonal.
class Lengths {
public:
    explicit Lengths(const ImageGeometry& image) {
        constexpr double kRounding = 1e-3;  // tolerance for rounded directions in files
        const Matrix3& d = image.direction;
        Eigen::Matrix3d cosines;
        for (std::size_t a = 0; a < 3; ++a)
            for (std::size_t b = 0; b < 3; ++b) {
                const double dot = d[0][a] * d[0][b] + d[1][a] * d[1][b] + d[2][a] * d[2][b];
                cosines(Eigen::Index(a), Eigen::Index(b)) = a == b ? 1 : std::abs(dot) > kRounding ? dot : 0;
            }
        off_ = {cosines(1, 2), cosines(0, 2), cosines(0, 1)};
        const Eigen::Matrix3d inverse = cosines.inverse();
        for (std::size_t a = 0; a < 3; ++a) reach[a] = std::sqrt(inverse(Eigen::Index(a), Eigen::Index(a)));
    }
    /// The scalar product of two vectors given along the axes.
    [[nodiscard]] double dot(const Vec3& u, const Vec3& v) const {
        double sum = u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
        for (std::size_t n = 0; n < 3; ++n) {
            const std::size_t a = (n + 1) % 3, b = (n + 2) % 3;
            if (off_[n] != 0) sum += off_[n] * (u[a] * v[b] + u[b] * v[a]);
        }
        return sum;
    }

    Vec3 reach{1, 1, 1};  ///< extent of a ball of radius 1 along each axis

private:
    Vec3 off_{};  // for each axis, the cosine of the angle between the two others
};

double distance(const Vec3& a, const Vec3& b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

/// The voxels that a piece may reach, in the image; empty if max < min.
VoxelBox box_around(const Piece& piece, const StudyStroke& stroke, const ImageGeometry& image) {
    VoxelBox box;
    const Vec3 reach_of_one = Lengths(image).reach;
    const Vec3 a = image.world_to_index(piece.from), b = image.world_to_index(piece.to);
    for (std::size_t n = 0; n < 3; ++n) {
        const double reach = stroke.radius * reach_of_one[n] / image.spacing[n], last = image.size[n] - 1;
        box.min[n] = int(std::clamp(std::ceil(std::min(a[n], b[n]) - reach), 0.0, last + 1));
        box.max[n] = int(std::clamp(std::floor(std::max(a[n], b[n]) + reach), -1.0, last));
        if (stroke.axis && std::size_t(*stroke.axis) == n) box.min[n] = box.max[n] = stroke.at;
    }
    return box;
}

double voxels_in(const VoxelBox& box) {
    double count = 1;
    for (const int side : box.size()) count *= std::max(0, side);
    return count;
}

void grow(VoxelBox& all, const VoxelBox& box) {
    for (std::size_t n = 0; n < 3; ++n) {
        all.min[n] = std::min(all.min[n], box.min[n]);
        all.max[n] = std::max(all.max[n], box.max[n]);
    }
}

VoxelBox nowhere() {
    constexpr int kFar = std::numeric_limits<int>::max() / 2;
    return {{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
}

/// Divides a stroke's line into pieces that are at most twice as long as the radius, because the box around a long one
/// is mostly empty, and calls take(piece) for each.
template <typename Take>
void each_piece(const StudyStroke& stroke, const Take& take) {
    if (stroke.world.size() == 1) take(Piece{stroke.world[0], stroke.world[0]});
    for (std::size_t n = 1; n < stroke.world.size(); ++n) {
        const Vec3 &a = stroke.world[n - 1], &b = stroke.world[n];
        const double parts = std::max(1.0, std::ceil(distance(a, b) / (2 * stroke.radius)));
        const auto at = [&](double part) {
            Vec3 place{};
            for (std::size_t c = 0; c < 3; ++c) place[c] = a[c] + part / parts * (b[c] - a[c]);
            return place;
        };
        for (double part = 0; part < parts; ++part) take(Piece{at(part), at(part + 1)});
    }
}

VoxelBox box_around(const StudyStructure& structure, const ImageGeometry& image) {
    VoxelBox all = nowhere();
    for (const StudyStroke& stroke : structure.strokes)
        if (!stroke.erases)
            each_piece(stroke, [&](const Piece& piece) {
                const VoxelBox box = box_around(piece, stroke, image);
                if (voxels_in(box) > 0) grow(all, box);
            });
    return all;
}

/// Draws a stroke into `out`. If the stroke is on one slice, distances from it are measured within that slice.
void draw(const StudyStroke& stroke, const ImageGeometry& image, const VoxelBox& box, std::vector<std::uint8_t>& out) {
    const Index3 size = box.size();
    const Lengths lengths(image);
    each_piece(stroke, [&](const Piece& piece) {
        VoxelBox reached = box_around(piece, stroke, image);
        for (std::size_t n = 0; n < 3; ++n) {
            reached.min[n] = std::max(reached.min[n], box.min[n]);
            reached.max[n] = std::min(reached.max[n], box.max[n]);
        }
        // Convert to lengths along the image's axes.
        Vec3 a = image.world_to_index(piece.from), b = image.world_to_index(piece.to), along{};
        for (std::size_t n = 0; n < 3; ++n) {
            if (stroke.axis && std::size_t(*stroke.axis) == n) a[n] = b[n] = stroke.at;
            a[n] *= image.spacing[n];
            along[n] = b[n] * image.spacing[n] - a[n];
        }
        const double length2 = lengths.dot(along, along);
        const double radius2 = stroke.radius * stroke.radius * (1 + 1e-9);
        for (int k = reached.min[2]; k <= reached.max[2]; ++k)
            for (int j = reached.min[1]; j <= reached.max[1]; ++j)
                for (int i = reached.min[0]; i <= reached.max[0]; ++i) {
                    const Vec3 d{i * image.spacing[0] - a[0], j * image.spacing[1] - a[1], k * image.spacing[2] - a[2]};
                    const double part = length2 > 0 ? std::clamp(lengths.dot(d, along) / length2, 0.0, 1.0) : 0;
                    const Vec3 off{d[0] - part * along[0], d[1] - part * along[1], d[2] - part * along[2]};
                    if (lengths.dot(off, off) > radius2) continue;
                    const std::size_t row =
                        std::size_t(k - box.min[2]) * std::size_t(size[1]) + std::size_t(j - box.min[1]);
                    out[row * std::size_t(size[0]) + std::size_t(i - box.min[0])] = stroke.erases ? 0 : 1;
                }
    });
}

}  // namespace

namespace detail {

void require_paintable(const StudyStructure& structure, const ImageGeometry& image) {
    const StudyStroke& stroke = structure.strokes.back();
    if (!(stroke.radius > 0) || !std::isfinite(stroke.radius)) refuse("a brush needs a radius > 0");
    if (stroke.axis &&
        (*stroke.axis < 0 || *stroke.axis > 2 || stroke.at < 0 || stroke.at >= image.size[std::size_t(*stroke.axis)]))
        refuse("a stroke does not lie on a slice of the image");
    double length = 0;
    for (std::size_t n = 1; n < stroke.world.size(); ++n) length += distance(stroke.world[n - 1], stroke.world[n]);
    double visits = 0;
    // Checked before the stroke is split into pieces: for a very thin brush there would be too many of them.
    if (length / stroke.radius > kMaxVisits / 16) refuse("a stroke is too long for such a thin brush");
    each_piece(stroke, [&](const Piece& piece) { visits += 1 + voxels_in(box_around(piece, stroke, image)); });
    if (visits > kMaxVisits) refuse("a stroke covers too many voxels: use a smaller brush, or a shorter stroke");
    if (const VoxelBox box = box_around(structure, image); box.max[0] >= box.min[0] && voxels_in(box) > kMaxVoxels)
        refuse("the paint of '" + structure.name +
               "' would span more than 268 million voxels: paint distant parts as separate structures");
}

}  // namespace detail

std::optional<Image> paint_of(const StudyStructure& structure, const ImageGeometry& image) {
    VoxelBox box = box_around(structure, image);
    if (box.max[0] < box.min[0]) return {};
    for (std::size_t n = 0; n < 3; ++n) {
        box.min[n] = std::max(0, box.min[n] - kMargin);
        box.max[n] = std::min(image.size[n] - 1, box.max[n] + kMargin);
    }
    std::vector<std::uint8_t> values(std::size_t(voxels_in(box)));
    for (const StudyStroke& stroke : structure.strokes) draw(stroke, image, box, values);
    if (std::find(values.begin(), values.end(), 1) == values.end()) return {};
    return Image::from_values(cropped(image, box), values.data());
}

}  // namespace covol
