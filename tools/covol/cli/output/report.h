#pragma once
#include "cli/output/json.h"
#include "covol/band.h"
#include "covol/compare.h"
#include "covol/edge.h"
#include "covol/evolve.h"
#include "covol/image.h"
#include "covol/mesh.h"
#include "covol/pipeline.h"

// The library's reports as JSON; field names are part of the command-line interface and must not change.
namespace covol::tool {

[[nodiscard]] Json to_json(const Vec3& v);
[[nodiscard]] Json to_json(const WorldBox& box);
[[nodiscard]] Json to_json(const ImageGeometry& geometry);
/// How many chunks of an image were read.
[[nodiscard]] Json to_json(const ChunkCount& chunks);
[[nodiscard]] Json to_json(const Domain& domain);
[[nodiscard]] Json to_json(const BandReport& report);
[[nodiscard]] Json to_json(const EdgeReport& report);
[[nodiscard]] Json to_json(const EvolveReport& report);
[[nodiscard]] Json to_json(const MeshMeasures& measures);
[[nodiscard]] Json to_json(const MeshDeviation& deviation);
[[nodiscard]] Json to_json(const RelaxReport& report);
[[nodiscard]] Json to_json(const FitStatistics& fit);
[[nodiscard]] Json to_json(const SeedCheck& check);
[[nodiscard]] Json to_json(const CompareReport& report);
/// Every option with the value that segment() used; lengths are in world units.
[[nodiscard]] Json to_json(const SegmentOptions& options);

/// All fields of the report except those about the inputs and the run times.
[[nodiscard]] Json to_json(const SegmentReport& report);
/// The result in a few lines of text, for the terminal.
[[nodiscard]] std::vector<std::string> summary(const SegmentReport& report);

/// The measurements as one line of text.
[[nodiscard]] std::string one_line(const MeshMeasures& measures);
[[nodiscard]] std::string one_line(const MeshDeviation& deviation);
[[nodiscard]] std::string plain_mesh_line(std::uint64_t triangles);
/// @param smallest_angle  1st percentile of the smallest angles of the triangles, degrees
/// @param deviation       from the level set, voxels
[[nodiscard]] std::string mesh_line(std::int64_t triangles, double smallest_angle, const MeshDeviation& deviation);

}  // namespace covol::tool
