#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/fwd.h"
#include "covol/image.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

enum class PointSpace {
    Unstated,
    World,     ///< the image's physical space; LPS if it is anatomical
    Index,     ///< voxels of the image, from 0, centres at integers
    Ras,       ///< world, with x and y towards right and anterior: the signs of both are flipped on reading
    IndexOne,  ///< voxels counted from 1: 1 is subtracted on reading
    Local,     ///< lengths along the image's axes from the centre of voxel 0, without the origin, as in Fiji
    Slices     ///< x and y as in Local, z a slice from 0 (Fiji's Results)
};
template <>
inline constexpr auto kWords<PointSpace> = std::array{
    static_cast<const char*>(nullptr), "world", "index", "ras", "index1", "local", static_cast<const char*>(nullptr)};
enum class PointOrder { Unstated, XYZ, ZYX };
template <>
inline constexpr auto kWords<PointOrder> = std::array{static_cast<const char*>(nullptr), "xyz", "zyx"};

struct ReadPointsOptions {
    PointSpace space = PointSpace::Unstated;  ///< Unstated: as the format specifies, else World.
    PointOrder order = PointOrder::Unstated;  ///< Unstated: as the format specifies, else XYZ.
    double scale = 1;                         ///< Multiplies lengths (not voxels): 0.001 for micrometres to mm.
    /// Number of channels of the hyperstack on which a Fiji multi-point was set. Fiji counts the positions of such
    /// points through all channels of all slices, so the slice is z / channels. Only for points in voxels.
    int channels = 1;
};

template <>
inline constexpr auto kOptions<ReadPointsOptions> =
    std::tuple{Option{"points_space", &ReadPointsOptions::space, Group::ReadingMarks,
                      "meaning of the coordinates: world units (LPS), voxel indices from 0, world units in RAS, voxel "
                      "indices from 1, or lengths from the first voxel",
                      "as defined by the format, else world"},
               Option{"points_order", &ReadPointsOptions::order, Group::ReadingMarks, "order of the coordinates",
                      "as defined by the format, else xyz"},
               Option{"points_scale", &ReadPointsOptions::scale, kPositive, Group::ReadingMarks,
                      "multiplies coordinates that are lengths (not voxels), for example 0.001 for micrometres to mm"},
               Option{"points_channels", &ReadPointsOptions::channels, between(1, 1000), Group::ReadingMarks,
                      "number of channels of the hyperstack on which a Fiji multi-point was set"}};

/// An ordered line of marks: the points [begin, end) of a cloud, in the order in which a person set them along a
/// border.
struct MarkLine {
    std::size_t begin = 0, end = 0;
    bool closed = true;  ///< the last mark joins the first
    std::string name;    ///< its name in the file, or empty
};

/// Points as given by a file: x, y, z in `space`.
struct PointCloud {
    std::vector<Vec3> points;
    std::vector<MarkLine> lines;  ///< their order according to the file; empty for unordered points
    std::vector<Vec3> normals;    ///< unit, one for each point, 0 if the file has no valid direction; empty: no normals
    std::optional<Vec3> sensor;   ///< position from which a scan was taken; like normals, only in World
    PointSpace space = PointSpace::World;  ///< World, Index, Local or Slices
    ReadPointsOptions reading;             ///< how the file's coordinates became these
    bool stated = false;                   ///< the format or the caller specified it; else `reading` is an assumption
    std::string source;                    ///< path, for messages
    std::string rule;                      ///< how coordinates were interpreted, one line for the user
    /// Unit of lengths, "mm"; empty: unknown, or the caller gave a scale. to_world() converts it to the image's unit.
    std::string unit = {};
};

