#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/fwd.h"
#include "covol/image.h"
#include "covol/image_stream.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

/// One of several solids.
struct Structure {
    std::string name;      ///< name given by the user; not empty, unique
    FloatGridPtr surface;  ///< as extract_surface() makes it: a signed distance, negative inside
};

struct SeparateOptions {
    /// gaps narrower than this are closed, world units; 0: no gap is closed; automatic: 1 voxel
    std::optional<double> gap;
    /// in (0.5,1]: a solid is carved out of a larger one that contains at least this fraction of it
    double nested_fraction = 0.9;
};

template <>
inline constexpr auto kOptions<SeparateOptions> =
    std::tuple{Option{"gap", &SeparateOptions::gap, kNotNegative},
               Option{"nested_share", &SeparateOptions::nested_fraction, Range{0.5, 1, true}}};

/// Two structures that overlapped.
struct StructureOverlap {
    std::size_t a = 0, b = 0;          ///< a < b
    double volume = 0;                 ///< volume that belongs to both, world units^3
    std::optional<std::size_t> inner;  ///< the structure that was carved out of the other
};

struct SeparateReport {
    std::vector<StructureOverlap> overlaps;
    std::vector<bool> changed;  ///< for each structure: whether its surface was changed
};

struct SeparateResult {
    std::vector<FloatGridPtr> surfaces;  ///< in the structures' order; unchanged ones are the same grids
    SeparateReport report;
};

/// Makes solids disjoint, and closes gaps between them that are narrower than SeparateOptions::gap.
///
/// With φ_i the signed distances and m = min over j≠i of φ_j, a voxel where φ_i + m is below 0 (an overlap), or is
/// below the gap width while the voxel lies between the two surfaces (∇φ_i·∇φ_j < 0), gets φ_i' = (φ_i − m)/2: the new
/// interface is the middle surface φ_i = φ_j, near which φ_i' = −φ_j'. For deep overlaps, the distances are computed to
/// the necessary depth. A solid inside another one is carved out of it instead: φ' = max(φ_outer, −φ_inner). Changed
/// surfaces are redistanced by extract_surface(). The result does not depend on the structures' order or on the number
/// of threads.
///
/// @throws Error InvalidOptions; InvalidInput (names empty or not unique; grids whose transforms differ; two identical
/// solids; a solid of which nothing remains).
[[nodiscard]] COVOL_API SeparateResult separate(const std::vector<Structure>& structures,
                                                const SeparateOptions& options = {}, const RunContext& run = {});

/// Label image in the given geometry (i fastest): n + 1 in voxels whose centre lies in structures[n], else 0.
/// If solids overlap at a centre, or if it lies in no solid but between two that touch, the voxel belongs to the solid
/// with the smallest signed distance there (at equal distances, to the one whose name comes first).
/// @throws Error InvalidInput (more than 254 structures).
[[nodiscard]] COVOL_API std::vector<std::uint8_t> make_label_image(const std::vector<Structure>& structures,
                                                                   const ImageGeometry& geometry,
                                                                   const RunContext& run = {});

/// The label image that make_label_image() returns, for writing box by box (covol/image_stream.h), so that it is never
/// completely in memory.
class COVOL_API LabelImage : public PixelSource {
public:
    /// @param values  label values of the structures, instead of 1, 2, ...; the type is int32 if one is below 0 or
    /// above 255, else uint8
    /// @param named  whether names and colours are stored if the format supports them
    /// @throws Error InvalidInput (more than 254 structures).
    LabelImage(std::vector<Structure> structures, const ImageGeometry& geometry, std::vector<int> values = {},
               bool named = true);
    ~LabelImage() override;

    void fill(const VoxelBox& box, void* out) const override;
    [[nodiscard]] std::optional<double> uniform(const VoxelBox& box) const override;
    [[nodiscard]] std::optional<std::array<double, 2>> range() const override;
    void wrote(const VoxelBox& box, const void* values, double uniform) const override;
    [[nodiscard]] std::vector<std::pair<std::string, std::string>> metadata() const override;
    [[nodiscard]] std::vector<NamedLabel> label_names() const override;

    /// Number of voxels of each structure written so far.
    [[nodiscard]] std::vector<std::uint64_t> voxels_written() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Unique names of grids, of the form [A-Za-z_][A-Za-z0-9_]*, for the structures. The grid of a single structure is
/// called "surface".
[[nodiscard]] COVOL_API std::vector<std::string> make_grid_names(const std::vector<std::string>& names);

/// A colour for structure n, red, green and blue in [0,255]; the first twelve are clearly distinct.
[[nodiscard]] COVOL_API std::array<std::uint8_t, 3> structure_color(std::size_t n);

/// Key/value pairs for the header of an NRRD label image, with which 3D Slicer reads it as a segmentation (.seg.nrrd):
/// names, colours, label values and extents.
/// @param extents  the box of each structure's voxels; from 0 to -1 if it has no voxels
/// @param values  label values in the file; empty: 1, 2, ...
[[nodiscard]] COVOL_API std::vector<std::pair<std::string, std::string>> make_slicer_segments(
    const std::vector<std::string>& names, const std::vector<VoxelBox>& extents, const std::vector<int>& values = {});

/// The content of a label description file of ITK-SNAP, for the labels 1, 2, ... or those in `values`.
[[nodiscard]] COVOL_API std::string make_itksnap_labels(const std::vector<std::string>& names,
                                                        const std::vector<int>& values = {});

}  // namespace covol
