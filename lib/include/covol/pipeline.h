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

/// A guess from the marks where there are few of them (see SegmentOptions::model); more are a cloud without an image,
/// with one they are tagged.
struct AutoStart {};
struct GuessStart {};  ///< the surface through the marks that bends least
struct CloudStart {};  ///< surface_from_cloud(), of points without an image
struct TagStart {};    ///< the points, tagged, or the body between contours
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
    bool is_settled = false;  ///< it is a result: marks and image correct it, and nothing flows
};
/// How the level set starts: made from the marks, or named by the caller. covol/mesh_io.h, image_files.h and vdb_io.h
/// read the files of one; read_start() all of them.
using Start = std::variant<AutoStart, GuessStart, CloudStart, TagStart, SphereStart, BoxStart, MeshStart, MaskStart,
                           LevelSetStart>;
template <typename... Kinds>
[[nodiscard]] bool is_any(const Start& start) {
    return (std::holds_alternative<Kinds>(start) || ...);
}
/// The caller names a shape.
[[nodiscard]] inline bool is_named(const Start& start) {
    return !is_any<AutoStart, GuessStart, CloudStart, TagStart>(start);
}

/// What holds the surface where neither marks nor edges speak.
enum class Model {
    Guided,  ///< a guess: the surface through the marks that bends least, or the body between contours; the image moves
             ///< it where it shows the border that it has at the marks
    Paper    ///< curvature alone, Eq. (1) as it is printed
};
template <>
inline constexpr auto kWords<Model> = std::array{"guided", "paper"};

struct SegmentOptions {
    Model model = Model::Guided;
    /// standard deviation of a mark's place, world units, >= 0; automatic: 0.3 of the image's spacing along each axis
    std::optional<double> mark_precision;
    std::optional<double> voxel_size;  ///< h, world units, > 0; automatic: choose_voxel_size()
    /// `voxel_size` is a first choice, as an automatic one: points that enclose nothing may be given a larger one.
    bool voxel_size_may_grow = false;
    std::optional<WorldBox> roi;  ///< the domain, instead of the image's box, in whole voxels
    /// World position of the centre of voxel (0,0,0); automatic: see choose_domain().
    std::optional<Vec3> lattice_origin;
    std::optional<double> margin;  ///< points alone, >= 0: between points and domain boundary; automatic: D + 6 voxels
    bool keep_failed = false;      ///< errors come as SegmentFailed, at the cost of a copy of the start
    Start start;
    /// Another tool's result (a mesh, mask or level set): corrected by the marks and seeds near them, and no flow.
    /// `start` is then not used.
    std::optional<Start> guess;
    CorrectionOptions correction;
    /// Marks on slices, densified with step h: their points join the others, those between the slices as guesses. With
    /// closed contours TagStart is the body that they enclose, unless other points lie far from it or an
    /// exterior seed lies inside it: then all points are tagged, and each hole that inner contours leave is an exterior
    /// seed.
    std::shared_ptr<const Contours> contours;
    /// Of a network of contours, whose lines are the marks: a guess that contradicts them is given up for what lies
    /// between them.
    std::shared_ptr<const Sections> sections;
    PointHints hints;                    ///< of the points as they are given; for a cloud
    std::vector<Vec3> inside, outside;   ///< seeds: positions whose side is known, world units
    std::size_t painted_seeds = 0;       ///< so many of them are voxels of paint; for messages
    std::optional<double> tag_distance;  ///< D, world units, > 0; automatic: choose_tag_distance()
    std::vector<Vec3> exterior_seeds;
    EdgeOptions edge;
    /// An automatic attraction range: after tagging 8 voxels, unlimited without an image (the band bounds the points'
    /// reach), 5 voxels after the other starts. `follow` is chosen too.
    EvolveOptions evolve;
    ExtractOptions extract;
    HolesOptions holes;  ///< of points without an image
    /// SegmentResult::mesh stays empty, and memory is that of level sets: the surface is measured a layer of leaves at
    /// a time, and the marks' distances are sampled. Holes are closed, no piece is dropped, and the isovalue is 0.
    bool without_mesh = false;
    bool without_fields = false;  ///< SegmentResult::u, distance and edge are given up as soon as nothing needs them
    /// levels of voxel size 2h, 4h, ... that the flow passes first, >= 0; automatic: 1 for a sphere or a box, else 0
    std::optional<int> coarse_levels;
    /// Whether points alone are tagged, or belong to contours or another start, and are neither guessed from nor a
    /// cloud: choose_voxel_size().
    [[nodiscard]] COVOL_API bool tags_points() const;
};

