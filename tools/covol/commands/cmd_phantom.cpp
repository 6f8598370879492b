#include "cli/output/report.h"
#include "commands/commands.h"
#include "covol/error.h"
#include "covol/phantom.h"
#include "flags/bindings.h"

namespace covol::tool {
namespace {

/// The phantom's image as bytes; its values are whole numbers, so the conversion is exact.
std::vector<std::uint8_t> bytes_of(const Image& image) {
    const Index3 n = image.geometry().size;
    std::vector<std::uint8_t> values;
    values.reserve(std::size_t(n[0]) * n[1] * n[2]);
    for (int k = 0; k < n[2]; ++k)
        for (int j = 0; j < n[1]; ++j)
            for (int i = 0; i < n[0]; ++i) values.push_back(static_cast<std::uint8_t>(image.at(i, j, k)));
    return values;
}

struct PhantomJob {
    Given<PhantomOptions> given;
    std::string output, points_path, labels_path;

    void run(Session& session) const {
        session.outputs().check("-o", output, OutputKind::Image);
        session.outputs().check("--points", points_path, OutputKind::Points);
        session.outputs().check("--labels", labels_path, OutputKind::Image);
        const auto made = std::make_shared<Phantom>(make_phantom(given.options));
        session.report()["image"] = to_json(made->image.geometry());
        session.report()["points"] = {{"count", made->points.size()}};
        session.outputs().add(output, [made](const std::string& path) {
            write_image(path, made->image.geometry(), bytes_of(made->image).data());
        });
        session.outputs().add(points_path, [made, comment = session.provenance().comment()](const std::string& path) {
            write_points(path, made->points, comment);
        });
        session.outputs().add(labels_path, [made](const std::string& path) {
            write_image(path, made->image.geometry(), made->labels.data());
        });
    }
};

}  // namespace

void add_phantom(Session& session) {
    const auto [job, command] =
        session.add_job<PhantomJob>("phantom", "Make test images of shapes whose true surface is known");
    std::string kinds;
    for (const std::string& kind : list_phantom_kinds()) kinds += (kinds.empty() ? "" : ", ") + kind;
    in_group(*command, Group::Input);
    command->add_option("kind", job->given.options.kind, kinds)->required()->type_name("KIND");
    in_group(*command, Group::Output);
    command->add_option("-o,--output", job->output, "the image")
        ->required()
        ->type_name("OUT.nrrd|.nii.gz|.tif|.mha|.zarr");
    command->add_option("--points", job->points_path, "points on the true surface")->type_name("OUT.xyz|.csv|.ply");
    command->add_option("--labels", job->labels_path, "the true solid as a label image")->type_name("OUT");
    bind_options(*command, job->given, Offered::Always);
}

}  // namespace covol::tool
