#include <openvdb/openvdb.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>

#include "cli/options/arguments.h"
#include "cli/options/job_options.h"
#include "cli/output/json.h"
#include "cli/output/provenance.h"
#include "cli/system/child_run.h"
#include "commands/commands.h"
#include "covol/error.h"
#include "covol/evolve.h"
#include "covol/file_set.h"
#include "covol/safe_text.h"
#include "covol/version.h"
#include "flags/bindings.h"

namespace covol::tool {
namespace fs = std::filesystem;
namespace {

using Words = std::vector<std::string>;

constexpr int kUnlimitedBrickVoxels = 1'000'000'000;  // more voxels than any band that fits into memory

/// What a file states about the run that made it. The file may come from an untrusted source.
struct Provenance {
    std::string version, instruction_set;
    JobOptions job;                                           ///< settings and inputs
    std::vector<std::pair<std::string, std::string>> inputs;  ///< name, digest
};

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
    throw Error(Errc::Unsupported, path + ": " + why);
}

/// Converts a text, a number, a Boolean, or a list of these, to a list of arguments.
Words values_of(const std::string& path, const std::string& name, const Json& value) {
    const auto is_one = [](const Json& one) { return one.is_string() || one.is_number() || one.is_boolean(); };
    const bool is_list = value.is_array() && !value.empty() && std::all_of(value.begin(), value.end(), is_one);
    if (!is_one(value) && !is_list)
        refuse(path, "its metadata is damaged: expected words or numbers for '" + name + "', got " + value.dump());
    Words words;
    for (const Json& one : is_list ? value : Json::array({value}))
        words.push_back(one.is_string() ? one.get<std::string>() : one.dump());
    return words;
}

/// Whether `name` is a file name without a folder. Names that look like options are accepted, because in the command
/// line a name always follows a folder or `--name=`.
bool is_file_name(const std::string& name) {
    return !name.empty() && name != "." && name != ".." &&
           name.find_first_of(std::string("/\0", 2)) == std::string::npos;
}

Provenance read_provenance(const std::string& path) {
    const std::vector<VdbGridInfo> grids = list_vdb(path);
    const auto holds = [](const VdbGridInfo& grid) { return grid.metadata.contains("covol_given"); };
    const auto grid = std::find_if(grids.begin(), grids.end(), holds);
    if (grid == grids.end())
        refuse(path,
               "expected the options of the run that made it (covol_options, covol_given and covol_inputs in its "
               "metadata), got none: another program or an older covol wrote it");
    const auto fact = [&](const char* name) {
        const auto found = grid->metadata.find(name);
        return found == grid->metadata.end() ? std::string() : found->second;
    };
    const auto json = [&](const char* name) { return parse_json(fact(name), path + ": its metadata, " + name); };
    if (!fact("covol_bricks").empty())
        refuse(path, "it was made in bricks; plan, run and join them again (covol brick)");
    Provenance all{fact("covol_version"), fact("covol_instruction_set"), {}, {}};
    try {
        const auto options = json("covol_options").get<std::map<std::string, Json>>();
        for (const Json& input : json("covol_inputs")) {
            all.inputs.emplace_back(input.at("name").get<std::string>(), input.at("digest").get<std::string>());
            if (!is_file_name(all.inputs.back().first))
                refuse(path, "'" + all.inputs.back().first + "': expected a file's name");
        }
        all.job.command = options.at("command").get<std::string>();
        for (const std::string& name : json("covol_given").get<Words>())
            all.job.values.emplace_back(name, values_of(path, name, options.at(name)));
    } catch (const Json::exception& error) {
        refuse(path, std::string("its metadata is damaged: ") + error.what());
    } catch (const std::out_of_range&) {
        refuse(path, "its metadata is damaged: options are missing in covol_options");
    }
    if (all.job.command == "rerun") refuse(path, "it was made by a rerun: rerun the original result instead");
    return all;
}

/// Finds the inputs of a run in the given folders, by name and digest.
class Inputs {
public:
    Inputs(std::string source, const Provenance& run, std::vector<std::string> folders)
        : source_(std::move(source)), folders_(std::move(folders)) {
        for (const auto& [name, digest] : run.inputs) found_.emplace_back(name, find(name, digest));
    }

