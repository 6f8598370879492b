
#include <algorithm>
#include <vector>

#include "cli/output/report.h"
#include "commands/commands.h"
#include "covol/error.h"
#include "covol/file_kind.h"
#include "covol/image_stream.h"
#include "covol/vdb_io.h"
#include "flags/bindings.h"
#include "flags/cloud_flags.h"
#include "flags/vdb_flags.h"
#include "jobs/image_grid.h"

namespace covol::tool {
namespace {

OutputKind output_kind(FileKind kind) {
    switch (kind) {
        case FileKind::Vdb: return OutputKind::Vdb;
        case FileKind::Image: return OutputKind::Image;
        case FileKind::Mesh: return OutputKind::Mesh;
        case FileKind::Points: break;
    }
    return OutputKind::Points;
}

/// The voxels of an image in their original type.
class SameVoxels : public PixelSource {
public:
    explicit SameVoxels(const Image& image) : PixelSource(image.geometry(), image.pixel_type(), false), image_(image) {}
    void fill(const VoxelBox& box, void* out) const override {
        switch (type()) {
            case PixelType::UInt8: return fill_through_floats(box, static_cast<std::uint8_t*>(out));
            case PixelType::Int8: return fill_through_floats(box, static_cast<std::int8_t*>(out));
            case PixelType::UInt16: return fill_through_floats(box, static_cast<std::uint16_t*>(out));
            case PixelType::Int16: return fill_through_floats(box, static_cast<std::int16_t*>(out));
            case PixelType::Float: return image_.copy(box, static_cast<float*>(out));
            case PixelType::UInt32: return fill_one_by_one(box, static_cast<std::uint32_t*>(out));
            case PixelType::Int32: return fill_one_by_one(box, static_cast<std::int32_t*>(out));
            case PixelType::Double: return fill_one_by_one(box, static_cast<double*>(out));
        }
    }

private:
    /// Converts values through floats, for types whose values a float represents exactly.
    template <typename T>
    void fill_through_floats(const VoxelBox& box, T* out) const {
        const Index3 n = box.size();
        std::vector<float> values(std::size_t(n[0]) * n[1] * n[2]);
        image_.copy(box, values.data());
        std::transform(values.begin(), values.end(), out, [](float v) { return static_cast<T>(v); });
    }
    template <typename T>
    void fill_one_by_one(const VoxelBox& box, T* out) const {
        for (int k = box.min[2]; k <= box.max[2]; ++k)
            for (int j = box.min[1]; j <= box.max[1]; ++j)
                for (int i = box.min[0]; i <= box.max[0]; ++i) *out++ = static_cast<T>(image_.at(i, j, k));
    }

    Image image_;
};

struct ConvertJob {
    std::string input, output, like, grid_name;
    Length voxel_size;
    ImageFlags image;
    MeshFlags mesh;
    PointFlags points;  ///< only its options for reading files are used, not its paths
    CloudFlags cloud_flags;
    VdbFlags vdb;

    void image_to_vdb(Session& session) const {
        const Image pixels = image.read(input, session.run());
        session.provenance().set_world(pixels.geometry());
        const double finest = choose_voxel_size(pixels).voxel_size;
        const double h = voxel_size.resolve(finest, finest);
        session.require_memory(bytes_of_grid(pixels.geometry(), h),
                               "a grid with voxels of " + to_text(h) + " for the whole image");
        const FloatGridPtr grid = to_grid(pixels, h, session.run());
        session.report()["image"] = to_json(pixels.geometry());
        session.report()["grid"] = {{"voxel_size", h}, {"domain", to_json(domain_of(*grid))}};
        session.add_grid(output, grid, vdb.options);
    }

    void vdb_to_image(Session& session) const {
        const FloatGridPtr grid = read_vdb(input, grid_name);
        const ImageGeometry geometry = like.empty() ? geometry_of(*grid) : image.read_geometry(like, session.run());
        session.require_memory(sizeof(float) * double(geometry.size[0]) * geometry.size[1] * geometry.size[2],
                               "the image");
        const auto values = std::make_shared<std::vector<float>>(sample(*grid, geometry, session.run()));
        session.report()["image"] = to_json(geometry);
        session.outputs().add(
            output, [values, geometry](const std::string& path) { write_image(path, geometry, values->data()); });
    }

    /// Writes the voxels of an image unchanged in another format.
    void image_to_image(Session& session) const {
        if (!like.empty())
            throw UsageError(
                "--like: not applicable if an image is converted to an image, because the voxels are not resampled");
        const auto pixels = std::make_shared<const SameVoxels>(image.read(input, session.run()));
        session.report()["image"] = to_json(pixels->geometry());
        session.outputs().add(output, [pixels, this, &session](const std::string& path) {
            write_image(path, *pixels, {true, input}, session.run());
        });
    }

