#include "painted/paint.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace covol::painted {

Paint::Paint(const Image& labels, int label, const VoxelBox& box)
    : box_(box), n_(box.size()), image_(labels.geometry().size) {
    inside_.resize(std::size_t(n_[0]) * std::size_t(n_[1]) * std::size_t(n_[2]));
    tbb::parallel_for(0, n_[2], [&](int k) {
        for (int j = 0; j < n_[1]; ++j)
            for (int i = 0; i < n_[0]; ++i)
                inside_[at({i, j, k})] = labels.at(box.min[0] + i, box.min[1] + j, box.min[2] + k) == label;
    });
    voxels = std::size_t(std::count(inside_.begin(), inside_.end(), 1));
}

Paint::Paint(const Index3& image, const std::vector<Index3>& of) : voxels(of.size()), image_(image) {
    box_ = {of.front(), of.front()};
    for (const Index3& p : of)
        for (int a = 0; a < 3; ++a) {
            box_.min[a] = std::min(box_.min[a], p[a]);
            box_.max[a] = std::max(box_.max[a], p[a]);
        }
    n_ = box_.size();
    inside_.resize(std::size_t(n_[0]) * std::size_t(n_[1]) * std::size_t(n_[2]));
    for (const Index3& p : of) inside_[at({p[0] - box_.min[0], p[1] - box_.min[1], p[2] - box_.min[2]})] = 1;
}

Slice Paint::slice(int axis, int number) const {
    const auto [x, y] = plane(axis);
    Slice cut;
    cut.nx = n_[x];
    cut.ny = n_[y];
    cut.inside.reserve(std::size_t(cut.nx) * std::size_t(cut.ny));
    Index3 p;
    p[axis] = number - box_.min[axis];
    for (p[y] = 0; p[y] < n_[y]; ++p[y])
        for (p[x] = 0; p[x] < n_[x]; ++p[x]) cut.inside.push_back(inside_[at(p)]);
    return cut;
}

std::array<bool, 4> Paint::ends(int axis) const {
    const auto [x, y] = plane(axis);
    return {box_.min[x] == 0, box_.max[x] == image_[x] - 1, box_.min[y] == 0, box_.max[y] == image_[y] - 1};
}

void Paint::erase(int axis, int number) {
    const auto [x, y] = plane(axis);
    Index3 p;
    p[axis] = number - box_.min[axis];
    for (p[y] = 0; p[y] < n_[y]; ++p[y])
        for (p[x] = 0; p[x] < n_[x]; ++p[x]) inside_[at(p)] = 0;
}

bool Paint::holds(const Index3& p) const {
    for (int a = 0; a < 3; ++a)
        if (p[a] < 0 || p[a] >= n_[a]) return false;
    return inside_[at(p)] != 0;
}

bool Paint::is_enclosed(const Index3& p) const {
    for (int a = 0; a < 3; ++a)
        for (const int step : {-1, 1}) {
            Index3 q = p;
            q[a] += step;
            if (!holds(q)) return false;
        }
    return true;
}

std::vector<Vec3> Paint::outer() const {
    std::vector<Vec3> found;
    Index3 p;
    for (p[2] = 0; p[2] < n_[2]; ++p[2])
        for (p[1] = 0; p[1] < n_[1]; ++p[1])
            for (p[0] = 0; p[0] < n_[0]; ++p[0])
                if (holds(p) && !is_enclosed(p))
                    found.push_back(
                        {double(box_.min[0] + p[0]), double(box_.min[1] + p[1]), double(box_.min[2] + p[2])});
    return found;
}

std::vector<Paint> Paint::pieces() const {
    std::vector<Paint> found;
    std::vector<std::uint8_t> left = inside_;
    std::vector<Index3> voxels_of_piece, stack;
    const auto visit = [&](const Index3& p) {
        if (!holds(p) || left[at(p)] == 0) return;
        left[at(p)] = 0;
        stack.push_back(p);
    };
    Index3 first;
    for (first[2] = 0; first[2] < n_[2]; ++first[2])
        for (first[1] = 0; first[1] < n_[1]; ++first[1])
            for (first[0] = 0; first[0] < n_[0]; ++first[0]) {
                visit(first);
                if (stack.empty()) continue;
                voxels_of_piece.clear();
                while (!stack.empty()) {
                    const Index3 p = stack.back();
                    stack.pop_back();
                    voxels_of_piece.push_back({box_.min[0] + p[0], box_.min[1] + p[1], box_.min[2] + p[2]});
                    for (int n = 0; n < 27; ++n) visit({p[0] + n % 3 - 1, p[1] + n / 3 % 3 - 1, p[2] + n / 9 - 1});
                }
                found.push_back(Paint(image_, voxels_of_piece));
            }
    return found;
}

AxisPaint properties_across(const Paint& paint, int axis) {
    const int first = paint.box().min[axis], count = paint.box().size()[axis];
    std::vector<std::vector<Patch>> found(static_cast<std::size_t>(count));
    tbb::parallel_for(0, count, [&](int n) { found[std::size_t(n)] = patches(paint.slice(axis, first + n)); });
    AxisPaint result;
    int run = 0;
    for (int n = 0; n < count; ++n) {
        bool has_area = false, has_stroke = false;
        for (const Patch& patch : found[std::size_t(n)]) {
            has_stroke |= patch.stroke;
            // A patch of width 1, in which no voxel is surrounded by others, gives little information about a
            // cross-section.
            if (patch.stroke || patch.width == 1) continue;
            has_area = true;
            result.widest = std::max(result.widest, patch.width);
        }
        run = has_area ? run + 1 : 0;
        result.longest_run = std::max(result.longest_run, run);
        if (has_area) result.areas.push_back(first + n);
        if (found[std::size_t(n)].empty()) continue;
        result.painted.push_back(first + n);
        std::size_t voxels = 0;
        for (const Patch& patch : found[std::size_t(n)]) voxels += patch.area;
        result.voxels.push_back(voxels);
        result.small.push_back(!has_area && !has_stroke);
    }
    return result;
}

}  // namespace covol::painted
