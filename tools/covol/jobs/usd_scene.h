#pragma once
#include <map>
#include <string>

#include "jobs/structure_outputs.h"

// A scene in the text format of USD whose volumes are .vdb files: UsdVol's OpenVDBAsset.
// https://openusd.org/release/api/usd_vol_page_front.html
namespace covol::tool {

/// A grid of the scene, and the file that contains it, for each frame.
struct UsdField {
    bool is_fog = false;
    std::map<int, std::string> files;  ///< paths as given by the user, by frame; a single image has frame 0
};

struct UsdScene {
    bool is_timelapse = false;
    std::map<std::string, UsdField> fields;  ///< by grid name
};

/// Adds the .vdb files of one image, whose names are made by `tagged`.
void add_to_scene(UsdScene& scene, const SegmentJob& job, const StructuresOutput& output, const NameTag& tagged);

/// The text of the scene, which refers to files relative to the folder of `path`.
/// @param unit  unit of length; unknown units are treated as metres
[[nodiscard]] std::string to_usda(const UsdScene& scene, const std::string& path, const std::string& unit);

/// @throws UsageError if --usda is given without a .vdb output that it could refer to; Error as Outputs::check().
void check_scene(const SegmentJob& job, Outputs& outputs);
/// Queues the scene for writing if it was requested and has fields.
void write_scene(const UsdScene& scene, const SegmentJob& job, Session& session);

}  // namespace covol::tool
