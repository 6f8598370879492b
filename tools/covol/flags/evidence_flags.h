#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cli/session.h"
#include "covol/evidence.h"
#include "covol/mesh_io.h"
#include "covol/pipeline.h"
#include "covol/program_marks.h"

namespace covol::tool {

/// Number of suggested slices in a report page or a file of suggestions if the command line does not give it.
inline constexpr int kPageSuggestions = 3;

/// --evidence, --suggest and --suggestions: the support of the surface by marks and image. Report pages show it, too.
struct EvidenceFlags {
    std::string path;        ///< table of the slices, .csv
    std::string marks_path;  ///< file of suggestions, see write_program_marks()
    std::optional<int> suggestions;
    bool for_page = false;

    void bind(CLI::App& command);
    /// @param tagged  returns the path of an output for this run, such as with the number of the frame
    void check(Outputs& outputs, const std::function<std::string(const std::string&)>& tagged) const;
    [[nodiscard]] bool wanted() const {
        return !path.empty() || !marks_path.empty() || suggestions.value_or(0) > 0 || for_page;
    }
    /// assess_evidence(), with the requested number of suggestions.
    [[nodiscard]] Evidence judge(const SegmentResult& result, const std::vector<Vec3>& marks, const Image& image,
                                 const RunContext& run) const;
};

/// All fields except the values at the vertices.
[[nodiscard]] Json to_json(const Evidence& evidence);

/// The vertex attributes distance_to_marks and edge_strength of a mesh, if they are known; empty without evidence.
[[nodiscard]] std::vector<VertexAttribute> vertex_attributes(const std::optional<Evidence>& evidence);

/// Prints the unsupported fraction of the surface, and the suggestions; each line begins with `who`.
void print_evidence(Session& session, const Evidence& evidence, const std::string& who = {});

/// One surface in the table of slices.
struct EvidenceOf {
    std::string structure;
    const Evidence* evidence;
};
[[nodiscard]] std::string evidence_csv(const std::vector<EvidenceOf>& surfaces);
/// All suggestions, named after structure and slice.
[[nodiscard]] std::vector<NamedMark> suggested_marks(const std::vector<EvidenceOf>& surfaces);

}  // namespace covol::tool
