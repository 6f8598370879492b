#include "cli/brick_call.h"

#include <algorithm>
#include <charconv>
#include <set>

#include "cli/options/arguments.h"
#include "cli/options/job_options.h"
#include "covol/error.h"
#include "covol/file_set.h"

namespace covol::tool {
namespace {

using Words = std::vector<std::string>;

bool is_option(const std::string& word) { return word.size() > 1 && word[0] == '-' && !std::isdigit(word[1]); }

std::string name_of(const std::string& option) { return option.substr(0, option.find('=')); }

/// Removes the option with one of these names and its value. @return the value; empty if the option is absent
std::string take_option(Words& words, const std::set<std::string>& names) {
    for (auto word = words.begin(); word != words.end(); ++word) {
        if (!is_option(*word) || !names.contains(name_of(*word))) continue;
        const std::size_t equals = word->find('=');
        if (equals != std::string::npos) {
            std::string value = word->substr(equals + 1);
            words.erase(word);
            return value;
        }
        if (word + 1 == words.end()) throw UsageError("brick: " + *word + ": expected a value");
        std::string value = *(word + 1);
        words.erase(word, word + 2);
        return value;
    }
    return {};
}

template <typename Number>
bool parse_whole(const std::string& text, Number& value) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size();
}

/// Reads the job from a plan, which may come from an untrusted source: a job with an output option, which could
/// overwrite any file, is refused.
/// @param command  is set to the job's command, segment or reconstruct
JobOptions job_of_plan(const std::string& folder, const CLI::App& program, const CLI::App*& command) {
    const std::string path = plan_file(folder);
    const Json plan = read_plan_file(folder);
    if (!plan.contains("job"))
        throw Error(Errc::InvalidInput,
                    path + ": expected a plan written by covol brick plan, got a file without a job");
    JobOptions job = job_from_json(plan["job"], path);
    if (job.command != "segment" && job.command != "reconstruct")
        throw Error(Errc::InvalidInput, path + ": job: expected segment or reconstruct, got '" + job.command + "'");
    command = program.get_subcommand(job.command);
    for (const auto& [name, values] : job.values)
        if (role_of(option_of_job(*command, name, path)) == OptionRole::Output)
            throw Error(Errc::Unsupported, path + ": it contains --" + name +
                                               ", an output, which a plan cannot contain: give it to covol brick join");
    return job;
}

BrickCall plan_call(Words& words) {
    if (words.empty() || (words[0] != "segment" && words[0] != "reconstruct"))
        throw UsageError("brick plan: expected segment or reconstruct with its options, and -o FOLDER");
    BrickCall call;
    Words rest = words;
    call.folder = take_option(rest, {"-o", "--output"});
    if (call.folder.empty() && std::find(words.begin(), words.end(), "--help") == words.end())
        throw UsageError("brick plan: expected -o FOLDER");
    return call;
}

BrickCall run_call(Words& words, const CLI::App& program) {
    BrickCall call;
    call.step = BrickCall::Step::Run;
    if (const std::string sweep = take_option(words, {"--sweep"}); !sweep.empty())
        if (!parse_whole(sweep, call.sweep) || call.sweep < 1)
            throw UsageError("brick run: --sweep: expected a whole number from 1, got " + sweep);
    if (words.empty() || is_option(words[0])) throw UsageError("brick run: expected the folder of a plan");
    call.folder = words[0];
    std::size_t end = 1;
    for (; end < words.size() && !is_option(words[end]); ++end) {
        std::size_t brick = 0;
        if (!parse_whole(words[end], brick))
            throw UsageError("brick run: expected brick numbers (0, 1, ...), got " + words[end]);
        call.bricks.push_back(brick);
    }
    const CLI::App* command = nullptr;
    const JobOptions job = job_of_plan(call.folder, program, command);
    words.erase(words.begin(), words.begin() + std::ptrdiff_t(end));
    words.push_back("--output=" + call.folder);
    words = command_line_of(job, *command, plan_file(call.folder), words);
    return call;
}

BrickCall join_call(Words& words, const CLI::App& program) {
    BrickCall call;
    call.step = BrickCall::Step::Join;
    if (words.empty() || is_option(words[0])) throw UsageError("brick join: expected the folder of a plan");
    call.folder = words[0];
    words.erase(words.begin());
    const std::string output = take_option(words, {"-o", "--output"});
    if (output.empty()) throw UsageError("brick join: expected -o OUT.vdb");
    const CLI::App* command = nullptr;
    JobOptions job = job_of_plan(call.folder, program, command);
    // An option of the current command line replaces the same option of the plan.
    for (const std::string& word : words) {
        const CLI::Option* option = is_option(word) ? command->get_option_no_throw(name_of(word)) : nullptr;
        if (option == nullptr) continue;
        std::erase_if(job.values, [&](const auto& own) { return own.first == option->get_single_name(); });
    }
    words.push_back("--output=" + output);
    words = command_line_of(job, *command, plan_file(call.folder), words);
    return call;
}

}  // namespace

std::string plan_file(const std::string& folder) { return folder + "/plan.json"; }

Json read_plan_file(const std::string& folder) {
    constexpr std::uintmax_t kMaxBytes = std::uintmax_t(1) << 26U;
    try {
        Json plan = read_json(plan_file(folder), kMaxBytes);
        if (!plan.is_object()) throw Error(Errc::InvalidInput, plan_file(folder) + ": expected a JSON object");
        return plan;
    } catch (const Error& error) {
        const std::string file = plan_file(folder) + ": ";
        std::string why = error.what();
        if (why.starts_with(file)) why.erase(0, file.size());
        throw Error(error.code(), file + "expected a plan written by covol brick plan: " + why);
    }
}

std::optional<BrickCall> take_brick_call(std::vector<std::string>& words, const CLI::App& program) {
    if (words.size() < 2 || words[0] != "brick" || is_option(words[1])) return {};
    const std::string step = words[1];
    words.erase(words.begin(), words.begin() + 2);
    if (step == "plan") return plan_call(words);
    if (step == "run") return run_call(words, program);
    if (step == "join") return join_call(words, program);
    throw UsageError("brick: expected plan, run or join, got " + step);
}

}  // namespace covol::tool
