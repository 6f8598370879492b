#pragma once
#include <memory>
#include <string>
#include <vector>

#include "covol/painted.h"
#include "flags/bindings.h"

namespace covol::tool {

/// A label image that somebody painted, as its file holds it.
struct PaintedFile {
    std::string path, name;  ///< name: NAME=FILE
    Image image;
    std::vector<LabelName> labels;  ///< without the outside label
};

/// --painted and what belongs to it.
struct PaintedFlags : Given<PaintedOptions> {
    std::vector<std::string> paths;

    void bind(CLI::App& command);
    /// @throws UsageError for NAME=FILE with several labels; Error
    [[nodiscard]] std::vector<std::shared_ptr<const PaintedFile>> read(const RunContext& run) const;
    /// In the image's space, understood. Says what was understood.
    /// @param force  --spacing was given: label images of as many voxels take it over
    [[nodiscard]] Painted understand(const PaintedFile& file, const ImageGeometry& image, bool force,
                                     const RunContext& run) const;
};

/// What the report tells of one label.
[[nodiscard]] Json to_json(const PaintedLabel& label);

}  // namespace covol::tool
