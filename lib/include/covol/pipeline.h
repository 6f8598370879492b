#pragma once
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "covol/api.h"
#include "covol/band.h"
#include "covol/cloud_surface.h"
#include "covol/contours.h"
#include "covol/edge.h"
#include "covol/error.h"
#include "covol/evolve.h"
#include "covol/guess.h"
#include "covol/guess_correction.h"
#include "covol/guidance.h"
#include "covol/holes.h"
#include "covol/image.h"
#include "covol/inference.h"
#include "covol/mesh.h"
#include "covol/mesh_relax.h"
#include "covol/options_table.h"
#include "covol/points.h"
#include "covol/seeds.h"
#include "covol/surface.h"

namespace covol {

/// The start depends on the number of marks: from up to 4,000 marks, a guess is made (see SegmentOptions::model). More
/// marks are tagged if there is an image, and are treated as a cloud otherwise.
struct AutoStart {};
struct GuessStart {};  ///< the surface of minimum bending energy through the marks
struct CloudStart {};  ///< surface_from_cloud(), for points without an image
struct TagStart {};    ///< the body that tagging makes from the points, or the body between contours
struct SphereStart {
    Vec3 center{0, 0, 0};
    double radius = 0;  ///< world units, > 0
};
struct BoxStart {
    WorldBox box;
};
struct MeshStart {
    std::shared_ptr<const TriangleMesh> mesh;  ///< closed
};
struct MaskStart {
    std::shared_ptr<const Image> mask;  ///< voxels above 0 are inside
};
struct LevelSetStart {
    FloatGridPtr level_set;  ///< negative inside
    /// the level set is the result of an earlier run: marks and image only correct it, and no flow follows
    bool is_settled = false;
};
/// The start: made from the marks, or given by the caller. read_start() reads the files of given starts.
using Start = std::variant<AutoStart, GuessStart, CloudStart, TagStart, SphereStart, BoxStart, MeshStart, MaskStart,
                           LevelSetStart>;
template <typename... Kinds>
[[nodiscard]] bool is_any(const Start& start) {
    return (std::holds_alternative<Kinds>(start) || ...);
}
/// Whether the start is a shape given by the caller.
[[nodiscard]] inline bool is_named(const Start& start) {
    return !is_any<AutoStart, GuessStart, CloudStart, TagStart>(start);
}

/// The model that determines the surface at positions without marks and edges.
enum class Model {
    /// A guess: the surface of minimum bending energy through the marks, or the body between contours; it is moved to
    /// positions at which the image shows the same border as at the marks.
    Guided,
    Paper  ///< curvature alone, Eq. (1) of the paper
};
template <>
inline constexpr auto kWords<Model> = std::array{"guided", "paper"};

struct SegmentOptions {
    Model model = Model::Guided;
    /// standard deviation of a mark's position, world units, >= 0; automatic: 0.3 of the image's spacing along each
    /// axis
    std::optional<double> mark_precision;
    std::optional<double> voxel_size;  ///< h, world units, > 0; automatic: choose_voxel_size()
    /// `voxel_size` was chosen automatically and may be increased for clouds, as if it had no value.
    bool voxel_size_may_grow = false;
    std::optional<WorldBox> roi;  ///< the domain, instead of the image's box; rounded to whole voxels
    /// World position of the centre of voxel (0,0,0); automatic: see choose_domain().
    std::optional<Vec3> lattice_origin;
    /// for points without an image: distance from the points to the domain's boundary, world units, >= 0; automatic:
    /// tag_distance + 6 voxels after tagging, a fifth of the longest side of the points' box + 6 voxels for a guess and
    /// for a cloud, else 12 voxels
    std::optional<double> margin;
    bool keep_failed = false;  ///< errors are thrown as SegmentFailed, which requires memory for a copy of the start
    Start start;
    /// Another tool's result (a mesh, mask or level set), which is corrected in the neighbourhood of the marks and
    /// seeds, without a flow. `start` is then not used.
    std::optional<Start> guess;
    CorrectionOptions correction;
    /// Marks on slices, from densify() with step h. Their points are added to the other points. With closed contours
    /// TagStart is the body that they enclose, unless other points are far from it or an exterior seed lies inside it:
    /// then all points are tagged, and hole_seeds() are further exterior seeds.
    std::shared_ptr<const Contours> contours;
    /// For a network of contours, whose lines are given as marks: a guess that contradicts the sections is replaced by
    /// a surface that is interpolated between them.
    std::shared_ptr<const Sections> sections;
    PointHints hints;  ///< normals and sensor directions of the given points, in their order; only used for clouds
    std::vector<Vec3> inside, outside;   ///< seeds: positions whose side is known, world units
    std::size_t painted_seeds = 0;       ///< number of these seeds that are voxels of paint; for messages
    std::optional<double> tag_distance;  ///< D, world units, > 0; automatic: choose_tag_distance()
    std::vector<Vec3> exterior_seeds;
    EdgeOptions edge;
    /// The automatic attraction range is 6 voxels; after tagging without an image it is unlimited, because the band
    /// limits the effect of the points. `follow` is always chosen automatically.
    EvolveOptions evolve;
    ExtractOptions extract;
    HolesOptions holes;  ///< for points without an image
    /// SegmentResult::mesh stays empty, which saves memory: the surface is measured one layer of leaves at a time, and
    /// the marks' distances are interpolated. Holes have to be closed, all components kept, and the isovalue 0.
    bool without_mesh = false;
    bool without_fields = false;  ///< SegmentResult::u, distance and edge are freed as soon as they are not needed
    /// number of coarser levels, of voxel size 2h, 4h, ..., on which the flow runs first, >= 0; automatic: 1 for a
    /// sphere or a box, else 0
    std::optional<int> coarse_levels;
    /// Whether points without an image are tagged, or belong to contours or to another start, so that neither a guess
    /// nor a cloud is made from them; the argument `tagged` of choose_voxel_size().
    [[nodiscard]] COVOL_API bool tags_points() const;
};

template <>
inline constexpr auto kOptions<SegmentOptions> = std::tuple{
    Option{"model", &SegmentOptions::model, Group::Start,
           "what determines the surface where there are neither marks nor edges: a guess computed from the marks, or "
           "only curvature"},
    Option{"mark_precision", &SegmentOptions::mark_precision, kLength, Group::ReadingMarks,
           "standard deviation of the position of a mark", "0.3 of the image's spacing along each axis"},
    Option{"voxel_size", &SegmentOptions::voxel_size, kPositiveLength, Group::Domain, "edge length of the voxels",
           "the image's smallest spacing; without an image chosen from the points"},
    Option{"roi", &SegmentOptions::roi, Group::Domain, "compute only in this box, in world coordinates"},
    Option{"lattice_origin", &SegmentOptions::lattice_origin, Group::Domain,
           "centre of voxel (0,0,0): runs with the same voxel size and origin have the same lattice",
           "the image's; without an image 0,0,0"},
    Option{"margin", &SegmentOptions::margin, kLength, points_alone(Group::Domain),
           "distance between the points and the boundary of the domain",
           "6vx + D after tagging, 6vx + a fifth of the points' longest side for a cloud or a guess, else 12vx",
           "max distance + 1vx"},
    Option{"init", &SegmentOptions::start},
    Option{"tag_distance", &SegmentOptions::tag_distance, kPositiveLength, Group::Start,
           "D: closes gaps between points up to 2D", "from the points"},
    Option{"exterior_seed", &SegmentOptions::exterior_seeds, Group::Start,
           "a position outside the structure, for example in a cavity; repeatable"},
    Part{&SegmentOptions::evolve},
    Part{&SegmentOptions::edge},
    Option{"coarse_levels", &SegmentOptions::coarse_levels, between(0, 4), Group::Numerics,
           "number of coarser levels, of 2, 4, ... times the voxel size, on which the flow runs first",
           "1 for a sphere or a box in a large domain, else 0"},
    Part{&SegmentOptions::correction},
    Part{&SegmentOptions::holes},
    Part{&SegmentOptions::extract},
    Rule<SegmentOptions>{"init", "a radius > 0",
                         [](const SegmentOptions& o) {
                             const auto* sphere = std::get_if<SphereStart>(&o.start);
                             return sphere == nullptr || sphere->radius > 0;
                         }},
    Rule<SegmentOptions>{"roi", "min < max along each axis",
                         [](const SegmentOptions& o) {
                             for (std::size_t n = 0; n < 3; ++n)
                                 if (o.roi && o.roi->min[n] == o.roi->max[n]) return false;
                             return true;
                         }},
    Rule<SegmentOptions>{"without_mesh", "false if holes are treated, pieces are dropped or another level is extracted",
                         [](const SegmentOptions& o) {
                             return !o.without_mesh || (!needs_mesh(o.holes.policy) &&
                                                        o.extract.min_component_volume == 0 && o.extract.isovalue == 0);
                         }}};

struct SegmentReport {
    struct Seconds {
        double read = 0, distance = 0, tag = 0, coarse = 0, edge = 0, solve = 0, surface = 0, write = 0, total = 0;
    } seconds;
    struct CoarseLevel {
        double voxel_size = 0;
        int steps = 0;
        std::int64_t active_voxels = 0;
        std::string why_not;  ///< why its result was not used; empty if it was
    };
    std::vector<CoarseLevel> coarse;  ///< the coarsest first
    Domain domain;
    std::int64_t active_voxels = 0, leaf_count = 0;
    std::size_t point_count = 0;  ///< given points, including marks of contours
    std::size_t densified = 0;    ///< points generated from contours
    GuessReport guess;            ///< if the start was a guess
    CloudReport cloud;            ///< if the start was a cloud
    InferenceReport inference;    ///< report of infer(), which runs before guidance
    GuidanceReport guidance;      ///< effect of the image on a guess
    TagDistanceChoice tag;
    BandReport band;
    EdgeReport edge;
    EvolveReport solve;
    /// measures of the mesh; if holes were trimmed, the volume is that of the closed mesh before trimming
    MeshMeasures surface;
    RelaxReport mesh;
    FitStatistics fit;
    /// Marks that are far from the surface: they are wrong, or a part of the structure is missing.
    struct MarksOff {
        std::size_t count = 0;
        /// distance from the surface above which a mark counts, world units: twice the widest voxel, or 4 times a
        /// cloud's noise if that is more
        double beyond = 0;
        double farthest = 0;  ///< maximum distance of all marks, world units
        Vec3 farthest_world{0, 0, 0};
        Vec3 farthest_index{0, 0, 0};  ///< voxels of the image; without an image, as farthest_world
    } marks_off;
    /// Probability that the image varies more at a mark than at positions five voxels from a mark along the surface's
    /// normal; 0.5 if the image shows no border at the marks. None without marks or without an image that is used.
    std::optional<double> image_support;
    /// The position at which the image's mean slope along the surface's normals at the marks is steepest.
    struct ImageBorder {
        int voxels = 0;  ///< distance from the marks, outward > 0, in voxels of the image, or in steps of voxel_size if
                         ///< that is longer
        double fraction = 1;  ///< maximum slope within a voxel of the marks, divided by the slope at that position
        double errors = 0;    ///< difference between these two slopes, in standard errors of its mean
    };
    std::optional<ImageBorder> image_border;  ///< none in the same cases as image_support
    /// If the start is a guess: fraction of the surface that is farther from all marks than half the diagonal of their
    /// box.
    std::optional<double> surface_beyond_marks;
    std::vector<std::string> warnings;  ///< warnings for the user
    SeedCheck seeds;
    CorrectionReport correction;  ///< of SegmentOptions::guess
    /// fraction of the closed surface's area that is farther than holes.distance from every point
    double fraction_without_points = 0;
    HolesReport holes;        ///< for points without an image; its `distance` is 0 if holes were not treated
    SegmentOptions resolved;  ///< the options that were used, with the values of automatic choices
    /// value and reason of each automatic choice, by the name of the option
    std::map<std::string, std::string> automatic;
};

struct SegmentResult {
    FloatGridPtr u, distance, edge, surface;
    TriangleMesh mesh;
    std::vector<float> distance_to_points;              ///< at the mesh's vertices; for points without an image
    std::shared_ptr<const GuessCorrection> correction;  ///< of SegmentOptions::guess
    SegmentReport report;
};

/// An error of segment() or reconstruct() after the start was made, with SegmentOptions::keep_failed. Contains the
/// grids that existed at that time; the other pointers are null.
class COVOL_API SegmentFailed : public Error {
public:
    SegmentFailed(const Error& error, FloatGridPtr start_, FloatGridPtr u_, FloatGridPtr distance_, FloatGridPtr edge_)
        : Error(error),
          start(std::move(start_)),
          u(std::move(u_)),
          distance(std::move(distance_)),
          edge(std::move(edge_)) {}
    FloatGridPtr start;              ///< the level set before the flow
    FloatGridPtr u, distance, edge;  ///< the fields of the flow as they were when the error occurred
};

/// The automatic voxel size h and its reason. With an image, h is its smallest spacing. For points alone, h is based on
/// the median distance to the nearest other point:
/// - For more than 4,000 points, h is this distance, or half of the noise (measure_cloud_scale()) if that is larger.
/// - For n <= 4,000 points of a guess, h is this distance times sqrt(n / 4000): a guess is smooth between its points.
/// - For n <= 4,000 points that are `tagged` (the surface comes from tagging, contours or another start), h is larger
///   if the points are noisy (choose_scan_voxel_size()), else this distance times sqrt(n / 1000) if n < 1000.
/// For n <= 4,000 points that are not noisy, h is larger if the points' bounding box would otherwise have more than
/// 300,000 voxels on its sides.
/// @throws Error InvalidInput if there are fewer than two distinct points.
struct VoxelSizeChoice {
    double voxel_size = 0;
    std::string reason;  ///< one line for the user
};
[[nodiscard]] COVOL_API VoxelSizeChoice choose_voxel_size(const Image& image);
[[nodiscard]] COVOL_API VoxelSizeChoice choose_voxel_size(const std::vector<Vec3>& world_points, bool tagged = false);

/// The main function: segments an image with points.
/// @throws Error as the individual steps.
[[nodiscard]] COVOL_API SegmentResult segment(const Image& image, const std::vector<Vec3>& world_points,
                                              const SegmentOptions& options = {}, const RunContext& run = {});
/// Segments an image without points: SegmentOptions::start, contours, seeds or a guess give the position of the
/// surface.
/// @throws Error also InvalidInput (tagging without points).
[[nodiscard]] COVOL_API SegmentResult segment(const Image& image, const SegmentOptions& options = {},
                                              const RunContext& run = {});
/// Reconstructs a surface from points without an image.
/// @throws Error as the individual steps; InvalidInput if there is no point, contour or start.
[[nodiscard]] COVOL_API SegmentResult reconstruct(const std::vector<Vec3>& world_points,
                                                  const SegmentOptions& options = {}, const RunContext& run = {});

}  // namespace covol
