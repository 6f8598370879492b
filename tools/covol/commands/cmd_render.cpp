#include <algorithm>

#include "cli/options/option_names.h"
#include "commands/commands.h"
#include "covol/error.h"
#include "covol/render.h"
#include "covol/structures.h"
#include "flags/bindings.h"
#include "jobs/level_sets.h"
#include "jobs/name_tag.h"
#include "jobs/page.h"

namespace covol::tool {
namespace {

constexpr int kMaxFrames = 9999;

struct RenderJob {
    std::string input, output, image_path, view = "iso";
    PointFlags points;
    ImageFlags image;
    std::vector<std::string> opacities;
    std::optional<FigureKind> figure;
    int turntable = 0;
    Given<RenderOptions> given;

    void run(Session& session) const {
        if (turntable < 0 || turntable > kMaxFrames)
            throw Error(Errc::InvalidOptions, "--turntable: expected 0 to " + std::to_string(kMaxFrames) + ", got " +
                                                  std::to_string(turntable));
        for (int n = 0; n < std::max(1, turntable); ++n)
            session.outputs().check("-o", frame_path(n), OutputKind::Picture);
        require_valid_flags(given.options);
        static_cast<void>(parse_view(view, false));
        const std::vector<NamedLevelSet> level_sets = read_level_sets(input, session.run());
        std::optional<Image> pixels;
        if (!image_path.empty()) pixels = image.read(image_path, session.run());
        RenderScene scene;
        for (const NamedLevelSet& found : level_sets) {
            RenderStructure structure;
            structure.name = found.name;
            structure.surface = found.surface.get();
            if (level_sets.size() > 1) structure.color = structure_color(scene.structures.size());
            scene.structures.push_back(structure);
        }
        add_opacities(scene);
        add_marks(scene, pixels ? std::optional(pixels->geometry()) : std::nullopt, session.run());
        if (pixels) {
            scene.image = &*pixels;
            scene.is_anatomical = is_anatomical(image_path, image.options, session.run());
        }
        scene.unit = pixels && !pixels->geometry().unit.empty() ? pixels->geometry().unit : stated_unit();
        RenderOptions chosen = given.options;
        chosen.view = parse_view(view, scene.is_anatomical);
        chosen.figure = figure.value_or(turntable > 0 ? FigureKind::Surface : FigureKind::Composed);
        const Stopwatch watch;
        if (turntable == 0) {
            const auto picture = std::make_shared<Picture>(render(scene, chosen, session.run()));
            session.outputs().add(output, [picture](const std::string& path) { write_png(path, *picture); });
        } else {
            write_frames(scene, chosen, session);
        }
        session.add_seconds("render", watch.seconds());
    }

private:
    /// Writes each frame as soon as it is rendered, because many large frames would not fit into memory.
    void write_frames(const RenderScene& scene, RenderOptions chosen, Session& session) const {
        chosen.whole_turn = true;
        const double first = chosen.view.azimuth;
        for (int n = 0; n < turntable; ++n) {
            session.run().report("frames", double(n) / turntable);
            chosen.view.azimuth = first + 360.0 * n / turntable;
            const Picture picture = render(scene, chosen, session.run());
            session.outputs().write(frame_path(n), [&](const std::string& path) { write_png(path, picture); });
        }
    }

    /// "turn_0001.png" for "turn.png"; the unchanged name if there is only one picture.
    [[nodiscard]] std::string frame_path(int n) const {
        if (turntable == 0) return output;
        return with_suffix(output, "_" + padded(n + 1, 4));
    }

    /// The unit of length that the .vdb states; empty if it states none.
    [[nodiscard]] std::string stated_unit() const {
        for (const VdbGridInfo& grid : list_vdb(input))
            if (const auto found = grid.metadata.find("covol_unit"); found != grid.metadata.end())
                return found->second == "not stated" ? "" : found->second;
        return "";
    }

    static std::vector<std::string> names_of(const RenderScene& scene) {
        std::vector<std::string> names;
        for (const RenderStructure& structure : scene.structures) names.push_back(structure.name);
        return names;
    }

