#include "flags/painted_flags.h"

namespace covol::tool {

void PaintedFlags::bind(CLI::App& command) {
    in_group(command, Group::Marks);
    command
        .add_option("--painted", paths,
                    "label images painted on some slices or in some places; each label is a structure")
        ->type_name("[NAME=]FILE...");
    bind_options(command, *this, Offered::Always);
}

std::vector<std::shared_ptr<const PaintedImage>> PaintedFlags::read(const RunContext& run) const {
    std::vector<std::shared_ptr<const PaintedImage>> images;
    RunContext silent = run;
    silent.log = {};
    for (const std::string& text : paths) {
        run.check();
        const Named named = split_name(text);
        PaintedImage painted = make_painted(read_image(named.value, {}, silent), options);
        if (!named.name.empty() && painted.labels.size() > 1)
            throw UsageError("--painted: " + text + ": expected one label in a file with a name, got " +
                             std::to_string(painted.labels.size()) +
                             "; leave the name out, because each label is a structure");
        painted.name = named.name;
        images.push_back(std::make_shared<const PaintedImage>(std::move(painted)));
    }
    return images;
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
