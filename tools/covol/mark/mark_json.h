#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "cli/output/json.h"
#include "covol/intensity.h"
#include "covol/study.h"
#include "covol/study_solver.h"

// Messages to pages as JSON; they are documented in docs/mark_protocol.md.
namespace covol::tool {

/// The value of the field `stage` in a message about a result.
[[nodiscard]] const char* stage_name(StudyResult::Stage stage);
/// The JSON as text on one line; invalid UTF-8 is replaced.
[[nodiscard]] std::string text_of(const Json& json);
/// @param version  of the surface that pages display @param intensity  inside the surface; nullopt: not known
[[nodiscard]] Json result_json(const StudyResult& result, std::uint64_t version,
                               const std::optional<IntensityStatistics>& intensity);
[[nodiscard]] Json options_json(const StudyOptions& options);
/// @param result  the last result of the structure, or null
[[nodiscard]] Json structure_json(const StudyStructure& structure, const Json& result);

}  // namespace covol::tool
