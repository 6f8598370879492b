#pragma once
#include <cstdint>
#include <optional>
#include <string>

namespace covol::tool {

/// What this process can still take beside what it holds, and who says so.
struct FreeMemory {
    std::uint64_t bytes = 0;
    std::string where;  ///< "this machine", "the control group /slurm/job_7", "the limit of address space (ulimit -v)"
};

/// The least of what the machine has available, what each control group above this process leaves (v1 and v2, hard and
/// throttling limits, less what the group uses beside file caches, which are given back on demand), and what the limits
/// of address space and data leave. None where nobody says.
/// @param root  folder that stands for "/": reads its proc/meminfo, proc/self/cgroup, proc/self/mountinfo,
///              proc/self/statm and the mounts that mountinfo names
/// @pre limits of address space and data are always this process's own
[[nodiscard]] std::optional<FreeMemory> find_free_memory(const std::string& root = "");

}  // namespace covol::tool
