// Computes label images of solids, box by box.
#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <mutex>

#include "covol/error.h"
#include "covol/structures.h"
#include "surface/rasterizer.h"

namespace covol {
namespace {

using openvdb::Coord;
using Accessor = FloatGrid::ConstAccessor;

/// Trilinear samples of the structures' signed distances at world positions.
class Distances {
public:
    explicit Distances(const std::vector<Structure>& structures) {
        for (const Structure& s : structures) {
            accessors_.push_back(s.surface->getConstAccessor());
            transforms_.push_back(&s.surface->transform());
        }
    }
    [[nodiscard]] float operator()(std::size_t n, const Vec3& world) const {
        const openvdb::Vec3d at = transforms_[n]->worldToIndex(openvdb::Vec3d(world[0], world[1], world[2]));
        const Coord base = Coord::floor(at);
        const openvdb::Vec3d t = at - base.asVec3d();
        double sum = 0;
        for (int corner = 0; corner < 8; ++corner) {
            const Coord c(corner & 1, corner >> 1 & 1, corner >> 2);
            double weight = 1;
            for (int a = 0; a < 3; ++a) weight *= c[a] != 0 ? t[a] : 1 - t[a];
            if (weight != 0) sum += weight * accessors_[n].getValue(base + c);
        }
        return static_cast<float>(sum);
    }

private:
    std::vector<Accessor> accessors_;
    std::vector<const openvdb::math::Transform*> transforms_;
};

constexpr std::uint8_t kContested = 255;

/// Decides which structure a voxel belongs to if several structures claim it, or if none does but it lies between two
/// that touch. A structure claims the voxels whose centres are inside its surface.
class ConflictResolver {
public:
    /// @param box  the box of `claims`: the box of the voxels to be decided, enlarged by one voxel on every side within
    ///     the image
    ConflictResolver(const std::vector<Structure>& structures, const ImageGeometry& geometry, const VoxelBox& box,
                     const std::vector<std::uint8_t>& claims)
        : structures_(structures), geometry_(geometry), box_(box), claims_(claims), distances_(structures) {
        touching_ = 0.5F * static_cast<float>(structures.front().surface->voxelSize()[0]);
    }

    [[nodiscard]] std::uint8_t decide(int i, int j, int k) const {
        const std::uint8_t claim = claims_[at(i, j, k)];
        if (claim != 0 && claim != kContested) return claim;
        const std::vector<std::size_t> candidates = claim == kContested ? all_structures() : neighbours(i, j, k);
        if (candidates.size() < 2) return 0;
        const Vec3 world = geometry_.index_to_world({double(i), double(j), double(k)});
        std::size_t best = 0;
        float first = std::numeric_limits<float>::max(), second = first;
        for (const std::size_t n : candidates) {
            const float d = distances_(n, world);
            if (d < first || (d == first && structures_[n].name < structures_[best].name)) {
                second = first;
                first = d;
                best = n;
            } else {
                second = std::min(second, d);
            }
        }
        return claim == kContested || first + second < touching_ ? static_cast<std::uint8_t>(best + 1) : 0;
    }

private:
    [[nodiscard]] std::size_t at(int i, int j, int k) const {
        const Index3 size = box_.size();
        return (std::size_t(k - box_.min[2]) * size[1] + (j - box_.min[1])) * size[0] + (i - box_.min[0]);
    }
    [[nodiscard]] std::vector<std::size_t> all_structures() const {
        std::vector<std::size_t> all(structures_.size());
        for (std::size_t n = 0; n < all.size(); ++n) all[n] = n;
        return all;
    }
    /// The structures that claim at least one of the six neighbours of voxel (i,j,k), ascending. If the voxel lies
    /// between two structures that touch, both are among them.
    [[nodiscard]] std::vector<std::size_t> neighbours(int i, int j, int k) const {
        std::vector<std::size_t> found;
        const Index3 here{i, j, k};
        for (int face = 0; face < 6; ++face) {
            Index3 c = here;
            c[face / 2] += face % 2 == 0 ? -1 : 1;
            if (c[face / 2] < 0 || c[face / 2] >= geometry_.size[face / 2]) continue;
            const std::uint8_t label = claims_[at(c[0], c[1], c[2])];
            if (label == 0 || label == kContested) continue;
            if (std::find(found.begin(), found.end(), std::size_t(label - 1)) == found.end())
                found.push_back(label - 1);
        }
        std::sort(found.begin(), found.end());
        return found;
    }

    const std::vector<Structure>& structures_;
    const ImageGeometry& geometry_;
    const VoxelBox box_;
    const std::vector<std::uint8_t>& claims_;
    Distances distances_;
    float touching_;
};

/// The type for values of structures: bytes if all of them fit.
PixelType type_of(const std::vector<int>& values) {
    return std::all_of(values.begin(), values.end(), [](int v) { return v >= 0 && v <= 255; }) ? PixelType::UInt8
                                                                                               : PixelType::Int32;
}

std::vector<int> counted_up(std::vector<int> values, std::size_t count) {
    for (std::size_t n = values.size(); n < count; ++n) values.push_back(int(n) + 1);
    return values;
}

void check_count(const std::vector<Structure>& structures) {
    if (structures.size() >= kContested)
        throw Error(Errc::InvalidInput, "structures: expected at most 254, got " + std::to_string(structures.size()));
}

/// Computes the number of each voxel's structure, counted from 1; 0 if the voxel belongs to none.
class Numbers {
public:
    Numbers(const std::vector<Structure>& structures, const ImageGeometry& geometry)
        : structures_(structures), geometry_(geometry) {
        check_count(structures);
        for (const Structure& s : structures)
            solids_.push_back(std::make_unique<detail::Rasterizer>(*s.surface, geometry_));
    }

