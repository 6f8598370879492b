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

/// A guess from the marks if there are few of them (see SegmentOptions::model); more marks are a cloud without an
/// image, and are tagged with one.
struct AutoStart {};
struct GuessStart {};  ///< the surface of minimum bending energy through the marks
struct CloudStart {};  ///< surface_from_cloud(), for points without an image
struct TagStart {};    ///< the tagged points, or the body between contours
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
    FloatGridPtr level_set;   ///< negative inside
    bool is_settled = false;  ///< it is a result: marks and image correct it, and no flow follows
};
/// How the level set starts: made from the marks, or given by the caller. covol/mesh_io.h, image_files.h and vdb_io.h
/// read the files of individual starts, read_start() those of all.
using Start = std::variant<AutoStart, GuessStart, CloudStart, TagStart, SphereStart, BoxStart, MeshStart, MaskStart,
                           LevelSetStart>;
template <typename... Kinds>
[[nodiscard]] bool is_any(const Start& start) {
    return (std::holds_alternative<Kinds>(start) || ...);
}
/// Whether the caller gives a shape.
[[nodiscard]] inline bool is_named(const Start& start) {
    return !is_any<AutoStart, GuessStart, CloudStart, TagStart>(start);
}

/// What determines the surface where there are neither marks nor edges.
enum class Model {
    /// A guess: the surface of minimum bending energy through the marks, or the body between contours; the image moves
    /// it where it shows the same border as at the marks.
    Guided,
    Paper  ///< curvature alone, Eq. (1) as printed
};
template <>
inline constexpr auto kWords<Model> = std::array{"guided", "paper"};

struct SegmentOptions {
    Model model = Model::Guided;
    /// standard deviation of a mark's position, world units, >= 0; automatic: 0.3 of the image's spacing along each
    /// axis
    std::optional<double> mark_precision;
    std::optional<double> voxel_size;  ///< h, world units, > 0; automatic: choose_voxel_size()
    /// `voxel_size` is a first choice, like an automatic one: it may be increased for points that enclose nothing.
    bool voxel_size_may_grow = false;
    std::optional<WorldBox> roi;  ///< the domain, instead of the image's box; rounded to whole voxels
    /// World position of the centre of voxel (0,0,0); automatic: see choose_domain().
    std::optional<Vec3> lattice_origin;
    /// points alone, >= 0: from the points to the domain's boundary; automatic: D + 6 voxels
    std::optional<double> margin;
    bool keep_failed = false;  ///< errors are thrown as SegmentFailed, at the cost of a copy of the start
    Start start;
    /// Another tool's result (a mesh, mask or level set), which is corrected by the marks and seeds near them, without
    /// a flow. `start` is then not used.
    std::optional<Start> guess;
    CorrectionOptions correction;
    /// Marks on slices, densified with step h: their points are added to the others, those between the slices as part
    /// of the guess. With closed contours TagStart is the body that they enclose, unless other points lie far from it
    /// or an exterior seed lies inside it: then all points are tagged, and each hole formed by inner contours is an
    /// exterior seed.
    std::shared_ptr<const Contours> contours;
    /// For a network of contours, whose lines are the marks: a guess that contradicts them is replaced by the surface
    /// between them.
    std::shared_ptr<const Sections> sections;
    PointHints hints;                    ///< for the points as they are given; used for clouds
    std::vector<Vec3> inside, outside;   ///< seeds: positions whose side is known, world units
    std::size_t painted_seeds = 0;       ///< how many of them are voxels of paint; for messages
    std::optional<double> tag_distance;  ///< D, world units, > 0; automatic: choose_tag_distance()
    std::vector<Vec3> exterior_seeds;
    EdgeOptions edge;
    /// Automatic attraction range: 6 voxels; after tagging without an image unlimited (the band limits the points'
    /// reach). `follow` is also chosen.
    EvolveOptions evolve;
    ExtractOptions extract;
    HolesOptions holes;  ///< for points without an image
    /// SegmentResult::mesh stays empty, and only level sets take memory: the surface is measured one layer of leaves at
    /// a time, and the marks' distances are sampled. Holes are closed, no component is dropped, and the isovalue is 0.
    bool without_mesh = false;
    bool without_fields = false;  ///< SegmentResult::u, distance and edge are freed as soon as they are not needed
    /// levels of voxel size 2h, 4h, ... that precede the flow, >= 0; automatic: 1 for a sphere or a box, else 0
    std::optional<int> coarse_levels;
    /// Whether points alone are tagged or belong to contours or another start, so that neither a guess nor a cloud is
    /// made from them: choose_voxel_size().
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
           "distance between the points and the boundary of the domain", "D + 6vx"},
    Option{"init", &SegmentOptions::start},
    Option{"tag_distance", &SegmentOptions::tag_distance, kPositiveLength, Group::Start,
           "D: closes gaps between points up to 2D", "from the points"},
    Option{"exterior_seed", &SegmentOptions::exterior_seeds, Group::Start,
           "a position outside the structure, for example in a cavity; repeatable"},
    Part{&SegmentOptions::evolve},
    Part{&SegmentOptions::edge},
    Option{"coarse_levels", &SegmentOptions::coarse_levels, between(0, 4), Group::Numerics,
           "number of coarser levels, of 2, 4, ... times the voxel size, on which the flow runs first",
           "1 for a sphere or a box, else 0"},
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
    InferenceReport inference;    ///< of the guess and the image, before guidance
    GuidanceReport guidance;      ///< effect of the image on a guess
    TagDistanceChoice tag;
    BandReport band;
    EdgeReport edge;
    EvolveReport solve;
    MeshMeasures surface;  ///< of the mesh; if it is open, the volume is that of the level set
    RelaxReport mesh;
    FitStatistics fit;
    /// Marks farther from the surface than two voxels of the image: they are wrong, or a part of the structure is
    /// missing.
    struct MarksOff {
        std::size_t count = 0;
        double beyond = 0;    ///< world units
        double farthest = 0;  ///< world units
        Vec3 farthest_world{0, 0, 0};
        Vec3 farthest_index{0, 0, 0};  ///< voxels of the image; without an image, as farthest_world
    } marks_off;
    /// Probability that the image varies more at a mark than five voxels beside it, along the surface's normal; 0.5 if
    /// it shows nothing there. None without an image and marks.
    std::optional<double> image_support;
    /// The position at which the image's mean slope along the surface's normals at the marks is steepest.
    struct ImageBorder {
        int voxels = 0;  ///< from the marks, outward; in voxels of the image, or steps of voxel_size if that is longer
        double fraction = 1;  ///< slope at the marks, within a voxel, as a fraction of the slope there
        double errors = 0;    ///< difference between the two in standard errors of the mean
    };
    std::optional<ImageBorder> image_border;  ///< none under the same conditions as image_support
    /// Fraction of a surface through marks alone that is farther from all of them than half the diagonal of their box.
    std::optional<double> surface_beyond_marks;
    std::vector<std::string> warnings;  ///< messages for the user about what needs attention
    SeedCheck seeds;
    CorrectionReport correction;         ///< of SegmentOptions::guess
    double fraction_without_points = 0;  ///< of the closed surface's area, farther than holes.distance from every point
    HolesReport holes;                   ///< for points without an image; distance 0: not treated
    SegmentOptions resolved;             ///< the options used: each automatic choice that was made has its value
    std::map<std::string, std::string> automatic;  ///< each automatic choice and its reason
};

