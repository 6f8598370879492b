#include <memory>

#include "cli/output/report.h"
#include "commands/commands.h"
#include "covol/file_kind.h"
#include "covol/structures.h"
#include "flags/bindings.h"

namespace covol::tool {
namespace {

struct MaskJob {
    std::string input, like, output;
    ImageFlags image;
    int label = 1;
    bool raw = false;

    void run(Session& session) const {
        session.outputs().check("-o", output, OutputKind::Image);
        check_label("--label", label, output);
        const FloatGridPtr level_set = read_vdb_level_set(input, session.run());
        const ImageGeometry geometry = image.read_geometry(like, session.run());
        const auto labels = std::make_shared<LabelImage>(std::vector<Structure>{{"surface", level_set}}, geometry,
                                                         std::vector<int>{label}, is_segmentation_name(output));
        session.report()["mask"] = {{"image", to_json(geometry)}};
        session.outputs().add(output, [this, labels, &session](const std::string& path) {
            write_image(path, *labels, {!raw, like, image.options.frame}, session.run());
            const std::uint64_t inside = labels->voxels_written().front();
            session.report()["mask"]["voxels"] = inside;
            session.note(std::to_string(inside) + " voxels inside");
        });
    }
};

}  // namespace

void add_mask(Session& session) {
    const auto [job, command] = session.add_job<MaskJob>("mask", "Make a label image of a level set");
    in_group(*command, Group::Input);
    command->add_option("level_set", job->input, "a level set; :NAME selects one of several in a file")
        ->required()
        ->type_name("IN.vdb[:NAME]");
    command->add_option("--like", job->like, "image whose lattice is used for the mask")
        ->required()
        ->type_name("IMAGE");
    in_group(*command, Group::Output);
    command->add_option("-o,--output", job->output, "label image")
        ->required()
        ->type_name("OUT.nrrd|.nii.gz|.tif|.mha|.npy|.zarr|.dcm");
    command->add_option("--label", job->label, "value of the inside, 1 to 255; in .dcm only 1")->capture_default_str();
    command->add_flag("--raw", job->raw, "write the voxels of .nrrd and .mha without compression");
    job->image.bind(*command);
}

}  // namespace covol::tool
