#include <openvdb/openvdb.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <thread>

#include "cli/arguments.h"
#include "cli/json.h"
#include "cli/provenance.h"
#include "commands/commands.h"
#include "covol/error.h"
#include "covol/evolve.h"
#include "covol/file_set.h"
#include "covol/version.h"

namespace covol::tool {
namespace fs = std::filesystem;
namespace {

using Words = std::vector<std::string>;

constexpr int kOneBrick = 1'000'000'000;  // voxels, more than any band that a run holds at once

/// What a file says of the run that made it.
struct Provenance {
    std::string version, instruction_set, command;
    std::map<std::string, Json> options;                      ///< words, numbers, flags, or lists of them, none empty
    Words given;                                              ///< which of them
    std::vector<std::pair<std::string, std::string>> inputs;  ///< name, digest
};

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
    throw Error(Errc::Unsupported, path + ": " + why);
}

void check_value(const std::string& path, const std::string& name, const Json& value) {
    const auto is_one = [](const Json& one) { return one.is_string() || one.is_number() || one.is_boolean(); };
    if (is_one(value) || (value.is_array() && !value.empty() && std::all_of(value.begin(), value.end(), is_one)))
        return;
    refuse(path, "its metadata is damaged: expected words or numbers of '" + name + "', got " + value.dump());
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
    if (!fact("covol_bricks").empty())
        refuse(path, "it was made in bricks; plan, run and join them again (covol brick)");
    Provenance all{fact("covol_version"), fact("covol_instruction_set"), {}, {}, {}, {}};
    try {
        all.options = Json::parse(fact("covol_options")).get<std::map<std::string, Json>>();
        all.given = Json::parse(fact("covol_given")).get<Words>();
        for (const Json& input : Json::parse(fact("covol_inputs"))) {
            all.inputs.emplace_back(input.at("name").get<std::string>(), input.at("digest").get<std::string>());
            const std::string& name = all.inputs.back().first;
            if (name.empty() || fs::path(name).filename() != name)
                refuse(path, "'" + name + "': expected a file's name");
        }
        all.command = all.options.at("command").get<std::string>();
        for (const std::string& name : all.given) check_value(path, name, all.options.at(name));
    } catch (const Json::exception& error) {
        refuse(path, std::string("its metadata is damaged: ") + error.what());
    } catch (const std::out_of_range&) {
        refuse(path, "its metadata is damaged: options are missing in covol_options");
    }
    if (all.command == "rerun") refuse(path, "a rerun made it: repeat the run that it repeated");
    return all;
}

/// Where the inputs of a run are now.
class Inputs {
public:
    Inputs(const Provenance& run, std::vector<std::string> folders) : folders_(std::move(folders)) {
        for (const auto& [name, digest] : run.inputs) found_.emplace_back(name, find(name, digest));
    }

    /// The value of an option with the path of the file that it names.
    [[nodiscard]] std::string placed(const std::string& value) const {
        const auto [begin, end] = path_within(value);
        for (const auto& [name, path] : found_)
            for (const std::size_t from : {begin, std::size_t(0)}) {
                const bool is_named = value.compare(from, name.size(), name) == 0;
                const std::size_t after = from + name.size();
                // a grid's name or a dataset's place may follow, or the slash of a folder
                if (is_named && (after >= value.size() || value[after] == ':' || value[after] == '/'))
                    return value.substr(0, from) + path + value.substr(after);
            }
        // names with the number of a frame in them
        if (value.find('{') != std::string::npos)
            return value.substr(0, begin) + folders_.front() + "/" + value.substr(begin);
        return value;
    }

private:
    [[nodiscard]] std::string find(const std::string& name, const std::string& digest) const {
        std::string seen;
        for (const std::string& folder : folders_) {
            const fs::path path = fs::path(folder) / name;
            if (!fs::exists(path)) continue;
            if (digest_of(path.string()) == digest) return path.string();
            seen += (seen.empty() ? "" : ", ") + path.string();
        }
        std::string where;
        for (const std::string& folder : folders_) where += (where.empty() ? "" : ", ") + folder;
        if (seen.empty())
            throw Error(Errc::Io,
                        name + ": an input of that run is not in " + where + "; name its folder with --inputs");
        throw Error(Errc::InvalidInput, seen + ": not the file that the run read: expected " + digest);
    }