    /// The value of an option, with the current path of the input instead of its file name.
    /// @throws Error if the value names a file that is not an input of the run, or is "-", standard input
    [[nodiscard]] std::string placed(const std::string& option, const std::string& value) const {
        if (value == "-")
            refuse(source_,
                   "an input of that run came through a pipe, which cannot be read again; repeat the run with a file");
        const std::size_t begin = path_within(value).first;
        for (const auto& [name, path] : found_)
            for (const std::size_t from : {begin, std::size_t(0)}) {
                if (value.compare(from, name.size(), name) != 0) continue;
                const std::string rest = value.substr(from + name.size());
                if (is_within_file(rest)) return value.substr(0, from) + path + rest;
            }
        if (const std::string pattern = placed_frames(value, begin); !pattern.empty()) return pattern;
        if (!names_no_file(value))
            refuse(source_, "'" + option + "' names " + value +
                                ", which is not among the inputs that the file lists (covol_inputs)");
        return value;
    }

    [[nodiscard]] std::vector<std::string> paths() const {
        std::vector<std::string> all;
        for (const auto& [name, path] : found_) all.push_back(path);
        return all;
    }

private:
    /// Whether `rest`, the text after a file name, is empty, a slash, or a colon with the name of a grid or the path of
    /// a dataset.
    static bool is_within_file(const std::string& rest) {
        return rest.empty() || rest == "/" || (rest.front() == ':' && rest.find("..") == std::string::npos);
    }

    /// Whether the value of an option is a position such as 1,2,3 or NAME=1,2,3, or a value of --init without a file.
    static bool names_no_file(const std::string& value) {
        try {
            return parse_start("", value).path.empty();
        } catch (const std::exception&) {
        }
        try {
            static_cast<void>(parse_vec3("", split_name(value).value));
            return true;
        } catch (const std::exception&) {
            return false;
        }
    }

    /// A value such as NAME=marks_{frame}.csv with the folder of the inputs that match it; empty if no input matches.
    /// @throws Error if these inputs are in several folders
    [[nodiscard]] std::string placed_frames(const std::string& value, std::size_t begin) const {
        const auto parts = around_frame(value.substr(begin));
        std::string folder;
        for (const auto& [name, path] : found_) {
            if (!parts || !is_frame(name, *parts)) continue;
            const std::string own = fs::path(path).parent_path().string();
            if (!folder.empty() && own != folder)
                refuse(source_,
                       value + ": expected the files of all frames in one folder, got " + folder + " and " + own);
            folder = own;
        }
        return folder.empty() ? "" : value.substr(0, begin) + folder + "/" + value.substr(begin);
    }

    [[nodiscard]] std::string find(const std::string& name, const std::string& digest) const {
        std::string seen;
        for (const std::string& folder : folders_) {
            // The path is absolute, so that a '=' in it is not read as NAME=FILE: names of structures contain no slash.
            const fs::path path = fs::absolute(folder) / name;
            std::error_code status;
            if (!fs::is_regular_file(path, status) && !fs::is_directory(path, status)) continue;
            if (digest_of(path.string()) == digest) return path.string();
            seen += (seen.empty() ? "" : ", ") + (fs::path(folder) / name).string();
        }
        std::string where;
        for (const std::string& folder : folders_) where += (where.empty() ? "" : ", ") + folder;
        if (seen.empty())
            throw Error(Errc::Io,
                        name + ": an input of that run is not in " + where + "; name its folder with --inputs");
        throw Error(Errc::InvalidInput, seen + ": not the file that the run read: expected " + digest);
    }

