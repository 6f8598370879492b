#include "commands/commands.h"
#include "covol/error.h"
#include "covol/render.h"
#include "flags/bindings.h"

namespace covol::tool {
namespace {

struct RenderJob {
    std::string input, output, image_path;
    PointFlags points;
    ImageFlags image;
    RenderOptions options;

    void run(Session& session) const {
        session.outputs().check("-o", output, OutputKind::Picture);
        if (const std::string why = options.why_invalid(); !why.empty())
            throw Error(Errc::InvalidOptions, "render: " + why);
        const FloatGridPtr level_set = read_vdb_level_set(input, session.run());
        std::optional<Image> pixels;
        if (!image_path.empty()) pixels = image.read(image_path, session.run());
        const WorldPoints cloud = read_world_points(points, pixels ? &pixels->geometry() : nullptr, session.run());
        const Stopwatch watch;
        const auto picture =
            std::make_shared<Picture>(pixels ? render(*level_set, *pixels, cloud.points, options, session.run())
                                             : render(*level_set, options, session.run()));
        session.add_seconds("render", watch.seconds());
        session.outputs().add(output, [picture](const std::string& path) { write_png(path, *picture); });
    }
};

}  // namespace

void add_render(Session& session) {
    const auto [job, command] =
        session.add_job<RenderJob>("render", "A picture: the shaded surface, slices with its outline and the points");
    in_group(*command, Group::Input);
    command->add_option("level_set", job->input, "a level set; of several in a file, :NAME picks one")
        ->required()
        ->type_name("IN.vdb[:NAME]");
    in_group(*command, Group::Output);
    command->add_option("-o,--output", job->output, "the picture")->required()->type_name("OUT.png");
    in_group(*command, Group::Input);
    command->add_option("--image", job->image_path, "image for the slices")->type_name("IMAGE");
    job->points.bind(*command, "--points");
    in_group(*command, Group::Output);
    command
        ->add_option_function<std::string>(
            "--size",
            [job = job](const std::string& text) {
                const auto size = parse_size("--size", text);
                job->options.width = size[0];
                job->options.height = size[1];
            },
            "of the picture, in pixels")
        ->type_name("WIDTHxHEIGHT")
        ->default_str(std::to_string(job->options.width) + "x" + std::to_string(job->options.height));
    command->add_option("--slices", job->options.slices, "panels with slices")->capture_default_str();
    job->image.bind(*command);
    session.help().show_first(*command, {"--image", "--points", "--size", "--slices", "--channel", "--frame", "--roi"});
}

}  // namespace covol::tool
