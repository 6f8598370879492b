#include "cli/session.h"

#include <unistd.h>

#include <iostream>

#include "cli/options/arguments.h"
#include "cli/options/config_file.h"
#include "cli/options/first_steps.h"
#include "cli/options/nearest.h"
#include "cli/options/option_names.h"
#include "cli/options/parse_errors.h"
#include "cli/output/profile.h"
#include "cli/system/cancel_signals.h"
#include "cli/system/process.h"
#include "cli/system/thread_limit.h"
#include "covol/checkpoints.h"
#include "covol/error.h"
#include "covol/evolve.h"
#include "covol/safe_text.h"
#include "covol/version.h"

namespace covol::tool {
namespace {

/// Joins the lines of a message that lists several problems into one line, with "; " between them.
std::string one_line(std::string text) {
    while (!text.empty() && text.back() == '\n') text.pop_back();
    for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos;) text.replace(at, 1, "; ");
    return safe_text(text);
}

/// Translates `covol help segment` into `covol segment --help`. @throws UsageError
std::vector<std::string> words_of_help(std::vector<std::string> words, const CLI::App& program) {
    words.erase(words.begin());
    if (!words.empty() && !words[0].starts_with('-')) {
        if (words.size() > 1 && !words[1].starts_with('-'))
            throw UsageError("help: expected one command, as in covol help " + words[0]);
        if (const std::string unknown = unknown_name(program, {words[0]}); !unknown.empty()) throw UsageError(unknown);
    }
    words.emplace_back("--help");
    return words;
}

constexpr int kReportSchema = 1;   // is incremented when a field of the report is removed or changes its meaning
constexpr int kMaxThreads = 1024;  // maximum of --threads; TBB cannot allocate the stacks of far more

}  // namespace

Session::Session() : app_("covol: segment 3D images with the help of a point cloud, on sparse OpenVDB grids") {
    app_.name("covol");
    app_.require_subcommand(1);
    app_.formatter(help_);
    app_.footer("covol COMMAND --help, or covol help COMMAND, shows the options of a command.");
    add_help_flags(app_);
    app_.set_version_flag("--version", std::string("covol ") + version() + "\n" + build_text(),
                          "print the version and what it was built with");
    app_.add_flag_callback("--describe-options", [this] { throw CLI::CallForVersion(help_->describe(app_), kDone); })
        ->configurable(false)
        ->group("");
    add_common_flags();
}

void Session::add_help_flags(CLI::App& app) {
    in_group(app, Group::Help);
    app.set_help_flag("-h,--help", "print the options that are needed most often");
    app.set_help_all_flag("--help-all", "print all options");
}

void Session::add_common_flags() {
    app_.option_defaults()->group("Options");
    app_.add_option("--threads", threads_, "number of threads, 0 uses all cores");
    app_.add_flag("--profile", profile_, "print the time and memory of each stage at the end");
    app_.add_flag("--quiet", quiet_, "print only results, warnings and errors");
    app_.add_flag("--strict", strict_,
                  "exit code 5 if there was a warning, for example about a flow that is not steady or a surface that "
                  "misses its marks");
    app_.add_option("--json", json_path_, "write the report to this file; - is standard output")->type_name("FILE|-");
    app_.add_option("--memory-limit", memory_limit_text_,
                    "stop if more memory than this is needed, for example 8G; segment and reconstruct continue in "
                    "bricks [80 % of the free memory]")
        ->type_name("SIZE");
    app_.add_option("--save-config", save_config_path_, "write the options of this run to a TOML file")
        ->type_name("FILE")
        ->configurable(false);
    app_.set_config("--config", "", "read options from a TOML or INI file; the command line takes precedence")
        ->type_name("FILE")
        ->configurable(false);
    app_.allow_config_extras(CLI::config_extras_mode::error);
    app_.config_formatter(std::make_shared<ConfigFile>(app_));
}

CLI::App* Session::add_command(const std::string& name, const std::string& description, std::function<void()> body) {
    CLI::App* command = app_.add_subcommand(name, description);
    add_help_flags(*command);
    command->fallthrough();  // options of the program, such as --threads, are accepted after the subcommand, too
    command->footer(
        "Every command also takes the options that covol --help lists: --threads, --quiet, --json and others.");
    bodies_[command] = std::move(body);
    return command;
}

void Session::add_grid(const std::string& path, const FloatGridPtr& grid, WriteVdbOptions options) {
    options.metadata = provenance_->metadata();
    outputs_.add(path, [grid, options](const std::string& to) { write_vdb(to, {grid}, options); });
}

