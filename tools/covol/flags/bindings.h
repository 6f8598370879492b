#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "cli/arguments.h"
#include "cli/help.h"
#include "cli/session.h"
#include "covol/mesh_io.h"
#include "covol/pipeline.h"
#include "covol/points.h"
#include "covol/vdb_io.h"
#include "flags/world_points.h"

// Groups of flags that several subcommands share. Each binds to its own struct; lengths in voxels are resolved
// once h is known.
namespace covol::tool {

/// A number as help and messages show it.
[[nodiscard]] std::string to_text(double value);

/// An option that is a length.
CLI::Option* add_length(CLI::App& command, const std::string& flag, Length& target, const std::string& shown_default,
                        const std::string& description);

/// An option that is one of several words, which configuration files keep as such. Where the description names no
/// automatic choice, in brackets at its end, help shows the value that `target` has now.
template <typename T>
CLI::Option* add_choice(CLI::App& command, const std::string& flag, T& target, const std::map<std::string, T>& choices,
                        const std::string& description) {
    std::string names, text = description;
    for (const auto& [name, value] : choices) {
        names += (names.empty() ? "" : "|") + name;
        if (value == target && !description.ends_with(']')) text += " [" + name + "]";
    }
    return command
        .add_option_function<std::string>(
            flag, [&target, choices](const std::string& word) { target = choices.at(CLI::detail::to_lower(word)); },
            text)
        ->check(CLI::IsMember(choices, CLI::ignore_case).description(""))
        ->type_name(names);
}

/// The image's own facts that the user corrects.
struct ImageFlags {
    ReadImageOptions options;
    /// @param with_roi    --roi crops the image; commands with a domain have their own
    /// @param with_frame  --frame takes one time point; commands that take several have their own
    void bind(CLI::App& command, bool with_roi = true, bool with_frame = true);
    /// The image, or the part of it that --roi names.
    [[nodiscard]] Image read(const std::string& path, const RunContext& run) const;
    /// The lattice of read()'s image.
    [[nodiscard]] ImageGeometry read_geometry(const std::string& path, const RunContext& run) const;
};

/// `box` and what voxels of edge h around it may sample: leaves reach beyond a domain.
[[nodiscard]] WorldBox sampled_box(const WorldBox& box, double h);

struct PointFlags {
    std::vector<std::string> paths;
    ReadPointsOptions options;
    /// `flag` is "--points", or a positional's name.
    CLI::Option* bind(CLI::App& command, const std::string& flag);
    /// How files are understood, without the files.
    void bind_options(CLI::App& command);
};

[[nodiscard]] WorldPoints read_world_points(const PointFlags& flags, const ImageGeometry* geometry,
                                            const RunContext& run);

/// Where the domain lies and how fine it is.
struct DomainFlags {
    Length voxel_size, margin;
    std::optional<WorldBox> roi;
    std::optional<Vec3> lattice_origin;
    void bind(CLI::App& command, bool with_margin);
    /// h, where --voxel-size may be relative ("2vx") to the automatic one. Says which in `session`.
    /// @param tagged  of choose_voxel_size()
    [[nodiscard]] double resolve_voxel_size(const Image* image, const std::vector<Vec3>& points, bool tagged,
                                            Session& session) const;
};

struct TagFlags {
    Length tag_distance;
    std::vector<Vec3> exterior_seeds;
    std::vector<std::pair<std::string, Vec3>> named_seeds;  ///< of one structure among several
    /// With `names`, seeds may be written name:x,y,z.
    void bind(CLI::App& command, bool names = false);
};

struct EdgeFlags {
    Length sigma;
    EdgeOptions options;
    /// @param alone  the single step, which knows of no marks
    void bind(CLI::App& command, bool alone = false);
    [[nodiscard]] EdgeOptions resolve(double h) const;
};

struct EvolveFlags {
    Length delta, tau, attraction_range;
    std::optional<double> guess_weight;
    EvolveOptions options;
    /// @param with_image  without one there is no rho
    /// @param alone       the single step: what is automatic elsewhere is as in EvolveOptions
    void bind(CLI::App& command, bool with_image, bool alone = false);
    [[nodiscard]] EvolveOptions resolve(double h) const;
};

struct MeshFlags {
    std::optional<bool> y_up;
    double unit_scale = 1.0;
    bool plain = false;  ///< stream_mesh()
    void bind(CLI::App& command);
    void bind_plain(CLI::App& command);
    /// @param path  of the mesh, or empty. @throws UsageError where its format can't be streamed.
    void check_plain(const std::string& path) const;
    /// Checks before the long work. @throws Error InvalidOptions.
    void check() const;
    [[nodiscard]] WriteMeshOptions options(const Session& session) const;
};

[[nodiscard]] bool is_float_grid(const VdbGridInfo& grid);

/// A flag that is "x,y,z", once or many times.
void add_vec3(CLI::App& command, const std::string& flag, std::vector<Vec3>& target, const std::string& description);

}  // namespace covol::tool
