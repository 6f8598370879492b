#pragma once
#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/brick_call.h"
#include "cli/exit_codes.h"
#include "cli/options/help.h"
#include "cli/options/job_options.h"
#include "cli/options/parsed_options.h"
#include "cli/output/json.h"
#include "cli/output/outputs.h"
#include "cli/output/progress.h"
#include "cli/output/run_provenance.h"
#include "cli/system/memory.h"
#include "covol/fwd.h"
#include "covol/image.h"
#include "covol/run.h"
#include "covol/vdb_io.h"

namespace covol::tool {

/// Measures the seconds since its construction.
class Stopwatch {
public:
    [[nodiscard]] double seconds() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
    }

private:
    std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

/// Shared by all subcommands: common flags, the run context, the outputs and the report.
class Session {
public:
    Session();

    /// Adds a subcommand; `body` runs after the whole command line has been parsed.
    CLI::App* add_command(const std::string& name, const std::string& description, std::function<void()> body);

    /// Adds a subcommand whose flags are bound to the members of a Job, and whose body is Job::run(session).
    template <typename Job>
    std::pair<std::shared_ptr<Job>, CLI::App*> add_job(const std::string& name, const std::string& description) {
        const auto job = std::make_shared<Job>();
        return {job, add_command(name, description, [job, this] { job->run(*this); })};
    }

    /// The help texts of the subcommands.
    [[nodiscard]] Help& help() noexcept { return *help_; }

    /// Parses the command line, runs the subcommand and writes the outputs. @returns the exit code.
    int main(int argc, char** argv);

    // For the bodies of subcommands:
    [[nodiscard]] const RunContext& run() const noexcept { return run_; }
    [[nodiscard]] Outputs& outputs() noexcept { return outputs_; }
    /// Queues a .vdb file with one grid; provenance is added to the options' metadata.
    void add_grid(const std::string& path, const FloatGridPtr& grid, WriteVdbOptions options);
    /// The report that --json writes.
    [[nodiscard]] Json& report() noexcept { return report_; }
    [[nodiscard]] const Json& report() const noexcept { return report_; }
    /// The command line of this run, quoted for a shell.
    [[nodiscard]] const std::string& command_line() const noexcept { return command_line_; }
    /// Names of the options that the command line or a configuration file gave, without dashes.
    [[nodiscard]] std::vector<std::string> given() const { return given_names(*command_); }
    /// The command with the settings and inputs that were given.
    [[nodiscard]] JobOptions job() const { return job_of(*command_); }
    /// Whether the option of the current command has this role.
    [[nodiscard]] bool has_role(const std::string& option, OptionRole role) const;
    // note() and warn() replace names of options in messages of the library by flags.
    /// Prints a remark on standard error, unless --quiet is given.
    void note(const std::string& line);
    /// Prints a requested result (info, compare, check), even with --quiet: on standard output, or on standard error if
    /// --json - writes the report to standard output.
    void print(const std::string& line);
    void warn(const std::string& message);
    /// After this call, runs save their state in `checkpoints`, which are removed when the outputs are in place.
    void keep_states(std::shared_ptr<Checkpoints> checkpoints) { run_.checkpoints = std::move(checkpoints); }
    /// The subcommand with that name; null if there is none.
    [[nodiscard]] const CLI::App* command(const std::string& name) const;
    /// To be called before memory is allocated. @param what  names in the message what needs the memory
    /// @throws Error InvalidOptions if `bytes` exceed --memory-limit or, if it is not given, the bound that
    /// choose_memory_bound() derives from the free memory.
    void require_memory(double bytes, const std::string& what) const;
    /// Adds a duration to seconds.<name> of the report. The report also has seconds.total for the whole run.
    void add_seconds(const std::string& name, double seconds);
    /// Whether the command was preceded by `covol plan`: then its cost is estimated, and no output is written.
    [[nodiscard]] bool is_planning() const noexcept { return planning_; }
    /// The step and arguments of `covol brick plan`, `run` or `join`; nullopt for other commands.
    [[nodiscard]] const std::optional<BrickCall>& brick() const noexcept { return brick_; }
    /// --memory-limit, bytes; nullopt if it was not given.
    [[nodiscard]] std::optional<std::uint64_t> memory_limit() const;
    /// Provenance for the outputs of the current command.
    [[nodiscard]] RunProvenance& provenance() noexcept { return *provenance_; }
    [[nodiscard]] const RunProvenance& provenance() const noexcept { return *provenance_; }
    /// Sets the exit code of a run that ends without an error.
    void set_exit_code(int code) { exit_code_ = code; }

private:
    static void add_help_flags(CLI::App& app);
    void add_common_flags();
    int execute();
    int run_command_line(int argc, char** argv);
    void start_report();
    void finish();
    void write_report();
    /// Prints why the run fails, unless the memory guard is already doing so. @returns the exit code
    int fail(int code, const std::string& message);
    int report_failure(int code, const std::string& message);
    [[nodiscard]] std::string interrupted_text() const;
    [[nodiscard]] std::string memory_text() const;

    CLI::App app_;
    std::shared_ptr<Help> help_ = std::make_shared<Help>();
    std::map<const CLI::App*, std::function<void()>> bodies_;
    const CLI::App* command_ = nullptr;

    int threads_ = 0;
    bool quiet_ = false, profile_ = false, strict_ = false, planning_ = false;
    std::string json_path_, save_config_path_, memory_limit_text_;
    MemoryBound memory_bound_;

    std::optional<BrickCall> brick_;
    std::optional<RunProvenance> provenance_;  ///< set by execute()
    std::string command_line_;

    RunContext run_;
    std::unique_ptr<Progress> progress_;
    Outputs outputs_{run_};
    Json report_;
    Stopwatch since_start_;
    int exit_code_ = kDone;
    std::atomic_flag
        is_reporting_end_;  ///< set by the thread that prints the error that ends the run: main thread or memory guard
};

}  // namespace covol::tool