template <>
inline constexpr auto kOptions<SegmentOptions> = std::tuple{
    Option{
        "model", &SegmentOptions::model, Group::Start,
        "what holds the surface where neither marks nor edges speak: a guess made from the marks, or curvature alone"},
    Option{"mark_precision", &SegmentOptions::mark_precision, kLength, Group::ReadingMarks,
           "standard deviation of a mark's place", "0.3 of the image's spacing along each axis"},
    Option{"voxel_size", &SegmentOptions::voxel_size, kPositiveLength, Group::Domain, "edge of the voxels",
           "the image's smallest spacing; without an image from the points"},
    Option{"roi", &SegmentOptions::roi, Group::Domain, "work in this box of the world only"},
    Option{"lattice_origin", &SegmentOptions::lattice_origin, Group::Domain,
           "centre of voxel (0,0,0): runs with the same voxel size and origin share their lattice",
           "the image's; without an image 0,0,0"},
    Option{"margin", &SegmentOptions::margin, kLength, points_alone(Group::Domain),
           "between the points and the domain's boundary", "D + 6vx"},
    Option{"init", &SegmentOptions::start},
    Option{"tag_distance", &SegmentOptions::tag_distance, kPositiveLength, Group::Start,
           "D: closes gaps between points up to 2D", "from the points"},
    Option{"exterior_seed", &SegmentOptions::exterior_seeds, Group::Start,
           "a position outside the structure, also in a cavity; repeatable"},
    Part{&SegmentOptions::evolve},
    Part{&SegmentOptions::edge},
    Option{"coarse_levels", &SegmentOptions::coarse_levels, between(0, 4), Group::Numerics,
           "levels of twice the voxel size, and so on, that the flow passes first", "1 for a sphere or a box, else 0"},
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
    Rule<SegmentOptions>{"without_mesh", "false where holes are treated, pieces dropped or another level is wanted",
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
        std::string why_not;  ///< why its result was not used; empty where it was
    };
    std::vector<CoarseLevel> coarse;  ///< the coarsest first
    Domain domain;
    std::int64_t active_voxels = 0, leaf_count = 0;
    std::size_t point_count = 0;  ///< given, marks of contours included
    std::size_t densified = 0;    ///< points made from contours
    GuessReport guess;            ///< where the start was one
    CloudReport cloud;            ///< likewise
    InferenceReport inference;    ///< of a guess and the image, before its guidance
    GuidanceReport guidance;      ///< what the image said to a guess
    TagDistanceChoice tag;
    BandReport band;
    EdgeReport edge;
    EvolveReport solve;
    MeshMeasures surface;  ///< of the mesh; where that is open its volume is the level set's
    RelaxReport mesh;
    FitStatistics fit;
    /// Marks farther from the surface than two voxels of the image: wrong, or a part of the structure that is missing.
    struct MarksOff {
        std::size_t count = 0;
        double beyond = 0;    ///< world units
        double farthest = 0;  ///< world units
        Vec3 farthest_world{0, 0, 0};
        Vec3 farthest_index{0, 0, 0};  ///< voxels of the image; without one as farthest_world
    } marks_off;
    /// Probability that the image varies more at a mark than five voxels beside it, along the surface's normal; 0.5
    /// where it shows nothing there. None without an image and marks.
    std::optional<double> image_support;
    /// Where the image's slope along the surface's normals at the marks is steepest on the mean.
    struct ImageBorder {
        int voxels = 0;       ///< from the marks, outward; of the image, or steps of voxel_size where that is longer
        double fraction = 1;  ///< of the slope there that the marks have where they lie, within a voxel
        double errors = 0;    ///< standard errors of the mean that both differ by
    };
    std::optional<ImageBorder> image_border;  ///< none as image_support
    /// Share of a surface through marks alone that lies farther from all of them than half of their box's diagonal.
    std::optional<double> surface_beyond_marks;
    std::vector<std::string> warnings;  ///< what a person has to look at, in plain words
    SeedCheck seeds;
    CorrectionReport correction;         ///< of SegmentOptions::guess
    double fraction_without_points = 0;  ///< of the closed surface's area: farther than holes.distance from every point
    HolesReport holes;                   ///< of points without an image; distance 0: none
    SegmentOptions resolved;             ///< what was used: each automatic choice that was made has its value
    std::map<std::string, std::string> automatic;  ///< each automatic choice and its reason
};