/// Reads, by the file extension:
/// - .xyz .txt .pts .asc .csv .tsv: columns, by name if there is a header: x, y, z; slice, contour, x_px, y_px;
///   napari's points and shapes; Fiji's Results (X, Y, Slice)
/// - .roi, .zip: Fiji's selections. .xml: its Cell Counter. .mrk.json, .fcsv: 3D Slicer. .annot: ITK-SNAP.
///   .landmarks, .lmk: Convert3D
/// - .dcm: the contours of a DICOM RT structure set
/// - .ply (ascii, both binary byte orders), .obj, .off: their vertices. .pcd, .las: scans
/// Normals: nx, ny, nz of PLY and of columns; columns 4 to 6 of six without names, if all are unit vectors; normal_x,
/// normal_y, normal_z of PCD; vn of an OBJ that has one for each vertex. The sensor: VIEWPOINT of a PCD that is
/// organised or states another value than 0 0 0, which writers use if they know none.
///
/// Each format's own coordinate rule is applied and described in `rule`; the options override it.
/// @throws Error Io, InvalidInput (with path:line: text instead of numbers, NaN, truncated, no point), Unsupported.
[[nodiscard]] COVOL_API PointCloud read_points(const std::string& path, const ReadPointsOptions& options = {});

/// World positions; points in voxels or on slices are transformed by the image's geometry.
[[nodiscard]] COVOL_API std::vector<Vec3> to_world(const PointCloud& cloud, const ImageGeometry& geometry);
/// @throws Error InvalidInput if points need an image.
[[nodiscard]] COVOL_API std::vector<Vec3> to_world(const PointCloud& cloud);

/// If a point lies outside the image, tries the usual mistakes: order of the axes, voxels for world units and the
/// reverse, voxels counted from 1, RAS for LPS, a missing origin, micrometres for millimetres, and two of them
/// combined. If all lie inside, warns through `run` if another interpretation is far more plausible, or the image has
/// no spacing.
/// @throws Error InvalidInput if a point lies outside; the message contains how many of how many, both boxes, and the
///     fields of ReadPointsOptions, or the image's spacing, that would correct it.
COVOL_API void check_inside(const PointCloud& cloud, const ImageGeometry& geometry, const RunContext& run = {});

/// Merges exact duplicates, and points closer than `cell` / 2 in the same cell of a lattice of edge `cell`. The first
/// of each group remains; the order is kept. cell = 0 merges exact duplicates only.
[[nodiscard]] COVOL_API std::vector<Vec3> merge_close_points(const std::vector<Vec3>& points, double cell);

/// Indices of the points along a Z curve through 1024^3 cells of their box, so that consecutive points lie close
/// together. If there are more than `maximum`, that many are taken evenly from this order: the cloud is thinned by the
/// same fraction everywhere.
/// @throws Error InvalidOptions (maximum = 0), InvalidInput (2^32 points and more).
[[nodiscard]] COVOL_API std::vector<std::uint32_t> order_spatially(const std::vector<Vec3>& points,
                                                                   std::size_t maximum);

/// Spacing of a cloud, from nearest neighbours of a fixed subsample (world units).
struct SpacingStatistics {
    double mean = 0;  ///< mean distance to the nearest other point
    double median = 0;
    double p95 = 0;
    double max = 0;
};
/// @pre no exact duplicates
[[nodiscard]] COVOL_API SpacingStatistics measure_spacing(const std::vector<Vec3>& points);

struct IsolatedPoint {
    std::size_t index = 0;  ///< among the points
    double distance = 0;    ///< to the nearest of those that are not isolated
};
/// Among at most 4,000 marks, those that lie apart from all others, alone or at most three together, at most a tenth
/// of them, and so none among fewer than 10: probably accidental clicks. Single linkage: the link from such marks to
/// the others is more than twice as long as the longest link between the others, or six times the median link.
/// @return the farthest first
[[nodiscard]] COVOL_API std::vector<IsolatedPoint> find_isolated_points(const std::vector<Vec3>& points);

/// Writes .xyz, .csv or binary .ply, by the file extension; completely or not at all.
COVOL_API void write_points(const std::string& path, const std::vector<Vec3>& points, const std::string& comment = {});

}  // namespace covol
