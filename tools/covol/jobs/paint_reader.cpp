#include "jobs/paint_reader.h"

#include <set>
#include <string>

#include "covol/error.h"

namespace covol::tool {

const Painted& PaintReader::of(const StructureInput::Paint& paint, const RunContext& run) {
    const auto known = files_.find(paint.file.get());
    if (known != files_.end()) return known->second;
    const bool force = job_.image.has("spacing");
    return files_.emplace(paint.file.get(), job_.painted.understand(*paint.file, image_, force, run)).first->second;
}

const PaintedLabel& PaintReader::label_of(const StructureInput::Paint& paint, const RunContext& run) {
    for (const PaintedLabel& label : of(paint, run).labels)
        if (label.label == paint.label) return label;
    throw Error(Errc::InvalidInput,
                "--painted: " + paint.file->path + ": label " + std::to_string(paint.label) + " is not there");
}

void PaintReader::add_outlines(const StructureInput& input, Marks& marks, const RunContext& run) {
    for (const StructureInput::Paint& paint : input.paint)
        for (const PaintedView& view : label_of(paint, run).views) {
            PointCloud outlines = view.outlines;
            outlines.points = to_world(outlines, of(paint, run).geometry);
            outlines.space = PointSpace::World;
            marks.drawn.push_back(std::move(outlines));
        }
}

std::shared_ptr<const Contours> PaintReader::own_contours(const StructureInput& input, const Marks& marks, double h,
                                                          const RunContext& run) {
    if (input.paint.size() != 1 || !marks.drawn.empty()) return nullptr;
    const PaintedLabel& label = label_of(input.paint.front(), run);
    if (label.views.empty()) return nullptr;
    auto contours = std::make_shared<Contours>(connect_outlines(label, of(input.paint.front(), run).geometry, h, run));
    run.info("painted: " + contours->summary);
    return contours;
}

void PaintReader::add_seeds(const std::vector<StructureInput>& inputs, std::size_t own, SegmentOptions& options,
                            const RunContext& run) {
    for (std::size_t n = 0; n < inputs.size(); ++n)
        for (const StructureInput::Paint& paint : inputs[n].paint) {
            const std::vector<Vec3>& seeds = label_of(paint, run).inside;
            std::vector<Vec3>& side = n == own ? options.inside : options.outside;
            side.insert(side.end(), seeds.begin(), seeds.end());
        }
    std::set<const PaintedFile*> done;
    for (const StructureInput& input : inputs)
        for (const StructureInput::Paint& paint : input.paint)
            if (done.insert(paint.file.get()).second) {
                const std::vector<Vec3>& outside = of(paint, run).outside;
                options.outside.insert(options.outside.end(), outside.begin(), outside.end());
            }
}

Json PaintReader::report(const StructureInput& input, const RunContext& run) {
    Json list = Json::array();
    for (const StructureInput::Paint& paint : input.paint) {
        Json entry = to_json(label_of(paint, run));
        entry["path"] = paint.file->path;
        list.push_back(entry);
    }
    return list;
}

}  // namespace covol::tool