    void add_opacities(RenderScene& scene) const {
        for (const std::string& text : opacities) {
            const Named given = split_name(text);
            const double value = parse_fraction(given.value);
            if (given.name.empty())
                for (RenderStructure& structure : scene.structures) structure.opacity = value;
            else
                scene.structures[owner_of(names_of(scene), "--opacity", given, "FRACTION")].opacity = value;
        }
    }

    static double parse_fraction(const std::string& text) {
        const double value = parse_number("--opacity", text);
        if (!(value >= 0 && value <= 1)) throw UsageError("--opacity: expected [NAME=]FRACTION, 0 to 1, got " + text);
        return value;
    }

    void add_marks(RenderScene& scene, const std::optional<ImageGeometry>& geometry, const RunContext& run) const {
        for (const std::string& text : points.paths) {
            const Named file = split_name(text);
            PointFlags own = points;
            own.paths = {file.value};
            const std::vector<Vec3> marks = read_world_points(own, geometry, run);
            const bool loose = file.name.empty() && scene.structures.size() > 1;
            std::vector<Vec3>& to =
                loose ? scene.marks : scene.structures[owner_of(names_of(scene), "--points", file, "FILE")].marks;
            to.insert(to.end(), marks.begin(), marks.end());
        }
    }
};

void add_picture_options(CLI::App& command, RenderJob& job) {
    in_group(command, Group::Picture);
    command
        .add_option_function<std::string>(
            "--size",
            [&job](const std::string& text) {
                const auto size = parse_size("--size", text);
                job.given.options.width = size[0];
                job.given.options.height = size[1];
            },
            "size of the picture in pixels")
        ->type_name("WIDTHxHEIGHT")
        ->default_str(to_text(job.given.options.width) + "x" + to_text(job.given.options.height));
    add_words(command, {"figure", {}, {}, "the surfaces beside slices of the image, or only one of the two"},
              {"composed", "surface", "slices"}, [&job](std::size_t n) { job.figure = FigureKind(n); })
        ->default_str("composed; surface for a turntable");
    command
        .add_option(
            "--view", job.view,
            "where the surfaces are seen from: front|back|left|right|top|bottom|iso, or azimuth (0 front, 90 from "
            "+x) and elevation in degrees")
        ->type_name("NAME|AZ,EL")
        ->capture_default_str();
    command
        .add_option("--opacity", job.opacities,
                    "opacity of the surfaces, 0 to 1, for all of them or for one by its name [1; 0.35 around other "
                    "structures; 0.16 with --volume]")
        ->type_name("[NAME=]FRACTION...");
    bind_options(command, job.given, Offered::Always);
    add_words(command, {"slice_axis", {}, {}, "axis of the image along which slices are taken"}, {"x", "y", "z"},
              [&job](std::size_t n) { job.given.options.slice_axis = int(n); })
        ->default_str("the axis across the marked slices, else z");
    add_words(command, {"background", {}, {}, "colour of the background"}, {"black", "white"}, [&job](std::size_t n) {
        job.given.options.white_background = n == 1;
    })->default_str("white");
    command
        .add_option("--turntable", job.turntable,
                    "N frames of a whole turn about the vertical axis: OUT_0001.png, OUT_0002.png, ... [0]")
        ->type_name("N");
}

}  // namespace

void add_render(Session& session) {
    const auto [job, command] = session.add_job<RenderJob>(
        "render",
        "Draw a figure: shaded surfaces with marks and a scale bar, and slices of the image with their outlines");
    bind_level_sets(*command, job->input);
    in_group(*command, Group::Output);
    command->add_option("-o,--output", job->output, "the picture")->required()->type_name("OUT.png");
    in_group(*command, Group::Input);
    command->add_option("--image", job->image_path, "image for slices and the volume view")->type_name("IMAGE");
    job->points.bind(*command, "--points")
        ->description("marks to show; for several level sets with their names, ve=FILE exe=FILE")
        ->type_name("[NAME=]FILE...");
    add_picture_options(*command, *job);
    job->image.bind(*command);
    session.help().show_first(*command, {"--image", "--points", "--size", "--figure", "--view", "--slices", "--opacity",
                                         "--volume", "--turntable"});
}

}  // namespace covol::tool