struct SegmentResult {
    FloatGridPtr u, distance, edge, surface;
    TriangleMesh mesh;
    std::vector<float> distance_to_points;              ///< at its vertices; for points without an image
    std::shared_ptr<const GuessCorrection> correction;  ///< of SegmentOptions::guess
    SegmentReport report;
};

/// An error of segment() or reconstruct() after the start was made, with SegmentOptions::keep_failed: the grids that
/// existed then, null for the others.
class COVOL_API SegmentFailed : public Error {
public:
    SegmentFailed(const Error& error, FloatGridPtr start_, FloatGridPtr u_, FloatGridPtr distance_, FloatGridPtr edge_)
        : Error(error),
          start(std::move(start_)),
          u(std::move(u_)),
          distance(std::move(distance_)),
          edge(std::move(edge_)) {}
    FloatGridPtr start;              ///< the level set before the flow
    FloatGridPtr u, distance, edge;  ///< their last state
};

/// h and how it was found: the image's smallest spacing, or, for points alone, the median distance to the nearest other
/// point. More than 4,000 points that are noisy get a coarser h (measure_cloud_scale()); up to 4,000 get a finer one,
/// by sqrt(n / 4000), because the surface between them is known. With `tagged` the surface is found neither by a guess
/// nor as a cloud, but by tagging, contours or another start; up to 4,000 points then get a coarser h if they are noisy
/// (choose_scan_voxel_size()), else a finer one by sqrt(n / 1000).
/// @throws Error InvalidInput if there are fewer than two distinct points.
struct VoxelSizeChoice {
    double voxel_size = 0;
    std::string reason;  ///< one line for the user
};
[[nodiscard]] COVOL_API VoxelSizeChoice choose_voxel_size(const Image& image);
[[nodiscard]] COVOL_API VoxelSizeChoice choose_voxel_size(const std::vector<Vec3>& world_points, bool tagged = false);

/// The main function: image and points together.
/// @throws Error as the individual steps.
[[nodiscard]] COVOL_API SegmentResult segment(const Image& image, const std::vector<Vec3>& world_points,
                                              const SegmentOptions& options = {}, const RunContext& run = {});
/// An image alone: the position of the surface is given by SegmentOptions::start, or by contours, seeds or a guess.
/// @throws Error also InvalidInput (tagging without points).
[[nodiscard]] COVOL_API SegmentResult segment(const Image& image, const SegmentOptions& options = {},
                                              const RunContext& run = {});
/// Points alone, without an image.
/// @throws Error as the individual steps; InvalidInput if there is no point, contour or start.
[[nodiscard]] COVOL_API SegmentResult reconstruct(const std::vector<Vec3>& world_points,
                                                  const SegmentOptions& options = {}, const RunContext& run = {});

}  // namespace covol
