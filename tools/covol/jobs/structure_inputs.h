#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "jobs/segment_job.h"

// What the command line gives for each structure: `--points NAME=FILE`, `--contours NAME=FILE`, labels of `--painted
// FILE`.
namespace covol::tool {

/// A structure as the command line gives it.
struct StructureInput {
    std::string name;  ///< empty: the only one, and it was not named
    PointFlags points;
    ContourFlags contours;
    std::vector<Vec3> exterior_seeds;
    SeedFlags seeds;    ///< without names
    std::string guess;  ///< another tool's result; empty: none
    /// Labels that were painted for it.
    struct Paint {
        std::shared_ptr<const PaintedFile> file;
        int label = 0;
    };
    std::vector<Paint> paint;
    int label = 0;  ///< in the mask that is written
};

/// The structures of a run, in the order in which their names come first: those of --points, --contours, --painted,
/// --guess, --inside. A single painted label without a name of its own belongs to marks that have none.
/// @throws UsageError when some marks have names and others have none, or a seed names nobody.
[[nodiscard]] std::vector<StructureInput> structures_of(
    const SegmentJob& job, const std::vector<std::shared_ptr<const PaintedFile>>& painted = {});

[[nodiscard]] std::vector<std::string> names_of(const std::vector<StructureInput>& inputs);

/// How a structure starts. The curvature's weight that an earlier frame found automatically goes on where the command
/// line gives none: a surface that changed its stiffness between frames would seem to move.
struct StructureStart {
    Start start;
    std::optional<double> delta{};  ///< world units
};

/// The starts that --init asks for, one for each structure.
[[nodiscard]] std::vector<StructureStart> starts_of(const SegmentJob& job, const std::vector<StructureInput>& inputs);

}  // namespace covol::tool