    /// @param out  the numbers, i fastest; must contain zeros before
    void fill(const VoxelBox& box, std::uint8_t* out) const {
        if (solids_.size() == 1) return solids_.front()->fill(box, 1, out);
        if (solids_.empty()) return;
        const VoxelBox wide = widened(box);
        const Index3 size = wide.size();
        const std::size_t count = std::size_t(size[0]) * size[1] * size[2];
        std::vector<std::uint8_t> claims(count, 0), solid(count);
        for (std::size_t n = 0; n < solids_.size(); ++n) {
            if (solids_[n]->uniform(wide) == false) continue;
            std::fill(solid.begin(), solid.end(), 0);
            solids_[n]->fill(wide, 1, solid.data());
            for (std::size_t v = 0; v < count; ++v)
                if (solid[v] != 0) claims[v] = claims[v] == 0 ? static_cast<std::uint8_t>(n + 1) : kContested;
        }
        const ConflictResolver arbiter(structures_, geometry_, wide, claims);
        for (int k = box.min[2]; k <= box.max[2]; ++k)
            for (int j = box.min[1]; j <= box.max[1]; ++j)
                for (int i = box.min[0]; i <= box.max[0]; ++i) *out++ = arbiter.decide(i, j, k);
    }

    [[nodiscard]] std::optional<std::uint8_t> uniform(const VoxelBox& box) const {
        const VoxelBox wide = solids_.size() > 1 ? widened(box) : box;
        std::uint8_t number = 0;
        for (std::size_t n = 0; n < solids_.size(); ++n) {
            const std::optional<bool> inside = solids_[n]->uniform(wide);
            if (!inside || (*inside && number != 0)) return std::nullopt;
            if (*inside) number = static_cast<std::uint8_t>(n + 1);
        }
        return number;
    }

private:
    /// The box, enlarged by one voxel on every side within the image. ConflictResolver needs the neighbours of a voxel
    /// to recognise that it lies between two structures.
    [[nodiscard]] VoxelBox widened(VoxelBox box) const {
        for (int a = 0; a < 3; ++a) {
            box.min[a] = std::max(box.min[a] - 1, 0);
            box.max[a] = std::min(box.max[a] + 1, geometry_.size[a] - 1);
        }
        return box;
    }

    const std::vector<Structure>& structures_;
    const ImageGeometry geometry_;
    std::vector<std::unique_ptr<detail::Rasterizer>> solids_;
};

/// The voxels of one structure written so far.
struct Written {
    std::uint64_t voxels = 0;
    VoxelBox extent;

    void add(int first, int last, int j, int k) {
        const VoxelBox run{{first, j, k}, {last, j, k}};
        add({std::uint64_t(last - first) + 1, run});
    }
    void add(const Written& other) {
        if (other.voxels == 0) return;
        for (int a = 0; a < 3; ++a) {
            extent.min[a] = voxels == 0 ? other.extent.min[a] : std::min(extent.min[a], other.extent.min[a]);
            extent.max[a] = voxels == 0 ? other.extent.max[a] : std::max(extent.max[a], other.extent.max[a]);
        }
        voxels += other.voxels;
    }
};

}  // namespace

struct LabelImage::State {
    State(std::vector<Structure> given, const ImageGeometry& geometry, std::vector<int> given_values, bool with_names)
        : structures(std::move(given)),
          values(std::move(given_values)),
          named(with_names),
          numbers(structures, geometry),
          written(structures.size()) {}

    /// Adds the voxels of each structure to `found`. Runs of voxels with the same value along i are added at once.
    /// @param row  the values of `box`, i fastest
    template <typename T>
    void count(const VoxelBox& box, const T* row, std::vector<Written>& found) const {
        const int length = box.size()[0];
        for (int k = box.min[2]; k <= box.max[2]; ++k)
            for (int j = box.min[1]; j <= box.max[1]; ++j, row += length)
                for (int i = 0; i < length;) {
                    int end = i + 1;
                    while (end < length && row[end] == row[i]) ++end;
                    if (row[i] != 0) {
                        const auto n = std::find(values.begin(), values.end(), int(row[i])) - values.begin();
                        found[std::size_t(n)].add(box.min[0] + i, box.min[0] + end - 1, j, k);
                    }
                    i = end;
                }
    }

