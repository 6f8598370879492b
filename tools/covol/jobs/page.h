#pragma once
#include <optional>
#include <string>
#include <vector>

#include "cli/session.h"
#include "covol/report_page.h"
#include "jobs/structure_outputs.h"

// Report pages: `--report` of segment and reconstruct, and `covol report`.
namespace covol::tool {

/// Whether an image's world coordinates are anatomical: for DICOM and NIfTI, and for NRRD and MetaImage in millimetres.
[[nodiscard]] bool is_anatomical(const std::string& image_path, const ReadImageOptions& options, const RunContext& run);

/// The facts that a page shows: the report so far, the command line, and the options that it gave.
[[nodiscard]] Json page_facts(const Session& session);

/// Writes the page, adds its size and other facts to the report, and prints a remark.
/// @param path  temporary path of an output; the report contains the final one
void write_page(const std::string& path, const ReportPage& page, Session& session);

/// Writes the results of a run; `page` has a title and, for a time-lapse, its frames.
void write_page(const std::string& path, const StructuresOutput& output, ReportPage page, Session& session);

}  // namespace covol::tool
