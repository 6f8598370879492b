#include "covol/checkpoints.h"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "base/number.h"
#include "covol/error.h"
#include "covol/file_set.h"
#include "files/atomic.h"

namespace covol {
namespace fs = std::filesystem;
namespace {

using Clock = std::chrono::steady_clock;
constexpr const char* kJobFile = "job.txt";
constexpr std::string_view kFlow = "flow-";

/// Whether file() creates such names: other files in the folder must not be removed.
bool is_of_flow(const std::string& name) {
    const std::size_t digits = name.find_first_not_of("0123456789", std::min(kFlow.size(), name.size()));
    if (!name.starts_with(kFlow) || digits == std::string::npos || digits < kFlow.size() + 2) return false;
    const std::string ending = name.substr(digits);
    return ending == ".vdb" || ending == ".state";
}

void remove_flows(const std::string& folder) noexcept {
    std::error_code status;
    for (fs::directory_iterator at(folder, status), end; !status && at != end; at.increment(status)) {
        std::error_code stays;
        if (is_of_flow(at->path().filename().string())) fs::remove(at->path(), stays);
    }
}

/// Whether a regular file at the path contains exactly that text.
bool holds(const fs::path& path, const std::string& text) {
    std::error_code status;
    if (!fs::is_regular_file(path, status) || fs::file_size(path, status) != text.size()) return false;
    std::ifstream file = open_regular_file(path.string());
    return std::string(std::istreambuf_iterator<char>(file), {}) == text;
}

}  // namespace

struct Checkpoints::State {
    std::string folder;
    double every;
    bool had_states = false;
    int flows = 0;
    Clock::time_point last = Clock::now();
};

Checkpoints::Checkpoints(const std::string& folder, double every, const std::string& job, bool resume)
    : state_(new State{folder, every}) {
    if (!(every >= 0) || !std::isfinite(every))
        throw Error(Errc::InvalidOptions, "`checkpoint_every`: expected >= 0 seconds, got " + detail::number(every),
                    "checkpoint_every");
    std::error_code status;
    fs::create_directories(folder, status);
    if (!fs::is_directory(folder, status))
        throw Error(Errc::Io, "`checkpoint`: " + folder + ": cannot be created, or is not a folder", "checkpoint");
    { const ScratchFolder finishes_what_was_begun(folder); }
    const fs::path job_file = fs::path(folder) / kJobFile;
    state_->had_states = fs::exists(job_file, status);
    if (!state_->had_states) {
        remove_flows(folder);  // states of a run that was killed while it removed them
        detail::write_atomically(job_file.string(), [&](const std::string& temporary) {
            std::ofstream file(temporary, std::ios::binary);
            file << job;
            file.close();
            if (!file)
                throw Error(Errc::Io, "`checkpoint`: " + job_file.string() + ": cannot be written", "checkpoint");
        });
        return;
    }
    if (!resume)
        throw Error(
            Errc::InvalidInput,
            "`checkpoint`: " + folder +
                ": it contains states of an earlier run; use `resume` to continue that run, or remove the folder",
            "checkpoint");
    if (!holds(job_file, job))
        throw Error(Errc::InvalidInput, "`resume`: " + folder +
                                            ": expected states of this run, got those of a run with other options, "
                                            "inputs, version or instruction set; see " +
                                            job_file.string());
}

Checkpoints::~Checkpoints() = default;

bool Checkpoints::had_states() const noexcept { return state_->had_states; }

void Checkpoints::remove() noexcept {
    std::error_code status;
    fs::remove(fs::path(state_->folder) / kJobFile, status);  // first, because without it the states are ignored
    remove_flows(state_->folder);
    fs::remove(state_->folder, status);  // fails if it contains other files, which are kept
}

int Checkpoints::begin_flow() {
    restart_clock();
    return ++state_->flows;
}

std::string Checkpoints::file(int flow, const char* ending) const {
    char name[32];
    std::snprintf(name, sizeof name, "/flow-%02d%s", flow, ending);
    return state_->folder + name;
}

bool Checkpoints::is_due() const {
    return std::chrono::duration<double>(Clock::now() - state_->last).count() >= state_->every;
}

void Checkpoints::restart_clock() { state_->last = Clock::now(); }

}  // namespace covol