    std::string source_;
    std::vector<std::string> folders_;
    std::vector<std::pair<std::string, std::string>> found_;
};

/// The job with the current locations of its inputs. Its .vdb outputs are placed in `folder`; the others are omitted,
/// together with the settings that are invalid without a mesh.
/// @throws Error for options that a file may not set, and if the job makes no .vdb
JobOptions job_here(const std::string& path, const JobOptions& given, const CLI::App& command, const Inputs& inputs,
                    const fs::path& folder) {
    JobOptions job{given.command, {}};
    bool makes_vdb = false;
    for (const auto& [name, values] : given.values) {
        const OptionRole role = role_of(option_of_job(command, name, path));
        if (MeshFlags::needs_mesh(name)) continue;
        Words placed;
        for (const std::string& value : values) {
            if (role == OptionRole::Input) placed.push_back(inputs.placed(name, value));
            if (role == OptionRole::Setting) placed.push_back(value);
            if (role != OptionRole::Output || fs::path(value).extension() != ".vdb") continue;
            // Only the file name is used: covol stores no folders, but a file from an untrusted source may contain one.
            const std::string file = fs::path(value).filename().string();
            if (!is_file_name(file)) refuse(path, "'" + name + "': expected a file's name, got " + value);
            placed.push_back((folder / file).string());
            makes_vdb = true;
        }
        if (!placed.empty()) job.values.emplace_back(name, placed);
    }
    if (!makes_vdb) refuse(path, "the run of '" + given.command + "' in its metadata makes no .vdb");
    return job;
}

fs::path temporary_folder() {
    std::error_code status;
    fs::path folder = fs::temp_directory_path(status);
    if (!status) return folder;
    const char* const named = std::getenv("TMPDIR");
    throw Error(Errc::Io, std::string("the folder for temporary files (TMPDIR), ") +
                              (named != nullptr ? named : "/tmp") + ": " + status.message() +
                              "; name another one, or keep the result with -o");
}

/// Differences between two grids of the same name.
struct Difference {
    bool same_layout = true;  ///< transform, background, tree of nodes and active voxels
    std::uint64_t voxels = 0;
    double largest = 0;
};

Difference compare(const FloatGrid& one, const FloatGrid& other) {
    Difference difference;
    difference.same_layout = one.transform() == other.transform() && one.background() == other.background() &&
                             one.tree().hasSameTopology(other.tree()) &&
                             one.tree().leafCount() == other.tree().leafCount();
    const auto add = [&](float a, float b, std::uint64_t voxels) {
        if (std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b)) return;
        difference.voxels += voxels;
        difference.largest = std::max(difference.largest, std::abs(double(a) - double(b)));
    };
    auto leaf = one.tree().cbeginLeaf(), same = other.tree().cbeginLeaf();
    for (; leaf && same; ++leaf, ++same)
        for (openvdb::Index n = 0; n < leaf->SIZE; ++n) add(leaf->getValue(n), same->getValue(n), 1);
    auto tile = one.tree().cbeginValueAll();
    tile.setMaxDepth(decltype(tile)::getLeafDepth() - 1);
    for (const auto other_at = other.getConstAccessor(); tile; ++tile)
        add(*tile, other_at.getValue(tile.getCoord()), tile.getVoxelCount());
    return difference;
}

struct RerunJob {
    std::string path, kept;
    std::vector<std::string> folders;

