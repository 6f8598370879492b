#pragma once
#include <functional>
#include <optional>
#include <string>

#include "covol/image.h"
#include "covol/intensity.h"
#include "covol/segment_structures.h"
#include "covol/study.h"

namespace covol::tool {

/// A file that the page offers for download.
struct Export {
    std::string name, bytes;
};

/// Makes the file that a page has requested.
/// @param format  mask.nii.gz, mask.nrrd, mask.tif, mesh.ply, mesh.stl, surface.vdb, marks.csv, table.csv
/// @param wanted  the structures to export; for a mesh exactly one, because a file holds one mesh
/// @param results  returns the results of all structures of the study, not only of those in `wanted`, so that masks do
///                 not overlap, and labels do not depend on `wanted`
/// @param intensity  returns the intensity inside a structure, for the table
/// @param scratch  a folder for temporary files
/// @throws Error InvalidInput (unknown format); errors of the export.
[[nodiscard]] Export make_export(
    const std::string& format, const StudyState& wanted, const std::function<StructuresResult()>& results,
    const std::function<std::optional<IntensityStatistics>(const StructureResult&)>& intensity, const Image& image,
    const std::string& scratch, const RunContext& run);

}  // namespace covol::tool
