#pragma once
#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "cli/output/json.h"
#include "covol/fwd.h"
#include "covol/image.h"

namespace covol::tool {

/// The provenance that output files contain: facts about the run that wrote them, its options and its inputs.
class RunProvenance {
public:
    /// @param command, report  command and report of the run; kept by reference, so they must outlive this object
    RunProvenance(const CLI::App& command, std::vector<std::string> inputs, const Json& report)
        : command_(command), inputs_(std::move(inputs)), report_(report) {}

    /// The input files of the command line.
    [[nodiscard]] const std::vector<std::string>& inputs() const noexcept { return inputs_; }
    /// Sets the unit of length and the coordinate system that outputs state: the image's unit and LPS; for points
    /// without an image, no unit and no known coordinate system.
    void set_world(const ImageGeometry& geometry);
    void set_world_of_points();
    /// Copies the unit and the coordinate system from the metadata of a grid.
    void set_world(const FloatGrid& grid);
    /// Provenance for the metadata of .vdb files: version, instruction set, options with file names but without
    /// folders, names of the options that were given, digests of the inputs, the resolved options and the number of
    /// bricks once they are known, the unit of length and the coordinate system.
    [[nodiscard]] std::map<std::string, std::string> metadata() const;
    /// The metadata() as comment lines for files of meshes and points.
    [[nodiscard]] std::vector<std::string> comments() const;
    /// The comments() as one text, with line ends between them.
    [[nodiscard]] std::string comment() const;
    /// Text that identifies the job, so that only the same job continues from a checkpoint: version, instruction set,
    /// command, options that change results, and digests of the inputs.
    [[nodiscard]] std::string job_text() const;

private:
    [[nodiscard]] const Json& described_inputs() const;
    /// Command and options as stored in provenance.
    [[nodiscard]] Json options_of_result() const;

    const CLI::App& command_;
    const std::vector<std::string> inputs_;
    const Json& report_;
    mutable Json inputs_described_;  ///< null: not computed yet
    std::string unit_, space_;       ///< empty: unknown
};

}  // namespace covol::tool
