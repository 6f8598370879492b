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
#include "cli/help.h"
#include "cli/job_options.h"
#include "cli/json.h"
#include "cli/memory.h"
#include "cli/outputs.h"
#include "cli/progress.h"
#include "covol/error.h"
#include "covol/fwd.h"
#include "covol/image.h"
#include "covol/run.h"
#include "covol/vdb_io.h"

namespace covol::tool {

/// Exit codes of the program.
enum ExitCode {
    kDone = 0,
    kDefect = 1,
    kUsage = 2,
    kBadInput = 3,
    kIo = 4,
    kWarned = 5,
    kNumerical = 6,
    kInterrupted = 130
};

[[nodiscard]] int exit_code_of(Errc code);

/// Seconds since construction.
class Stopwatch {
public:
    [[nodiscard]] double seconds() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
    }

private:
    std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

/// What all subcommands share: the flags that every one takes, the run context, the outputs and the report.
class Session {
public:
    Session();

    /// A subcommand; `body` runs after the whole command line has been understood.
    CLI::App* add_command(const std::string& name, const std::string& description, std::function<void()> body);

    /// The same for a Job, to whose members the flags are bound: its run(session) is the body.
    template <typename Job>
    std::pair<std::shared_ptr<Job>, CLI::App*> add_job(const std::string& name, const std::string& description) {
        const auto job = std::make_shared<Job>();
        return {job, add_command(name, description, [job, this] { job->run(*this); })};
    }

    /// What the help of a subcommand shows.
    [[nodiscard]] Help& help() noexcept { return *help_; }

    /// Parses, runs and writes. @returns the exit code.
    int main(int argc, char** argv);

    // For the bodies of subcommands.
    [[nodiscard]] const RunContext& run() const noexcept { return run_; }
    [[nodiscard]] Outputs& outputs() noexcept { return outputs_; }
    /// Queues a .vdb file with one grid; the provenance comes on top of the options.
    void add_grid(const std::string& path, const FloatGridPtr& grid, WriteVdbOptions options);
    /// The report that --json writes.
    [[nodiscard]] Json& report() noexcept { return report_; }
    [[nodiscard]] const Json& report() const noexcept { return report_; }
    /// As a shell takes it.
    [[nodiscard]] const std::string& command_line() const noexcept { return command_line_; }
    /// Names of the options that the command line or a configuration file gave, without dashes.
    [[nodiscard]] std::vector<std::string> given() const;
    /// What was given, as data: settings and inputs.
    [[nodiscard]] JobOptions job() const { return job_of(*command_); }
    /// Of an option of the command that runs.
    [[nodiscard]] bool has_role(const std::string& option, OptionRole role) const;
    // note() and warn() put flags for the options that a line of the library names.
    /// Progress and remarks: silent with --quiet.
    void note(const std::string& line);
    /// The result that was asked for (info, compare, check), on standard output; on standard error where --json - has
    /// that. Never silent.
    void print(const std::string& line);
    void warn(const std::string& message);
    /// What lengths and places mean in what is written: the image's unit and LPS; of points alone their own.
    void set_world(const ImageGeometry& geometry);
    void set_world_of_points();
    /// The same as of a grid that was read.
    void set_world(const FloatGrid& grid);
    /// Provenance for the metadata of .vdb files: version, options with the names of files, not of their folders,
    /// digests of the inputs, the numbers that were used once they are known, the unit of length and the space.
    [[nodiscard]] std::map<std::string, std::string> metadata() const;
    /// The same as comment lines for meshes and points.
    [[nodiscard]] std::vector<std::string> comments() const;
    [[nodiscard]] std::string comment() const;
    /// What tells this run from others: version, command, options that change results, digests of the inputs.
    [[nodiscard]] std::string job_text() const;
    /// From here on runs keep their states there, until the outputs are in place.
    void keep_states(std::shared_ptr<Checkpoints> checkpoints) { run_.checkpoints = std::move(checkpoints); }
    /// The command of that name, for its options; null where there is none.
    [[nodiscard]] const CLI::App* command(const std::string& name) const;
    /// Refuses early what cannot fit into --memory-limit, or into what is free: `bytes` for `what` are needed at least.
    void require_memory(double bytes, const std::string& what) const;
    /// Adds to seconds.<name> of the report; seconds.total is the whole run's.
    void add_seconds(const std::string& name, double seconds);
    /// The command stands behind `covol plan`: it says what it would take, and makes nothing.
    [[nodiscard]] bool is_planning() const noexcept { return planning_; }
    /// The command stands behind `covol brick`.
    [[nodiscard]] const std::optional<BrickCall>& brick() const noexcept { return brick_; }
    /// --memory-limit, bytes; none where it was not given.
    [[nodiscard]] std::optional<std::uint64_t> memory_limit() const;
    /// The files that the command line names to be read.
    [[nodiscard]] const std::vector<std::string>& inputs() const noexcept { return inputs_; }
    /// Ctrl-C was how the person ends this command: it is no interruption.
    static void take_interrupt();
    /// The run went well, but ends with this exit code.
    void set_exit_code(int code) { exit_code_ = code; }

private:
    static void add_help_flags(CLI::App& app);
    void add_common_flags();
    int execute();
    int run_command_line(int argc, char** argv);
    void start_report();
    void finish();
    void write_report();
    /// Says why the run fails, unless the memory guard does so now.
    int fail(int code, const std::string& message);
    int report_failure(int code, const std::string& message);
    [[nodiscard]] std::string interrupted_text() const;
    [[nodiscard]] const Json& described_inputs() const;
    /// Command and options as provenance has them.
    [[nodiscard]] Json options_of_result() const;
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
    std::vector<std::string> inputs_;
    mutable Json inputs_described_;  ///< null: not yet
    std::string command_line_;
    std::string unit_, space_;  ///< empty: not known

    RunContext run_;
    std::unique_ptr<Progress> progress_;
    Outputs outputs_{run_};
    Json report_;
    Stopwatch since_start_;
    int exit_code_ = kDone;
    std::atomic_flag has_last_word_;  ///< a run ends with one error, said by its own thread or by the memory guard's
};

}  // namespace covol::tool
