#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "cli/json.h"
#include "covol/intensity.h"
#include "covol/study.h"
#include "covol/study_solver.h"

// What pages are told, as JSON; docs/mark_protocol.md has the messages.
namespace covol::tool {

/// `stage` of a result.
[[nodiscard]] const char* word_of(StudyResult::Stage stage);
/// On one line; what is no UTF-8 is replaced.
[[nodiscard]] std::string text_of(const Json& json);
/// @param version  of the surface that pages are shown @param intensity  none: not known
[[nodiscard]] Json result_json(const StudyResult& result, std::uint64_t version,
                               const std::optional<IntensityStatistics>& intensity);
[[nodiscard]] Json options_json(const StudyOptions& options);
/// @param result  the last one of the structure, or null
[[nodiscard]] Json structure_json(const StudyStructure& structure, const Json& result);

}  // namespace covol::tool