    void run(Session& session) const {
        const Provenance made = read_provenance(path);
        if (made.version != version())
            session.warn(path + ": it was written by covol " + made.version + ", but this is " + version() +
                         ": results may differ");
        if (made.instruction_set != instruction_set())
            session.warn(path + ": it was made with " + made.instruction_set + ", but this run uses " +
                         instruction_set() + ": values may differ by 1e-4 voxels (COVOL_SIMD=" + made.instruction_set +
                         " selects that one if the processor supports it)");
        std::vector<std::string> places = folders;
        const fs::path own = fs::path(path).parent_path();
        for (const fs::path& folder : {own.empty() ? fs::path(".") : own, fs::path(".")})
            if (std::find(places.begin(), places.end(), folder.string()) == places.end())
                places.push_back(folder.string());
        const CLI::App* const command = session.command(made.job.command);
        if (command == nullptr) refuse(path, "this covol has no command '" + made.job.command + "'");
        const Inputs inputs(path, made, places);
        session.outputs().protect(inputs.paths());
        session.outputs().check("-o", kept, OutputKind::Vdb);
        const auto scratch =
            std::make_shared<KeptFolder>(kept.empty() ? temporary_folder() : fs::path(kept).parent_path());
        const Words words = command_line_of(job_here(path, made.job, *command, inputs, scratch->path()), *command, path,
                                            run_options(made.job, *command, session));
        std::string shown = "covol";
        for (const std::string& word : words) shown += " " + shell_quoted(word);
        session.note("running " + shown);
        const Stopwatch watch;
        const int code = run_this_program(words, session.run());
        if (code != kDone)
            throw Error(Errc::InvalidInput, path + ": the repeated run ended with exit code " + std::to_string(code));
        session.add_seconds("run", watch.seconds());
        const std::string again = result_in(*scratch);
        report(again, session);
        session.outputs().add(kept, [scratch, again](const std::string& to) { fs::rename(again, to); });
    }

private:
    static Words run_options(const JobOptions& job, const CLI::App& command, const Session& session) {
        Words words{"--quiet"};
        if (session.run().threads > 0) words.push_back("--threads=" + std::to_string(session.run().threads));
        if (const auto limit = session.memory_limit()) {
            words.push_back("--memory-limit=" + std::to_string(*limit));
            // The repeated run must not be divided into bricks, because its result would not be bitwise identical.
            const bool given = std::any_of(job.values.begin(), job.values.end(),
                                           [](const auto& option) { return option.first == "brick-voxels"; });
            if (!given && command.get_option_no_throw("--brick-voxels") != nullptr)
                words.push_back("--brick-voxels=" + std::to_string(kUnlimitedBrickVoxels));
        }
        return words;
    }

    /// The .vdb output with the name of the original file, or, if the original file was renamed, the only .vdb output.
    /// @throws Error if no output has this name and there is not exactly one.
    [[nodiscard]] std::string result_in(const KeptFolder& scratch) const {
        std::vector<fs::path> made;
        for (const fs::directory_entry& entry : fs::directory_iterator(scratch.path()))
            if (entry.path().extension() == ".vdb") made.push_back(entry.path());
        for (const fs::path& file : made)
            if (file.filename() == fs::path(path).filename()) return file.string();
        if (made.size() != 1)
            refuse(path, "its run makes " + std::to_string(made.size()) + " .vdb files, none with this name");
        return made.front().string();
    }

    void report(const std::string& again, Session& session) const {
        bool same = true;
        std::uint64_t voxels = 0;
        Json& facts = session.report()["rerun"];
        for (const VdbGridInfo& info : list_vdb(path)) {
            const FloatGridPtr one = read_vdb(path, info.name), other = read_vdb(again, info.name);
            const Difference found = compare(*one, *other);
            facts["grids"].push_back({{"name", info.name},
                                      {"same_layout", found.same_layout},
                                      {"differing_voxels", found.voxels},
                                      {"largest_difference", found.largest}});
            voxels += one->activeVoxelCount();
            if (found.same_layout && found.voxels == 0) continue;
            same = false;
            session.print(safe_text(info.name) + ": " +
                          (found.same_layout
                               ? std::to_string(found.voxels) + " voxels differ, by up to " + to_text(found.largest)
                               : "the sets of active voxels differ"));
        }
        facts["same"] = same;
        if (same) return session.print("bit-identical: " + std::to_string(voxels) + " active voxels");
        session.set_exit_code(kBadInput);
    }
};

}  // namespace

void add_rerun(Session& session) {
    const auto [job, command] = session.add_job<RerunJob>(
        "rerun", "Repeat the run that made a .vdb, with the settings that the file contains, and compare the results");
    in_group(*command, Group::Input);
    command
        ->add_option("file", job->path, "a .vdb that covol wrote; exit code 3 if the new result is not bit-identical")
        ->required()
        ->type_name("FILE.vdb");
    command
        ->add_option("--inputs", job->folders,
                     "folders with the files that the run read [the folder of FILE.vdb, and the current folder]")
        ->type_name("FOLDER...");
    in_group(*command, Group::Output);
    command->add_option("-o,--output", job->kept, "keep the result of the new run in this file")->type_name("OUT.vdb");
}

}  // namespace covol::tool