    /// Writes the file's float grids, or the named one, with the compression of the options.
    void vdb_to_vdb(Session& session) const {
        std::vector<FloatGridPtr> grids;
        const VdbGridName file = split_grid_name(input);
        const std::string name = grid_name.empty() ? file.grid : grid_name;
        for (const VdbGridInfo& info : list_vdb(input)) {
            if (!name.empty() && info.name != name) continue;
            if (is_float_grid(info))
                grids.push_back(read_vdb(file.path, info.name));
            else
                session.warn(input + ": grid '" + info.name + "' holds " + info.type + ", and is left out");
        }
        if (grids.empty()) grids.push_back(read_vdb(file.path, name));  // throws an error that lists the grids
        session.provenance().set_world(*grids.front());
        if (is_nanovdb_name(output))
            return session.outputs().add(output, [grids](const std::string& path) { write_nvdb(path, grids); });
        session.outputs().add(output, [grids, write = vdb.options](const std::string& path) {
            write_vdb(path, grids, write);  // the metadata of the grids, with their provenance, is kept
        });
    }

    void convert_points(Session& session) const {
        std::optional<ImageGeometry> geometry;
        if (!like.empty()) geometry = read_image_geometry(like, image.options, session.run());
        const PointCloud cloud = read_points(input, points.options);
        std::vector<Vec3> world = geometry ? to_world(cloud, *geometry) : to_world(cloud);
        geometry ? session.provenance().set_world(*geometry) : session.provenance().set_world_of_points();
        if (geometry) check_inside(cloud, *geometry, session.run());
        session.note(input + ": " + std::to_string(world.size()) + " points, " + cloud.rule);
        Json& report = session.report()["points"];
        report = {{"count", world.size()}, {"rule", cloud.rule}};
        if (cloud_flags.length("simplify").in_voxels && !geometry)
            throw UsageError("--simplify: a length in voxels needs --like IMAGE");
        const double h = geometry ? geometry->smallest_spacing() : 1;
        if (const CloudCleanupOptions cleanup = cloud_flags.cleanup(h); cleanup.any()) {
            CloudCleanupReport done;
            world = clean_cloud(world, cleanup, session.run(), &done);
            report["cleanup"] = to_json(done);
        }
        session.outputs().add(output, [world, comment = session.provenance().comment()](const std::string& path) {
            write_points(path, world, comment);
        });
    }

    void convert_mesh(Session& session) const {
        const auto triangles = std::make_shared<TriangleMesh>(read_mesh(input));
        session.report()["mesh"] = to_json(measure(*triangles));
        session.outputs().add(output, [triangles, write = mesh.write_options(session)](const std::string& path) {
            write_mesh(path, *triangles, write);
        });
    }

    void run(Session& session) const {
        const FileKind from = kind_of_file(input);
        const FileKind to = kind_of_output(output, from);
        session.outputs().check("OUT", output, is_nanovdb_name(output) ? OutputKind::NanoVdb : output_kind(to));
        mesh.check_used(from == FileKind::Mesh);
        vdb.check_used(to == FileKind::Vdb);
        cloud_flags.check_used(from == FileKind::Points);
        cloud_flags.check();
        if (from == FileKind::Image && to == FileKind::Vdb) return image_to_vdb(session);
        if (from == FileKind::Image && to == FileKind::Image) return image_to_image(session);
        if (from == FileKind::Vdb && to == FileKind::Image) return vdb_to_image(session);
        if (from == FileKind::Vdb && to == FileKind::Vdb) return vdb_to_vdb(session);
        if (from == FileKind::Points && to == FileKind::Points) return convert_points(session);
        if (from == FileKind::Mesh && to == FileKind::Mesh) return convert_mesh(session);
        throw Error(Errc::Unsupported,
                    std::string("convert: ") + input + " holds " + to_string(from) + ", " + output + " would hold " +
                        to_string(to) +
                        ": expected image and image or .vdb; .vdb and .vdb, .nvdb or image; points and "
                        "points; or mesh and mesh; see also covol mesh, mask and segment --init");
    }
};

}  // namespace

void add_convert(Session& session) {
    const auto [job, command] = session.add_job<ConvertJob>(
        "convert",
        "Convert an image to .vdb and back, image to image, .vdb to .vdb or .nvdb, points to points, mesh to mesh");
    in_group(*command, Group::Input);
    command->add_option("input", job->input, "the file to read")->required()->type_name("IN");
    in_group(*command, Group::Output);
    command->add_option("output", job->output, "the file to write")->required()->type_name("OUT");
    in_group(*command, Group::Input);
    command
        ->add_option("--like", job->like,
                     "image whose lattice the result gets, or to which points in voxel indices belong")
        ->type_name("IMAGE");
    command->add_option("--grid", job->grid_name, "grid to take from a .vdb file [the first]")->type_name("NAME");
    in_group(*command, Group::Output);
    add_length(*command, {"voxel_size", kPositiveLength, {}, "edge length of the voxels of a .vdb file"},
               [job = job](const Length& length) { job->voxel_size = length; })
        ->default_str("smallest spacing");
    job->points.bind_options(*command);
    job->cloud_flags.bind(*command, false);
    job->mesh.bind(*command);
    job->image.bind(*command);
    job->vdb.bind(*command);
    session.help().show_first(*command, {"--like", "--grid", "--voxel-size", "--remove-outliers", "--simplify",
                                         "--smooth", "--up", "--unit-scale", "--channel", "--frame"});
}

}  // namespace covol::tool
