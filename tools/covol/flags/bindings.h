#pragma once
#include <algorithm>
#include <functional>
#include <initializer_list>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "cli/options/arguments.h"
#include "cli/options/help.h"
#include "cli/options/option_names.h"
#include "cli/session.h"
#include "covol/mesh_io.h"
#include "covol/pipeline.h"
#include "covol/points.h"
#include "covol/read_marks.h"
#include "covol/vdb_io.h"
#include "flags/given.h"

// Command-line options for the fields of the library's structs, from their tables, and groups of flags that several
// subcommands share.
namespace covol::tool {

/// A number as shown in help and messages.
template <typename Number>
[[nodiscard]] std::string to_text(Number value) {
    std::ostringstream text;
    text << value;
    return text.str();
}

/// Whether this kind of job offers the option; a command for a single step offers all options of the step.
[[nodiscard]] bool is_offered(const OptionInfo& option, Offered job);

// Each of these functions adds an option for one type of values, and calls `take` with each value that is parsed.
// Values out of range throw an Error when they are parsed.
CLI::Option* add_length(CLI::App& command, const OptionInfo& option, const std::function<void(const Length&)>& take);
CLI::Option* add_vec3(CLI::App& command, const OptionInfo& option, const std::function<void(const Vec3&)>& take);
CLI::Option* add_box(CLI::App& command, const OptionInfo& option, const std::function<void(const WorldBox&)>& take);
CLI::Option* add_words(CLI::App& command, const OptionInfo& option, const std::vector<std::string>& words,
                       const std::function<void(std::size_t)>& take);
template <typename Number>
CLI::Option* add_number(CLI::App& command, const OptionInfo& option, const std::function<void(Number)>& take) {
    const std::string flag = flag_of(option.name);
    return command
        .add_option_function<Number>(
            flag,
            [take, flag, range = option.range](const Number& value) {
                range.require(flag, double(value));
                take(value);
            },
            option.text)
        ->type_name(option.range.unit == Unit::Voxels ? "VOXELS"
                    : std::is_integral_v<Number>      ? "N"
                                                      : "NUMBER");
}

/// Adds an option for a field, by its type; null if the type has no kind of option. Lengths are stored in `given` until
/// the voxel size is known.
template <typename Options, typename Value>
CLI::Option* add_option(CLI::App& command, const OptionInfo& option, Value& target, Given<Options>& given) {
    using T = PlainOf<Value>;
    [[maybe_unused]] const auto set = [&target](const T& value) { target = value; };
    if constexpr (std::is_same_v<Value, bool>) {
        return command.add_flag(flag_of(option.name), target, option.text);
    } else if constexpr (HasWords<T>) {
        std::vector<std::string> words;
        for (const char* word : kWords<T>) words.emplace_back(word != nullptr ? word : "");
        CLI::Option* made = add_words(command, option, words, [set](std::size_t n) { set(T(n)); });
        if constexpr (std::is_same_v<T, Value>) made->default_str(words[std::size_t(target)]);
        return made;
    } else if constexpr (kIsNumber<T>) {
        if (option.range.unit == Unit::Length || option.range.unit == Unit::Volume)
            return add_length(command, option,
                              [&given, option](const Length& length) { given.lengths[option.name] = length; });
        CLI::Option* made = add_number<T>(command, option, set);
        if constexpr (std::is_same_v<T, Value>) made->default_str(to_text(target));
        return made;
    } else if constexpr (std::is_same_v<T, Vec3>) {
        return add_vec3(command, option, set);
    } else if constexpr (std::is_same_v<T, std::vector<Vec3>>) {
        return add_vec3(command, option, [&target](const Vec3& v) { target.push_back(v); });
    } else if constexpr (std::is_same_v<T, WorldBox>) {
        return add_box(command, option, set);
    } else {
        return nullptr;
    }
}

/// Adds an option for each row of the table that `job` offers, except for those named in `by_hand`, which the caller
/// adds. With `only`, restricted to this group. `given` must not be moved until the command line has been parsed.
template <typename Options>
void bind_options(CLI::App& command, Given<Options>& given, Offered job,
                  std::initializer_list<std::string_view> by_hand = {}, Group only = Group::None) {
    for_each_option(given.options, [&](OptionInfo option, auto& value) {
        const bool skipped = std::find(by_hand.begin(), by_hand.end(), option.name) != by_hand.end();
        if (skipped || !is_offered(option, job) || (only != Group::None && option.place.group != only)) return;
        if (job == Offered::SingleStep && *option.automatic_alone != 0) option.automatic = option.automatic_alone;
        in_group(command, option.place.group);
        CLI::Option* made = add_option(command, option, value, given);
        if (made == nullptr) return;
        // help_of() shows the text in brackets as the default. It is not set by default_str(), because reports would
        // then contain it as a value.
        const bool is_automatic = *option.automatic != 0;
        made->description(with_flags(option.text) +
                          (is_automatic ? " [" + with_flags(option.automatic) + "]" : std::string()));
        if (is_automatic) made->default_str("");
        made->each([&given, name = std::string(option.name)](const std::string&) { given.names.insert(name); });
    });
}

/// Options of how an image is read, such as corrections of its properties.
struct ImageFlags : Given<ReadImageOptions> {
    /// @param by_hand  options that are not added, such as "roi", which crops the image, and "frame", which selects one
    /// time point, if the command has its own
    void bind(CLI::App& command, std::initializer_list<std::string_view> by_hand = {}) {
        bind_options(command, *this, Offered::SingleStep, by_hand);
    }
    /// The image, or the part of it that --roi selects.
    [[nodiscard]] Image read(const std::string& path, const RunContext& run) const;
    /// The lattice of the image that read() returns.
    [[nodiscard]] ImageGeometry read_geometry(const std::string& path, const RunContext& run) const;
};

/// `box`, extended to everything that a domain with voxels of edge h may sample: its leaves extend beyond the box.
[[nodiscard]] WorldBox sampled_box(const WorldBox& box, double h);

struct PointFlags : Given<ReadPointsOptions> {
    std::vector<std::string> paths;
    /// @param flag  "--points", or the name of a positional argument
    CLI::Option* bind(CLI::App& command, const std::string& flag);
    /// Adds the options for reading files, but not the files.
    void bind_options(CLI::App& command) { tool::bind_options(command, *this, Offered::SingleStep); }
};

/// The options with which files of marks are read; the name "-" stands for standard input.
[[nodiscard]] ReadMarksOptions reading_of(const PointFlags& flags, const RunContext& run);
/// Reads all points, in world units.
[[nodiscard]] std::vector<Vec3> read_world_points(const PointFlags& flags, const std::optional<ImageGeometry>& geometry,
                                                  const RunContext& run);

/// The voxel size h: as given, as a multiple of the automatic one ("2vx"), or automatic. The last two are reported.
/// @param tagged  as for choose_voxel_size()
[[nodiscard]] double resolve_voxel_size(const Length& requested, const Image* image, const std::vector<Vec3>& points,
                                        bool tagged, Session& session);

struct MeshFlags : Given<WriteMeshOptions> {
    bool plain = false;  ///< --plain: the mesh is written by stream_mesh()
    void bind(CLI::App& command);
    void bind_plain(CLI::App& command);
    /// @param path  of the mesh, or empty. @throws UsageError with --plain if the format cannot be streamed.
    void check_plain(const std::string& path) const;
    /// Whether a run that writes no mesh refuses the option with this name (without dashes).
    [[nodiscard]] static bool needs_mesh(std::string_view option) { return option == "up" || option == "unit-scale"; }
    /// @throws UsageError if an option for which needs_mesh() is true is given, but no mesh is written.
    void check_used(bool writes) const;
    [[nodiscard]] WriteMeshOptions write_options(const Session& session) const;
};

/// Refuses a value of the inside in a label image that is not 1 to 255 or that its format cannot store: DICOM
/// segmentations number their segments from 1.
/// @param flag  the option with the value, for messages
/// @param path  of the image, or empty
/// @throws Error InvalidOptions, UsageError
void check_label(const std::string& flag, int label, const std::string& path);

[[nodiscard]] bool is_float_grid(const VdbGridInfo& grid);

}  // namespace covol::tool
