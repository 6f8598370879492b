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
    World,     ///< the image's physical space, LPS where it is anatomical
    Index,     ///< voxels of the image, from 0, centres at integers
    Ras,       ///< world, with x and y towards right and anterior: both signs are turned on reading
    IndexOne,  ///< voxels counted from 1: 1 is taken away on reading
    Local,     ///< lengths along the image's axes from the centre of voxel 0: the origin is left out, as Fiji does
    Slices     ///< x and y as in Local, z a slice from 0 (Fiji's Results)
};
template <>
inline constexpr auto kWords<PointSpace> = std::array{
    static_cast<const char*>(nullptr), "world", "index", "ras", "index1", "local", static_cast<const char*>(nullptr)};
enum class PointOrder { Unstated, XYZ, ZYX };
template <>
inline constexpr auto kWords<PointOrder> = std::array{static_cast<const char*>(nullptr), "xyz", "zyx"};

struct ReadPointsOptions {
    PointSpace space = PointSpace::Unstated;  ///< Unstated: what the format says, else World.
    PointOrder order = PointOrder::Unstated;  ///< Unstated: what the format says, else XYZ.
    double scale = 1;                         ///< Multiplies lengths (not voxels): 0.001 for micrometres to mm.
    int channels = 1;                         ///< z / channels is the slice: Fiji counts a multi-point's positions
                                              ///< through a hyperstack's channels too. Points in voxels alone.
};

template <>
inline constexpr auto kOptions<ReadPointsOptions> = std::tuple{
    Option{
        "points_space", &ReadPointsOptions::space, Group::ReadingMarks,
        "coordinates are world units (LPS), the same in RAS, voxels from 0, voxels from 1, or lengths from the first "
        "voxel",
        "what the format says, else world"},
    Option{"points_order", &ReadPointsOptions::order, Group::ReadingMarks, "order of the coordinates",
           "what the format says, else xyz"},
    Option{"points_scale", &ReadPointsOptions::scale, kPositive, Group::ReadingMarks,
           "multiplies the points' lengths, 0.001 for micrometres to mm"},
    Option{"points_channels", &ReadPointsOptions::channels, between(1, 1000), Group::ReadingMarks,
           "channels of the hyperstack that a Fiji multi-point was clicked in"}};

/// An ordered line of marks: the points [begin, end) of a cloud, as a person clicked them along a border.
struct MarkLine {
    std::size_t begin = 0, end = 0;
    bool closed = true;  ///< the last mark joins the first
    std::string name;    ///< the file's own name for it, or empty
};

/// Points as a file gives them: x, y, z in `space`.
struct PointCloud {
    std::vector<Vec3> points;
    std::vector<MarkLine> lines;  ///< what the file says of their order; empty for loose points
    std::vector<Vec3>
        normals;  ///< unit, one for each point, 0 where the file has none that is a direction; empty: no normals
    std::optional<Vec3> sensor;            ///< where a scan was taken from; both in World alone
    PointSpace space = PointSpace::World;  ///< World, Index, Local or Slices
    ReadPointsOptions reading;             ///< how the file's coordinates became these
    bool stated = false;                   ///< the format or the caller said so; else `reading` is a guess
    std::string source;                    ///< path, for messages
    std::string rule;                      ///< how coordinates were understood, one line for people
    std::string unit = {};  ///< of lengths, "mm"; empty: nobody says, or the caller gave a scale. to_world() turns it
                            ///< into the image's
};

/// Reads, by the name's end:
/// - .xyz .txt .pts .asc .csv .tsv: columns, by name where there is a header: x, y, z; slice, contour, x_px, y_px;
///   napari's points and shapes; Fiji's Results (X, Y, Slice)
/// - .roi, .zip: Fiji's selections. .mrk.json, .fcsv: 3D Slicer. .annot: ITK-SNAP. .landmarks, .lmk: Convert3D
/// - .dcm: the contours of a DICOM RT structure set
/// - .ply (ascii, both binary byte orders), .obj, .off: their vertices. .pcd, .las: scans
/// Normals: nx, ny, nz of PLY and of columns, columns 4 to 6 of six without names where all are unit vectors, normal_x,
/// normal_y, normal_z of PCD, vn of an OBJ that has one for each vertex. The sensor: VIEWPOINT of a PCD that is
/// organised or says another one than 0 0 0, which writers put where they know none.
///
/// Each format's own coordinate rule is applied and told in `rule`; the options go before it.
/// @throws Error Io, InvalidInput (with path:line: text instead of numbers, NaN, truncated, no point), Unsupported.
[[nodiscard]] COVOL_API PointCloud read_points(const std::string& path, const ReadPointsOptions& options = {});

/// World positions; points in voxels or on slices are mapped by the image's geometry.
[[nodiscard]] COVOL_API std::vector<Vec3> to_world(const PointCloud& cloud, const ImageGeometry& geometry);
/// @throws Error InvalidInput when points need an image.
[[nodiscard]] COVOL_API std::vector<Vec3> to_world(const PointCloud& cloud);

/// Tries the usual mistakes where a point lies outside the image: order of the axes, voxels for world units and the
/// reverse, voxels counted from 1, RAS for LPS, an origin left out, micrometres for millimetres, and two of them.
/// Where all lie inside, warns through `run` when another reading is far more plausible, or the image has no spacing.
/// @throws Error InvalidInput when a point lies outside: how many of how many, both boxes, and the fields of
///         ReadPointsOptions, or the image's spacing, that would mend it.
COVOL_API void check_inside(const PointCloud& cloud, const ImageGeometry& geometry, const RunContext& run = {});

/// Exact duplicates, and points closer than `cell` / 2 in the same cell of a lattice of edge `cell`, become one.
/// The first of each stays; the order stays. cell = 0 removes exact duplicates only.
[[nodiscard]] COVOL_API std::vector<Vec3> merge_close_points(const std::vector<Vec3>& points, double cell);

/// Indices of points along a Z curve through 1024^3 cells of their box: those that follow each other lie close. Of more
/// than `most`, so many of them, evenly out of that order: the cloud thins by the same share everywhere.
/// @throws Error InvalidOptions (most = 0), InvalidInput (2^32 points and more).
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
/// Marks of 10 to 4,000 that lie apart from all others, alone or at most three together, a tenth of them at most: where
/// a click went astray. Single linkage: what joins such marks to the others is more than twice as long as the longest
/// link between these, or six times the median link. @return the farthest first
[[nodiscard]] COVOL_API std::vector<IsolatedPoint> find_isolated_points(const std::vector<Vec3>& points);

/// Writes .xyz, .csv or binary .ply by the name's end; whole or not at all.
COVOL_API void write_points(const std::string& path, const std::vector<Vec3>& points, const std::string& comment = {});

}  // namespace covol
