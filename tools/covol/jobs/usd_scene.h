#pragma once
#include <map>
#include <string>

#include "jobs/structure_outputs.h"

// A scene in the text form of USD whose volumes are .vdb files: UsdVol's OpenVDBAsset.
// https://openusd.org/release/api/usd_vol_page_front.html
namespace covol::tool {

/// A grid of the scene, and the file that has it, frame by frame.
struct UsdField {
    bool is_fog = false;
    std::map<int, std::string> files;  ///< paths as they were typed; of a single image one, at 0
};

struct UsdScene {
    bool is_timelapse = false;
    std::map<std::string, UsdField> fields;  ///< by the grids' names
};

/// Adds the .vdb files of one image, of which `tagged` makes the names.
void add_to_scene(UsdScene& scene, const SegmentJob& job, const StructuresOutput& output, const NameTag& tagged);

/// The text; files are named as seen from the folder of `path`. @param unit  of length; other than those of metre: 1
[[nodiscard]] std::string to_usda(const UsdScene& scene, const std::string& path, const std::string& unit);

/// @throws UsageError where --usda is given and no .vdb file that it could refer to; Error as Outputs::check().
void check_scene(const SegmentJob& job, Outputs& outputs);
/// Queues it where it was asked for.
void write_scene(const UsdScene& scene, const SegmentJob& job, Session& session);

}  // namespace covol::tool