    const std::vector<Structure> structures;
    const std::vector<int> values;
    const bool named;
    const Numbers numbers;
    std::mutex lock;
    std::vector<Written> written;
};

LabelImage::LabelImage(std::vector<Structure> structures, const ImageGeometry& geometry, std::vector<int> values,
                       bool named)
    : PixelSource(geometry, type_of(values), true) {
    values = counted_up(std::move(values), structures.size());
    state_ = std::make_unique<State>(std::move(structures), geometry, std::move(values), named);
}
LabelImage::~LabelImage() = default;

void LabelImage::fill(const VoxelBox& box, void* out) const {
    const Index3 size = box.size();
    const std::size_t count = std::size_t(size[0]) * size[1] * size[2];
    if (type() == PixelType::UInt8) {
        auto* bytes = static_cast<std::uint8_t*>(out);
        std::fill_n(bytes, count, 0);
        state_->numbers.fill(box, bytes);
        std::array<std::uint8_t, 256> value{};
        for (std::size_t n = 0; n < state_->values.size(); ++n)
            value[n + 1] = static_cast<std::uint8_t>(state_->values[n]);
        std::transform(bytes, bytes + count, bytes, [&](std::uint8_t number) { return value[number]; });
        return;
    }
    std::vector<std::uint8_t> numbers(count, 0);
    state_->numbers.fill(box, numbers.data());
    std::transform(numbers.begin(), numbers.end(), static_cast<std::int32_t*>(out),
                   [&](std::uint8_t number) { return number == 0 ? 0 : state_->values[number - 1U]; });
}

std::optional<double> LabelImage::uniform(const VoxelBox& box) const {
    const std::optional<std::uint8_t> number = state_->numbers.uniform(box);
    if (!number) return std::nullopt;
    return *number == 0 ? 0 : state_->values[*number - 1U];
}

std::optional<std::array<double, 2>> LabelImage::range() const {
    double low = 0, high = 0;
    for (const int value : state_->values) {
        low = std::min(low, double(value));
        high = std::max(high, double(value));
    }
    return std::array<double, 2>{low, high};
}

void LabelImage::wrote(const VoxelBox& box, const void* values, double uniform) const {
    if (values == nullptr && uniform == 0) return;
    std::vector<Written> found(state_->values.size());
    if (values == nullptr) {
        const auto n = std::find(state_->values.begin(), state_->values.end(), int(uniform)) - state_->values.begin();
        const Index3 size = box.size();
        found[std::size_t(n)].add({std::uint64_t(size[0]) * std::uint64_t(size[1]) * std::uint64_t(size[2]), box});
    } else if (type() == PixelType::UInt8) {
        state_->count(box, static_cast<const std::uint8_t*>(values), found);
    } else {
        state_->count(box, static_cast<const std::int32_t*>(values), found);
    }
    const std::lock_guard guard(state_->lock);
    for (std::size_t n = 0; n < found.size(); ++n) state_->written[n].add(found[n]);
}

std::vector<std::uint64_t> LabelImage::voxels_written() const {
    std::vector<std::uint64_t> voxels;
    for (const Written& w : state_->written) voxels.push_back(w.voxels);
    return voxels;
}

std::vector<std::pair<std::string, std::string>> LabelImage::metadata() const {
    if (!state_->named) return {};
    std::vector<std::string> names;
    std::vector<VoxelBox> extents;
    const bool before =
        std::all_of(state_->written.begin(), state_->written.end(), [](const Written& w) { return w.voxels == 0; });
    const Index3 size = geometry().size;
    const Index3 last{size[0] - 1, size[1] - 1, size[2] - 1};
    for (std::size_t n = 0; n < state_->structures.size(); ++n) {
        names.push_back(state_->structures[n].name);
        // Before any voxel is written, the extents are not known. The largest indices are used instead, because the
        // header must not become longer when the extents are filled in.
        extents.push_back(before ? VoxelBox{last, last} : state_->written[n].extent);
    }
    return make_slicer_segments(names, extents, state_->values);
}

std::vector<NamedLabel> LabelImage::label_names() const {
    std::vector<NamedLabel> labels;
    for (std::size_t n = 0; n < state_->structures.size() && state_->named; ++n)
        labels.push_back({state_->values[n], state_->structures[n].name, structure_color(n)});
    return labels;
}

std::vector<std::uint8_t> make_label_image(const std::vector<Structure>& structures, const ImageGeometry& geometry,
                                           const RunContext& run) {
    check_count(structures);
    const auto [ni, nj, nk] = geometry.size;
    std::vector<std::uint8_t> labels(std::size_t(ni) * std::size_t(nj) * std::size_t(nk), 0);
    with_threads(run, [&, ni = ni, nj = nj, nk = nk] {
        run.check();
        const Numbers numbers(structures, geometry);
        // Slabs of several slices: each slab is rasterized with one more slice on both sides, which would triple the
        // work for slabs of one slice.
        constexpr int kSlab = 8;
        tbb::parallel_for(0, (nk + kSlab - 1) / kSlab, [&](int slab) {
            const int first = slab * kSlab;
            numbers.fill({{0, 0, first}, {ni - 1, nj - 1, std::min(first + kSlab, nk) - 1}},
                         labels.data() + std::size_t(first) * nj * ni);
        });
    });
    return labels;
}

}  // namespace covol