    std::vector<std::string> folders_;
    std::vector<std::pair<std::string, std::string>> found_;
};

Words values_of(const Json& value) {
    Words words;
    for (const Json& one : value.is_array() ? value : Json::array({value}))
        words.push_back(one.is_string() ? one.get<std::string>() : one.dump());
    return words;
}

/// The command line of the run, with those of its outputs that are .vdb, in that folder.
Words command_line(const std::string& path, const Provenance& run, const CLI::App* command, const Inputs& inputs,
                   const std::string& folder) {
    if (command == nullptr) refuse(path, "this covol has no command '" + run.command + "'");
    Words words{run.command}, positional;
    for (const std::string& name : run.given) {
        const CLI::Option* option = command->get_option_no_throw("--" + name);
        const bool is_positional = option == nullptr;
        if (is_positional) option = command->get_option_no_throw(name);
        if (option == nullptr) refuse(path, "this covol has no option '" + name + "' of '" + run.command + "'");
        Words values = values_of(run.options.at(name));
        const bool is_output = option->get_type_name().starts_with("OUT");
        if (is_output && name != "output" && fs::path(values.front()).extension() != ".vdb") continue;
        for (std::string& value : values) {
            if (value == "-") refuse(path, "an input of that run came through a pipe");
            // only a file's name is written down; that of a stranger's file may be a path
            value = is_output ? (fs::path(folder) / fs::path(value).filename()).string() : inputs.placed(value);
        }
        if (is_positional) {
            positional.insert(positional.end(), values.begin(), values.end());
        } else if (option->get_expected_max() == 0) {
            words.push_back("--" + name + (values.front() == "true" ? "" : "=" + values.front()));
        } else {
            words.push_back("--" + name);
            words.insert(words.end(), values.begin(), values.end());
        }
    }
    words.insert(words.begin() + 1, positional.begin(), positional.end());
    return words;
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

/// @return exit code @throws Error Cancelled
int run_covol(const Words& words, const RunContext& run) {
    std::string self = fs::read_symlink("/proc/self/exe").string();
    Words all{self};
    all.insert(all.end(), words.begin(), words.end());
    std::vector<char*> argv;
    for (std::string& word : all) argv.push_back(word.data());
    argv.push_back(nullptr);
    pid_t child = 0;
    if (const int why = ::posix_spawn(&child, self.c_str(), nullptr, nullptr, argv.data(), environ); why != 0)
        throw Error(Errc::Io, self + ": cannot start: " + std::strerror(why));
    int status = 0;
    pid_t ended = 0;
    for (bool told = false; (ended = ::waitpid(child, &status, WNOHANG)) == 0;) {
        if (run.cancelled() && !told) told = ::kill(child, SIGTERM) == 0;
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    run.check();
    if (ended < 0) throw Error(Errc::Io, self + ": lost: " + std::strerror(errno));
    return WIFEXITED(status) ? WEXITSTATUS(status) : kDefect;
}

/// Where two grids of one name differ.
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
        session.outputs().check("-o", kept, OutputKind::Vdb);
        const Provenance made = read_provenance(path);
        if (made.version != version())
            session.warn(path + ": covol " + made.version + " wrote it, this is " + version() + ": bits may differ");
        if (made.instruction_set != instruction_set())
            session.warn(path + ": it was made with " + made.instruction_set + ", this processor has " +
                         instruction_set() + ": values may differ by 1e-4 voxels (COVOL_SIMD=" + made.instruction_set +
                         " chooses another where the processor has it)");
        std::vector<std::string> places = folders;
        const fs::path own = fs::path(path).parent_path();
        for (const fs::path& folder : {own.empty() ? fs::path(".") : own, fs::path(".")})
            if (std::find(places.begin(), places.end(), folder.string()) == places.end())
                places.push_back(folder.string());
        const auto scratch =
            std::make_shared<ScratchFolder>(kept.empty() ? temporary_folder() : fs::path(kept).parent_path());
        const Words words =
            command_line(path, made, session.command(made.command), Inputs(made, places), scratch->path().string());
        std::string shown = "covol";
        for (const std::string& word : words) shown += " " + word;
        session.note("running " + shown);
        Words quiet = words;
        quiet.push_back("--quiet");
        if (session.run().threads > 0) quiet.insert(quiet.end(), {"--threads", std::to_string(session.run().threads)});
        if (const auto limit = session.memory_limit()) {
            quiet.insert(quiet.end(), {"--memory-limit", std::to_string(*limit)});
            // a run that went on in bricks would end with other bits
            if (session.command(made.command)->get_option_no_throw("--brick-voxels") != nullptr &&
                std::find(made.given.begin(), made.given.end(), "brick-voxels") == made.given.end())
                quiet.insert(quiet.end(), {"--brick-voxels", std::to_string(kOneBrick)});
        }
        const Stopwatch watch;
        const int code = run_covol(quiet, session.run());
        if (code != kDone)
            throw Error(Errc::InvalidInput, path + ": its run ends with exit code " + std::to_string(code) + " now");
        session.add_seconds("run", watch.seconds());
        const std::string again = result_in(*scratch);
        report(again, session);
        session.outputs().add(kept, [scratch, again](const std::string& to) { fs::rename(again, to); });
    }

private:
    /// The file of that name; of a run with one .vdb that was renamed since, that one.
    [[nodiscard]] std::string result_in(const ScratchFolder& scratch) const {
        std::vector<fs::path> made;
        for (const fs::directory_entry& entry : fs::directory_iterator(scratch.path()))
            if (entry.path().extension() == ".vdb") made.push_back(entry.path());
        for (const fs::path& file : made)
            if (file.filename() == fs::path(path).filename()) return file.string();
        if (made.size() != 1)
            refuse(path, "its run makes " + std::to_string(made.size()) + " .vdb files, none of this name");
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
            session.say(info.name + ": " +
                        (found.same_layout ? std::to_string(found.voxels) + " voxels differ, by up to " +
                                                 std::to_string(found.largest)
                                           : "other voxels are active than before"));
        }
        facts["same"] = same;
        if (same) return session.say("the same bits: " + std::to_string(voxels) + " active voxels");
        session.set_exit_code(kBadInput);
    }
};

}  // namespace

void add_rerun(Session& session) {
    const auto [job, command] = session.add_job<RerunJob>(
        "rerun", "Repeat the run that made a .vdb, from what the file says of it, and compare");
    in_group(*command, Group::Input);
    command->add_option("file", job->path, "a .vdb that covol wrote; exit code 3 where the bits differ now")
        ->required()
        ->type_name("FILE.vdb");
    command
        ->add_option("--inputs", job->folders,
                     "folders with the files that the run read [the folder of FILE.vdb, and where the command runs]")
        ->type_name("FOLDER...");
    in_group(*command, Group::Output);
    command->add_option("-o,--output", job->kept, "keep what the run makes now")->type_name("OUT.vdb");
}

}  // namespace covol::tool