struct SegmentResult {
    FloatGridPtr u, distance, edge, surface;
    TriangleMesh mesh;
    std::vector<float> distance_to_points;              ///< at its vertices; of points without an image
    std::shared_ptr<const GuessCorrection> correction;  ///< of SegmentOptions::guess
    SegmentReport report;
};

/// An error of segment() or reconstruct() that comes after the start was made, with SegmentOptions::keep_failed: what
/// there was, null where there was none.
class COVOL_API SegmentFailed : public Error {
public:
    SegmentFailed(const Error& error, FloatGridPtr start_, FloatGridPtr u_, FloatGridPtr distance_, FloatGridPtr edge_)
        : Error(error),
          start(std::move(start_)),
          u(std::move(u_)),
          distance(std::move(distance_)),
          edge(std::move(edge_)) {}
    FloatGridPtr start;              ///< the level set before the flow
    FloatGridPtr u, distance, edge;  ///< as they were last
};

/// h and how it was found: the image's smallest spacing, or for points alone the median distance to the nearest other
/// point. More than 4,000 points that are noisy get a coarser one (measure_cloud_scale()), up to 4,000 a finer one, by
/// sqrt(n / 4000): the surface between them is known. `tagged`: the surface is found by neither a guess nor a cloud,
/// but by tagging, contours or another start; up to 4,000 points get a coarser one where they are noisy
/// (choose_scan_voxel_size()), or a finer one by sqrt(n / 1000).
/// @throws Error InvalidInput when there are fewer than two distinct points.
struct VoxelSizeChoice {
    double voxel_size = 0;
    std::string reason;  ///< one line for people
};
[[nodiscard]] COVOL_API VoxelSizeChoice choose_voxel_size(const Image& image);
[[nodiscard]] COVOL_API VoxelSizeChoice choose_voxel_size(const std::vector<Vec3>& world_points, bool tagged = false);

/// The main job: image and points together.
/// @throws Error as the single steps.
[[nodiscard]] COVOL_API SegmentResult segment(const Image& image, const std::vector<Vec3>& world_points,
                                              const SegmentOptions& options = {}, const RunContext& run = {});
/// An image alone: SegmentOptions::start says where the surface is, or contours, seeds or a guess do.
/// @throws Error also InvalidInput (tagging without points).
[[nodiscard]] COVOL_API SegmentResult segment(const Image& image, const SegmentOptions& options = {},
                                              const RunContext& run = {});
/// Points alone.
/// @throws Error as the single steps; InvalidInput when there is no point, contour or start.
[[nodiscard]] COVOL_API SegmentResult reconstruct(const std::vector<Vec3>& world_points,
                                                  const SegmentOptions& options = {}, const RunContext& run = {});

}  // namespace covol
