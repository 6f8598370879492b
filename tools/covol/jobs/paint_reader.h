#pragma once
#include <cstddef>
#include <map>
#include <memory>
#include <vector>

#include "jobs/marks.h"
#include "jobs/structure_inputs.h"

namespace covol::tool {

/// Paint as marks: outlines of whole slices, and seeds. Paint of one structure is outside of the others.
class PaintReader {
public:
    PaintReader(const SegmentJob& job, const ImageGeometry& image) : job_(job), image_(image) {}

    /// Outlines in the world, to be joined with contours from files.
    void add_outlines(const StructureInput& input, Marks& marks, const RunContext& run);
    /// The only view of the only file, which needs no common lattice; or null.
    [[nodiscard]] std::shared_ptr<const Contours> own_contours(const StructureInput& input, const Marks& marks,
                                                               double h, const RunContext& run);
    /// @param own  which of the inputs the options are for
    void add_seeds(const std::vector<StructureInput>& inputs, std::size_t own, SegmentOptions& options,
                   const RunContext& run);
    [[nodiscard]] Json report(const StructureInput& input, const RunContext& run);

private:
    /// What every file says; once for each.
    const Painted& of(const StructureInput::Paint& paint, const RunContext& run);
    const PaintedLabel& label_of(const StructureInput::Paint& paint, const RunContext& run);

    const SegmentJob& job_;
    const ImageGeometry& image_;
    std::map<const PaintedFile*, Painted> files_;
};

}  // namespace covol::tool