int Session::main(int argc, char** argv) {
    const int code = run_command_line(argc, argv);
    std::cout.flush();
    if (!std::cout && !is_reporting_end_.test()) return fail(kIo, "standard output: cannot write");
    return code;
}

int Session::run_command_line(int argc, char** argv) {
    catch_file_signals();
    keep_standard_streams();
    if (const std::string few = too_few_files(); !few.empty()) return fail(exit_code_of(Errc::Io), few);
    // `plan` and `brick plan` precede a complete command line of segment or reconstruct, which remains in `words`.
    std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
    command_line_ = "covol";
    for (const std::string& word : words) command_line_ += " " + shell_quoted(word);
    if (words.empty() && ::isatty(STDOUT_FILENO) != 0) {
        std::cout << kFirstSteps << "covol help shows all commands.\n";
        return kUsage;
    }
    const auto is = [&](std::size_t n, const char* word) { return n < words.size() && words[n] == word; };
    planning_ = is(0, "plan") && (is(1, "segment") || is(1, "reconstruct"));
    if (planning_) words.erase(words.begin());
    std::vector<std::string> given;
    try {
        if (is(0, "help")) words = words_of_help(words, app_);
        check_blanks(words);
        brick_ = take_brick_call(words, app_);
        given = words;
        std::reverse(words.begin(), words.end());  // CLI11 expects reverse order
        app_.parse(std::move(words));
        expect_values(app_);
        expect_values(*app_.get_subcommands().front());
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) return app_.exit(error);  // help and version
        if (const std::string unknown = unknown_name(app_, given); !unknown.empty()) return fail(kUsage, unknown);
        return fail(kUsage, explain(error, app_));
    } catch (const UsageError& error) {
        return fail(kUsage, origin_of(app_, error.option) + error.what());
    } catch (const Error& error) {
        return fail(exit_code_of(error.code()), origin_of(app_, error.option()) + error.what());
    }
    command_ = app_.get_subcommands().front();
    return execute();
}

int Session::execute() {
    catch_cancel_signals();
    std::unique_ptr<MemoryGuard> guard;
    try {
        progress_ = std::make_unique<Progress>(quiet_);
        if (threads_ < 0 || threads_ > kMaxThreads)
            throw Error(Errc::InvalidOptions, "--threads: expected 0 to " + std::to_string(kMaxThreads) + ", got " +
                                                  std::to_string(threads_));
        run_.threads = threads_;
        run_.cancel = &cancel_flag();
        run_.progress = [this](const std::string& stage, double fraction) { progress_->update(stage, fraction); };
        run_.log = [this](LogLevel level, const std::string& line) {
            level == LogLevel::Warning ? warn(line) : note(line);
        };
        memory_bound_ = choose_memory_bound(memory_limit_text_);
        run_.memory_budget = memory_bound_.bytes;
        guard = std::make_unique<MemoryGuard>(memory_bound_.bytes, cancel_flag(), [this] {
            if (is_reporting_end_.test_and_set()) return;  // the main thread is already printing an error
            const int code = report_failure(kBadInput, memory_text());
            ScratchFolder::remove_all();
            ::_exit(code);
        });
        // Called after the memory guard has created its thread, because limit_threads() counts the threads that can
        // still be created for TBB.
        const ThreadCount threads = limit_threads(threads_);
        provenance_.emplace(*command_, inputs_of(*command_), report_);
        outputs_.protect(provenance_->inputs());
        outputs_.protect(app_.get_config_ptr()->results());
        if (json_path_ != "-") outputs_.check("--json", json_path_, OutputKind::Text);
        outputs_.check("--save-config", save_config_path_, OutputKind::Text);
        start_report();
        if (threads.possible < threads.wanted)
            note("using " + std::to_string(threads.possible) + " of " + std::to_string(threads.wanted) +
                 " threads: " + kNoThread);
        if (!guard->watches()) warn(std::string("the memory of this run is not monitored: ") + kNoThread);
        bodies_.at(command_)();
        run_.check();
        finish();
        return exit_code_;
    } catch (const UsageError& error) {
        return fail(kUsage, error.what());
    } catch (const Error& error) {
        if (error.code() == Errc::Cancelled && guard && guard->tripped() && !is_interrupted())
            return fail(kBadInput, memory_text());
        return fail(exit_code_of(error.code()), error.code() == Errc::Cancelled ? interrupted_text() : error.what());
    } catch (const std::bad_alloc&) {
        return fail(kBadInput, kOutOfMemory);
    } catch (const std::exception& error) {
        if (is_missing_thread(error)) return fail(kIo, kNoThread);
        return fail(kDefect, std::string("internal error: ") + error.what());
    }
}

