#include "cli/brick_call.h"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "cli/arguments.h"
#include "covol/error.h"
#include "covol/file_set.h"

namespace covol::tool {
namespace {

using Words = std::vector<std::string>;

bool is_option(const std::string& word) { return word.size() > 1 && word[0] == '-' && !std::isdigit(word[1]); }

std::string name_of(const std::string& option) { return option.substr(0, option.find('=')); }

/// Takes an option and its value off. @return the value; empty when it is not there
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

/// Takes options off, each with the values that follow it.
void drop_options(Words& words, const std::set<std::string>& names) {
    for (auto word = words.begin(); word != words.end();) {
        if (!is_option(*word) || !names.contains(name_of(*word))) {
            ++word;
            continue;
        }
        auto end = word + 1;
        if (word->find('=') == std::string::npos)
            while (end != words.end() && !is_option(*end)) ++end;
        word = words.erase(word, end);
    }
}

/// Of one process, and no part of a job.
void drop_common(Words& words) {
    drop_options(words, {"--threads", "--json", "--memory-limit", "--save-config"});
    std::erase(words, "--quiet");
    std::erase(words, "--profile");
}

template <typename Number>
bool parse_whole(const std::string& text, Number& value) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size();
}

Words job_words(const std::string& folder) {
    const std::string path = plan_file(folder);
    std::ifstream file = open_regular_file(path);
    if (!file) throw Error(Errc::Io, path + ": cannot read; expected the folder of a covol brick plan");
    const auto plan = nlohmann::json::parse(file, nullptr, false);
    if (!plan.is_object() || !plan.contains("job") || !plan["job"].is_array() || plan["job"].empty())
        throw Error(Errc::InvalidInput, path + ": expected a plan of covol brick plan");
    Words words;
    for (const auto& word : plan["job"]) {
        if (!word.is_string()) throw Error(Errc::InvalidInput, path + ": job: expected words");
        words.push_back(word.get<std::string>());
    }
    return words;
}

BrickCall plan_call(Words& words) {
    if (words.empty() || (words[0] != "segment" && words[0] != "reconstruct"))
        throw UsageError("brick plan: expected segment or reconstruct with its options, and -o FOLDER");
    BrickCall call;
    call.job = words;
    call.folder = take_option(call.job, {"-o", "--output"});
    drop_common(call.job);
    if (call.folder.empty() && std::find(words.begin(), words.end(), "--help") == words.end())
        throw UsageError("brick plan: expected -o FOLDER");
    return call;
}

BrickCall run_call(Words& words) {
    BrickCall call;
    call.step = BrickCall::Step::Run;
    if (const std::string sweep = take_option(words, {"--sweep"}); !sweep.empty())
        if (!parse_whole(sweep, call.sweep) || call.sweep < 1)
            throw UsageError("brick run: --sweep: expected a number from 1, got " + sweep);
    if (words.empty() || is_option(words[0])) throw UsageError("brick run: expected the folder of a plan");
    call.folder = words[0];
    std::size_t end = 1;
    for (; end < words.size() && !is_option(words[end]); ++end) {
        std::size_t brick = 0;
        if (!parse_whole(words[end], brick))
            throw UsageError("brick run: expected numbers of bricks, got " + words[end]);
        call.bricks.push_back(brick);
    }
    Words all = job_words(call.folder);
    all.insert(all.end(), {"-o", call.folder});
    all.insert(all.end(), words.begin() + std::ptrdiff_t(end), words.end());
    words = std::move(all);
    return call;
}

BrickCall join_call(Words& words) {
    BrickCall call;
    call.step = BrickCall::Step::Join;
    if (words.empty() || is_option(words[0])) throw UsageError("brick join: expected the folder of a plan");
    call.folder = words[0];
    words.erase(words.begin());
    std::set<std::string> given;
    for (const std::string& word : words)
        if (is_option(word)) given.insert(name_of(word));
    if (!given.contains("-o") && !given.contains("--output")) throw UsageError("brick join: expected -o OUT.vdb");
    Words all = job_words(call.folder);
    drop_options(all, given);  // what is said now goes first
    all.insert(all.end(), words.begin(), words.end());
    words = std::move(all);
    return call;
}

}  // namespace

std::string plan_file(const std::string& folder) { return folder + "/plan.json"; }

std::optional<BrickCall> take_brick_call(std::vector<std::string>& words) {
    if (words.size() < 2 || words[0] != "brick" || is_option(words[1])) return {};
    const std::string step = words[1];
    words.erase(words.begin(), words.begin() + 2);
    if (step == "plan") return plan_call(words);
    if (step == "run") return run_call(words);
    if (step == "join") return join_call(words);
    throw UsageError("brick: expected plan, run or join, got " + step);
}

}  // namespace covol::tool
