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
    Ras,       ///< world units, with x towards right and y towards anterior: the signs of both are flipped on reading
    IndexOne,  ///< voxels counted from 1: 1 is subtracted on reading
    Local,  ///< lengths along the image's axes from the centre of voxel (0,0,0), regardless of the image's origin, as
            ///< in Fiji
    Slices  ///< x and y as for Local, z is the index of a slice, from 0 (Fiji's Results)
};
template <>
inline constexpr auto kWords<PointSpace> = std::array{
    static_cast<const char*>(nullptr), "world", "index", "ras", "index1", "local", static_cast<const char*>(nullptr)};
enum class PointOrder { Unstated, XYZ, ZYX };
template <>
inline constexpr auto kWords<PointOrder> = std::array{static_cast<const char*>(nullptr), "xyz", "zyx"};

struct ReadPointsOptions {
    PointSpace space = PointSpace::Unstated;  ///< Unstated: as the file format specifies, else World.
    PointOrder order = PointOrder::Unstated;  ///< Unstated: as the file format specifies, else XYZ.
    /// Factor of coordinates that are lengths (not voxels), for example 0.001 for micrometres to mm.
    double scale = 1;
    /// Number of channels of the hyperstack on which multi-points or markers of Cell Counter were set in Fiji. Fiji
    /// numbers all channels of all slices consecutively, so that the slice is z / channels. Only for points in voxels.
    int channels = 1;
};

template <>
inline constexpr auto kOptions<ReadPointsOptions> = std::tuple{
    Option{"points_space", &ReadPointsOptions::space, Group::ReadingMarks,
           "meaning of the coordinates: world units (LPS), voxel indices from 0, world units in RAS, voxel "
           "indices from 1, or lengths from the first voxel",
           "as defined by the format, else world"},
    Option{"points_order", &ReadPointsOptions::order, Group::ReadingMarks, "order of the coordinates",
           "as defined by the format, else xyz"},
    Option{"points_scale", &ReadPointsOptions::scale, kPositive, Group::ReadingMarks,
           "multiplies coordinates that are lengths (not voxels), for example 0.001 for micrometres to mm"},
    Option{"points_channels", &ReadPointsOptions::channels, between(1, 1000), Group::ReadingMarks,
           "number of channels of the hyperstack on which multi-points or Cell Counter markers were set in Fiji"}};

/// An ordered line of marks along a border: the points [begin, end) of a cloud.
struct MarkLine {
    std::size_t begin = 0, end = 0;
    bool closed = true;  ///< the last mark joins the first
    std::string name;    ///< its name in the file, or empty
};

/// Points from a file: x, y, z in the coordinates `space`.
struct PointCloud {
    std::vector<Vec3> points;
    std::vector<MarkLine> lines;  ///< the lines of the file; empty for unordered points
    /// unit normals, one for each point, 0 if the file has no valid direction; empty: no normals
    std::vector<Vec3> normals;
    std::optional<Vec3> sensor;  ///< position from which a scan was taken; sensor and normals only occur in World
    PointSpace space = PointSpace::World;  ///< World, Index, Local or Slices
    ReadPointsOptions reading;             ///< the options with which the file's coordinates were interpreted
    /// whether the format or the caller specified both the space of the coordinates and the order of the axes; false:
    /// one or both are assumed
    bool stated = false;
    std::string source;  ///< path, for messages
    std::string rule;    ///< how coordinates were interpreted, one line for the user
    /// Unit of lengths, "mm"; empty: unknown, or the caller gave a scale. to_world() converts it to the image's unit.
    std::string unit = {};
};

