#include "covol/read_marks.h"

#include "covol/error.h"
#include "covol/file_kind.h"
#include "covol/mesh_io.h"
#include "covol/points_text.h"
#include "covol/vdb_io.h"

namespace covol {

void add_marks(Marks& marks, const std::string& path, const KindedPoints& points,
               const std::optional<ImageGeometry>& image, const RunContext& run) {
    const PointCloud cloud = points.of(MarkKind::Surface);
    if (!points.kinds.empty())
        for (const MarkKind kind : {MarkKind::Inside, MarkKind::Outside})
            if (PointCloud seeds = points.of(kind); !seeds.points.empty())
                (kind == MarkKind::Inside ? marks.inside : marks.outside).push_back(std::move(seeds));
    if (cloud.points.empty()) return;
    if (!cloud.lines.empty())
        run.warn(
            path + ": its marks form " + std::to_string(cloud.lines.size()) +
            " lines, but are used as separate points here; give the file with `contours` to join them along the lines");
    add_points(marks, cloud, image, run);
    run.info(path + ": " + std::to_string(cloud.points.size()) + " points" +
             (cloud.rule.empty() ? "" : ", " + cloud.rule));
}

void read_marks(Marks& marks, const std::optional<ImageGeometry>& image, const ReadMarksOptions& options,
                const RunContext& run) {
    const auto read_kinds = [&](const std::string& path) {
        run.check();
        return path == "-" && options.standard_input
                   ? KindedPoints{parse_points(options.standard_input(), "standard input", options.points), {}}
                   : read_kinded_points(path, options.points);
    };
    const auto read = [&](const std::string& path) { return read_kinds(path).cloud; };
    for (const std::string& path : marks.files.points) add_marks(marks, path, read_kinds(path), image, run);
    for (const std::string& path : marks.files.contours) add_contours(marks, read(path), image, run);
    for (const std::string& path : marks.files.inside) marks.inside.push_back(read(path));
    for (const std::string& path : marks.files.outside) marks.outside.push_back(read(path));
    if (!marks.files.guess.empty())
        marks.guess = [path = marks.files.guess, image, options](const RunContext& own) {
            return read_guess(path, image, options, own);
        };
}

Start read_start(const Start& kind, const std::string& path, const RunContext& run) {
    if (is_any<MeshStart>(kind)) return MeshStart{std::make_shared<const TriangleMesh>(read_mesh(path))};
    if (is_any<MaskStart>(kind)) return MaskStart{std::make_shared<const Image>(read_image(path, {}, run))};
    return is_any<LevelSetStart>(kind) ? LevelSetStart{read_vdb_level_set(path, run)} : kind;
}

GivenGuess read_guess(const std::string& path, const std::optional<ImageGeometry>& image,
                      const ReadMarksOptions& options, const RunContext& run) {
    const FileKind kind = kind_of_file(path);
    if (kind == FileKind::Points)
        throw Error(Errc::InvalidInput, "`guess`: " + path + ": expected a mask, mesh or level set, got points",
                    "guess");
    if (kind != FileKind::Image) {
        GivenGuess guess;
        guess.start = read_start(kind == FileKind::Vdb ? Start(LevelSetStart{}) : Start(MeshStart{}), path, run);
        return guess;
    }
    RunContext silent = run;
    silent.log = {};
    GivenGuess guess = make_guess(read_image(path, {}, silent), options.guess_label, image, options.force_geometry);
    run.info("`guess` " + path + ": label " + std::to_string(guess.label));
    return guess;
}

}  // namespace covol