void Session::start_report() {
    report_["schema"] = kReportSchema;
    report_["covol"] = version();
    report_["instruction_set"] = instruction_set();
    report_["command"] = command_->get_name();
    report_["options"] = values_of_options(*command_);
    report_["seconds"] = Json::object();
}

void Session::finish() {
    const Stopwatch watch;
    if (!save_config_path_.empty())
        outputs_.add(save_config_path_, [this](const std::string& path) {
            write_text(path,
                       std::string("# covol ") + version() + ", " + command_->get_name() + "\n" +
                           command_->config_to_str(false, true),
                       run_);
        });
    outputs_.write_queued();
    add_seconds("write", watch.seconds());
    report_["seconds"].erase("total");  // added again as the last entry, for the whole run
    add_seconds("total", since_start_.seconds());
    report_["peak_rss_bytes"] = peak_rss();
    write_report();
    run_.check();
    outputs_.publish();
    if (run_.checkpoints) run_.checkpoints->remove();
    for (const std::string& path : outputs_.written()) note("wrote " + path);
    if (profile_)
        for (const std::string& line : profile_lines(report_)) progress_->line(line);
    progress_->clear();
    if (strict_ && exit_code_ == kDone && report_.contains("warnings")) exit_code_ = kWarned;
}

bool Session::has_role(const std::string& option, OptionRole role) const {
    const std::vector<std::string> names = names_of(*command_, role);
    return std::find(names.begin(), names.end(), option) != names.end();
}

void Session::write_report() {
    if (json_path_.empty()) return;
    const std::string text = report_.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
    if (json_path_ != "-") {
        outputs_.add(json_path_, [this, text](const std::string& path) { write_text(path, text, run_); });
        return outputs_.write_queued();
    }
    std::cout.flush();
    write_stream(STDOUT_FILENO, safe_lines(text), "standard output", run_);
}

std::string Session::memory_text() const {
    std::string remedies;
    for (const auto& [flag, remedy] :
         {std::pair{"--voxel-size", "a larger --voxel-size"}, std::pair{"--roi", "a --roi"}})
        if (command_->get_option_no_throw(flag) != nullptr)
            remedies += (remedies.empty() ? "; use " : " or ") + std::string(remedy);
    return "more memory is needed than " + memory_bound_.name + remedies;
}

std::string Session::interrupted_text() const {
    if (brick_ && brick_->step == BrickCall::Step::Run) return "interrupted; bricks that were finished before are kept";
    return outputs_.kept().empty() ? "interrupted; no output was written"
                                   : "interrupted; outputs that were finished before are kept";
}

int Session::fail(int code, const std::string& message) {
    while (is_reporting_end_.test_and_set()) ::pause();  // the memory guard prints an error, and ends the process
    return report_failure(code, message);
}

int Session::report_failure(int code, const std::string& message) {
    if (progress_) progress_->clear();
    std::cerr << "covol: error: " << one_line(with_flags(message)) << std::endl;
    return code;
}

void Session::note(const std::string& line) {
    if (!quiet_) progress_->line("covol: " + one_line(outputs_.shown(with_flags(line))));
}

void Session::print(const std::string& line) {
    if (json_path_ == "-") return progress_->line(safe_lines(line));  // standard output is reserved for the report
    progress_->clear();
    std::cout << safe_lines(line) << std::endl;
    if (!std::cout) throw Error(Errc::Io, "standard output: cannot write");
}

void Session::warn(const std::string& message) {
    const std::string line = outputs_.shown(with_flags(message));
    // The same warning is printed only once. A file that is opened several times causes its warnings each time.
    for (const Json& warning : report_["warnings"])
        if (warning == line) return;
    progress_->line("covol: warning: " + one_line(line));
    report_["warnings"].push_back(line);
}

const CLI::App* Session::command(const std::string& name) const {
    const auto found = app_.get_subcommands([&](const CLI::App* command) { return command->get_name() == name; });
    return found.empty() ? nullptr : found.front();
}

std::optional<std::uint64_t> Session::memory_limit() const {
    return memory_limit_text_.empty() ? std::nullopt : std::optional(memory_bound_.bytes);
}

void Session::require_memory(double bytes, const std::string& what) const {
    if (run_.memory_budget > 0 && bytes > double(run_.memory_budget))
        throw Error(Errc::InvalidOptions, what + " needs " + std::to_string(std::llround(bytes / (1 << 20))) +
                                              " MiB of memory, more than " + memory_bound_.name);
}

void Session::add_seconds(const std::string& name, double seconds) {
    Json& all = report_["seconds"];
    all[name] = all.value(name, 0.0) + seconds;
}

}  // namespace covol::tool
