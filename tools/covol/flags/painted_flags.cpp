#include "flags/painted_flags.h"

#include "covol/error.h"

namespace covol::tool {

void PaintedFlags::bind(CLI::App& command) {
    in_group(command, Group::Marks);
    command
        .add_option("--painted", paths,
                    "label images painted on some slices or in some places; each label is a structure")
        ->type_name("[NAME=]FILE...");
    bind_options(command, *this, Offered::Always);
}

std::vector<std::shared_ptr<const PaintedFile>> PaintedFlags::read(const RunContext& run) const {
    std::vector<std::shared_ptr<const PaintedFile>> files;
    RunContext silent = run;
    silent.log = {};
    for (const std::string& text : paths) {
        run.check();
        const Named named = split_name(text);
        auto file = std::make_shared<PaintedFile>(
            PaintedFile{named.value, named.name, read_image(named.value, {}, silent), {}});
        for (LabelName& label : find_painted_labels(file->image))
            if (label.label != options.outside_label) file->labels.push_back(std::move(label));
        if (!named.name.empty()) {
            if (file->labels.size() > 1)
                throw UsageError("--painted: " + text + ": expected one label in a file with a name, got " +
                                 std::to_string(file->labels.size()) +
                                 "; leave the name out, each label is a structure");
            for (LabelName& label : file->labels) label.name = named.name;
        }
        files.push_back(std::move(file));
    }
    return files;
}

Painted PaintedFlags::understand(const PaintedFile& file, const ImageGeometry& image, bool force,
                                 const RunContext& run) const {
    Painted painted = understand_painted(placed_on(file.image, image, force), file.labels, options, run);
    for (const PaintedLabel& label : painted.labels) run.info(file.path + ": " + label.summary);
    if (options.outside_label != 0)
        run.info(file.path + ": label " + std::to_string(options.outside_label) + ": outside of every structure");
    return painted;
}

Json to_json(const PaintedLabel& label) {
    Json views = Json::array();
    for (const PaintedView& view : label.views)
        views.push_back({{"axis", std::string(1, "xyz"[view.axis])},
                         {"slices", view.slices},
                         {"outlines", view.outlines.lines.size()}});
    return {{"label", label.label},
            {"voxels", label.voxels},
            {"slices", views},
            {"scribbled", label.inside.size()},
            {"understood", label.summary}};
}

}  // namespace covol::tool
