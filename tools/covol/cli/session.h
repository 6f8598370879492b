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

/// Seconds since construction.
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

    /// The same for a Job whose members the flags are bound to: its run(session) is the body.
    template <typename Job>
    std::pair<std::shared_ptr<Job>, CLI::App*> add_job(const std::string& name, const std::string& description) {
        const auto job = std::make_shared<Job>();
        return {job, add_command(name, description, [job, this] { job->run(*this); })};
    }

    /// Help of the subcommands.
    [[nodiscard]] Help& help() noexcept { return *help_; }

    /// Parses, runs and writes. @returns the exit code.
    int main(int argc, char** argv);

    // For the bodies of subcommands:
    [[nodiscard]] const RunContext& run() const noexcept { return run_; }
    [[nodiscard]] Outputs& outputs() noexcept { return outputs_; }
    /// Queues a .vdb file with one grid; provenance is added to the options' metadata.
    void add_grid(const std::string& path, const FloatGridPtr& grid, WriteVdbOptions options);
    /// The report that --json writes.
    [[nodiscard]] Json& report() noexcept { return report_; }
    [[nodiscard]] const Json& report() const noexcept { return report_; }
    /// Quoted for a shell.
    [[nodiscard]] const std::string& command_line() const noexcept { return command_line_; }
    /// Names of the options that the command line or a configuration file gave, without dashes.
    [[nodiscard]] std::vector<std::string> given() const { return given_names(*command_); }
    /// The given settings and inputs, as data.
    [[nodiscard]] JobOptions job() const { return job_of(*command_); }
    /// For an option of the current command.
    [[nodiscard]] bool has_role(const std::string& option, OptionRole role) const;
    // note() and warn() replace option names in messages of the library by flags.
    /// Progress and remarks: not printed with --quiet.
    void note(const std::string& line);
    /// Requested results (info, compare, check), on standard output; on standard error if --json - uses standard
    /// output. Always printed.
    void print(const std::string& line);
    void warn(const std::string& message);
    /// From here on the state of runs is saved there, until the outputs are in place.
    void keep_states(std::shared_ptr<Checkpoints> checkpoints) { run_.checkpoints = std::move(checkpoints); }
    /// The command of that name, for its options; null if there is none.
    [[nodiscard]] const CLI::App* command(const std::string& name) const;
    /// Throws early if at least `bytes` are needed for `what`, and exceed --memory-limit or the free memory.
    void require_memory(double bytes, const std::string& what) const;
    /// Adds to seconds.<name> of the report; seconds.total covers the whole run.
    void add_seconds(const std::string& name, double seconds);
    /// The command was preceded by `covol plan`: its cost is estimated, and no output is written.
    [[nodiscard]] bool is_planning() const noexcept { return planning_; }
    /// The command was preceded by `covol brick`.
    [[nodiscard]] const std::optional<BrickCall>& brick() const noexcept { return brick_; }
    /// --memory-limit, bytes; nullopt if it was not given.
    [[nodiscard]] std::optional<std::uint64_t> memory_limit() const;
    /// Of the command that runs.
    [[nodiscard]] RunProvenance& provenance() noexcept { return *provenance_; }
    [[nodiscard]] const RunProvenance& provenance() const noexcept { return *provenance_; }
    /// The run succeeded, but ends with this exit code.
    void set_exit_code(int code) { exit_code_ = code; }

private:
    static void add_help_flags(CLI::App& app);
    void add_common_flags();
    int execute();
    int run_command_line(int argc, char** argv);
    void start_report();
    void finish();
    void write_report();
    /// Reports why the run fails, unless the memory guard is already doing so.
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
    std::optional<RunProvenance> provenance_;  ///< from execute() on
    std::string command_line_;

    RunContext run_;
    std::unique_ptr<Progress> progress_;
    Outputs outputs_{run_};
    Json report_;
    Stopwatch since_start_;
    int exit_code_ = kDone;
    std::atomic_flag
        is_reporting_end_;  ///< a run prints one error only: from its own thread or from the memory guard's
};

}  // namespace covol::tool
