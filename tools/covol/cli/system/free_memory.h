#pragma once
#include <cstdint>
#include <optional>
#include <string>

namespace covol::tool {

/// The memory that this process can allocate in addition to what it has, and what limits it.
struct FreeMemory {
    std::uint64_t bytes = 0;
    std::string where;  ///< "this machine", "the control group /slurm/job_7", "the limit of address space (ulimit -v)"
};

/// The minimum of the machine's available memory, of the memory that is left in each control group of this process (v1
/// and v2; the hard or throttling limit minus the group's use without file caches, which are reclaimed on demand), and
/// of what remains of the limits of address space and data. Nullopt if none of these is known.
/// @param root  folder that replaces "/", for tests: its proc/meminfo, proc/self/cgroup, proc/self/mountinfo and
///              proc/self/statm, and the mounts that mountinfo names are read. The limits of address space and data
///              are always those of this process.
[[nodiscard]] std::optional<FreeMemory> find_free_memory(const std::string& root = "");

}  // namespace covol::tool