/// Reads points, by the file extension:
/// - .xyz .txt .pts .asc .csv .tsv: columns, by name if there is a header: x, y, z; slice, contour, x_px, y_px;
///   napari's points and shapes; Fiji's Results (X, Y, Slice)
/// - .roi, .zip: Fiji's selections. .xml: its Cell Counter. .mrk.json, .fcsv: 3D Slicer. .annot: ITK-SNAP.
///   .landmarks, .lmk: Convert3D
/// - .dcm: the contours of a DICOM RT structure set
/// - .ply (ascii, both binary byte orders), .obj, .off: their vertices. .pcd, .las: scans
/// Normals are read from: nx, ny, nz of PLY and of columns; columns 4 to 6 of six columns without names, if all of them
/// are unit vectors; normal_x, normal_y, normal_z of PCD; vn of an OBJ that has one for each vertex. The sensor's
/// position is VIEWPOINT of a PCD, unless that is 0 0 0 in a PCD that is not organised: files without a known viewpoint
/// contain this value.
///
/// Coordinates are interpreted as the format specifies, unless the options override this; `rule` describes the result.
/// @throws Error Io, InvalidInput (with path:line: text instead of numbers, NaN, truncated, no point), Unsupported.
[[nodiscard]] COVOL_API PointCloud read_points(const std::string& path, const ReadPointsOptions& options = {});

/// World positions; points in voxels or on slices are transformed by the image's geometry.
[[nodiscard]] COVOL_API std::vector<Vec3> to_world(const PointCloud& cloud, const ImageGeometry& geometry);
/// World positions without an image. @throws Error InvalidInput if the points need an image.
[[nodiscard]] COVOL_API std::vector<Vec3> to_world(const PointCloud& cloud);

/// Checks whether the points lie inside the image. If one does not, the usual mistakes, single and in pairs, are
/// tested: order of the axes, voxels for world units and the reverse, voxels counted from 1, RAS for LPS, a missing
/// origin, micrometres for millimetres. If all points lie inside, warns through `run` if another interpretation is far
/// more plausible, or the image has no spacing.
/// @throws Error InvalidInput if a point lies outside; the message contains the numbers of points outside and in total,
/// both boxes, and the values of ReadPointsOptions, or the image's spacing, that would correct it.
COVOL_API void check_inside(const PointCloud& cloud, const ImageGeometry& geometry, const RunContext& run = {});

/// Merges exact duplicates, and points closer than `cell` / 2 in the same cell of a lattice of edge `cell`. The first
/// of each group remains; the order is kept. cell = 0 merges exact duplicates only.
[[nodiscard]] COVOL_API std::vector<Vec3> merge_close_points(const std::vector<Vec3>& points, double cell);

/// Indices of the points in the order of a Z curve through 1024^3 cells of their box, in which consecutive points lie
/// close together. If there are more than `maximum` points, `maximum` of them are taken evenly from this order, so that
/// the cloud is thinned by the same fraction everywhere.
/// @throws Error InvalidOptions (maximum = 0), InvalidInput (2^32 points or more).
[[nodiscard]] COVOL_API std::vector<std::uint32_t> order_spatially(const std::vector<Vec3>& points,
                                                                   std::size_t maximum);

/// Distances to the nearest other point, for a fixed subsample of a cloud, world units.
struct SpacingStatistics {
    double mean = 0;
    double median = 0;
    double p95 = 0;  ///< 95th percentile
    double max = 0;
};
/// @pre no exact duplicates
[[nodiscard]] COVOL_API SpacingStatistics measure_spacing(const std::vector<Vec3>& points);

struct IsolatedPoint {
    std::size_t index = 0;  ///< index in the list of points
    double distance = 0;    ///< distance to the nearest point that is not isolated, in the unit of the points
};
/// Finds marks that are far from all others and are probably accidental clicks: single ones or groups of at most three,
/// in total at most a tenth of the marks, and thus none among fewer than 10. By single linkage: the link from such
/// marks to the others is more than twice as long as the longest link between the others, or six times as long as the
/// median link. Finds none among more than 4,000 points.
/// @return the farthest first
[[nodiscard]] COVOL_API std::vector<IsolatedPoint> find_isolated_points(const std::vector<Vec3>& points);

/// Writes .xyz, .csv or binary .ply, by the file extension; the file is written completely or not at all.
COVOL_API void write_points(const std::string& path, const std::vector<Vec3>& points, const std::string& comment = {});

}  // namespace covol
