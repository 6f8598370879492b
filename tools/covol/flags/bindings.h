#pragma once
#include <algorithm>
#include <functional>
#include <initializer_list>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "cli/arguments.h"
#include "cli/help.h"
#include "cli/option_names.h"
#include "cli/session.h"
#include "covol/mesh_io.h"
#include "covol/pipeline.h"
#include "covol/points.h"
#include "covol/read_marks.h"
#include "covol/vdb_io.h"
#include "flags/given.h"

// Options of the library's structs, by their tables, and groups of flags that several subcommands share.
namespace covol::tool {

/// A number as help and messages show it.
template <typename Number>
[[nodiscard]] std::string to_text(Number value) {
    std::ostringstream text;
    text << value;
    return text.str();
}

/// Whether a job has the option; SingleStep has all of its struct.
[[nodiscard]] bool is_offered(const OptionInfo& option, Offered job);

// An option of each kind. What is out of the option's range is an Error where it is read.
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

/// One for a field, of the field's type; null for a type that has none. A length goes into `given` until h is known.
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

/// An option for each row of the table that `job` has, in a group if one is named, but for those that are bound by
/// hand. `given` has to stay where it is until the command line is read.
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
        // Help shows what stands in brackets as the default; in reports automatic choices are no values of options.
        const bool is_automatic = *option.automatic != 0;
        made->description(with_flags(option.text) +
                          (is_automatic ? " [" + with_flags(option.automatic) + "]" : std::string()));
        if (is_automatic) made->default_str("");
        made->each([&given, name = std::string(option.name)](const std::string&) { given.names.insert(name); });
    });
}

/// The image's own facts that the user corrects.
struct ImageFlags : Given<ReadImageOptions> {
    /// @param by_hand  "roi" crops the image, "frame" takes one time point: commands may have their own
    void bind(CLI::App& command, std::initializer_list<std::string_view> by_hand = {}) {
        bind_options(command, *this, Offered::SingleStep, by_hand);
    }
    /// The image, or the part of it that --roi names.
    [[nodiscard]] Image read(const std::string& path, const RunContext& run) const;
    /// The lattice of read()'s image.
    [[nodiscard]] ImageGeometry read_geometry(const std::string& path, const RunContext& run) const;
};

/// `box` and what voxels of edge h around it may sample: leaves reach beyond a domain.
[[nodiscard]] WorldBox sampled_box(const WorldBox& box, double h);

struct PointFlags : Given<ReadPointsOptions> {
    std::vector<std::string> paths;
    /// `flag` is "--points", or a positional's name.
    CLI::Option* bind(CLI::App& command, const std::string& flag);
    /// How files are understood, without the files.
    void bind_options(CLI::App& command) { tool::bind_options(command, *this, Offered::SingleStep); }
};

/// How files of marks are read; "-" is standard input.
[[nodiscard]] ReadMarksOptions reading_of(const PointFlags& flags, const RunContext& run);
/// World units.
[[nodiscard]] std::vector<Vec3> read_world_points(const PointFlags& flags, const std::optional<ImageGeometry>& geometry,
                                                  const RunContext& run);

/// h, where --voxel-size may be relative ("2vx") to the automatic one. Says which in `session`.
/// @param tagged  of choose_voxel_size()
[[nodiscard]] double resolve_voxel_size(const Length& requested, const Image* image, const std::vector<Vec3>& points,
                                        bool tagged, Session& session);

struct MeshFlags : Given<WriteMeshOptions> {
    bool plain = false;  ///< stream_mesh()
    void bind(CLI::App& command);
    void bind_plain(CLI::App& command);
    /// @param path  of the mesh, or empty. @throws UsageError where its format can't be streamed.
    void check_plain(const std::string& path) const;
    /// @throws UsageError where an option of meshes is given, and `writes` none.
    void check_used(bool writes) const;
    [[nodiscard]] WriteMeshOptions write_options(const Session& session) const;
};

[[nodiscard]] bool is_float_grid(const VdbGridInfo& grid);

}  // namespace covol::tool
