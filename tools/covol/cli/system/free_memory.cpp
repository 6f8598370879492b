#include "cli/system/free_memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

// The formats of the files that are read are described in proc(5), cgroups(7), and the kernel's
// Documentation/admin-guide/cgroup-v1/memory.rst and cgroup-v2.rst.
namespace covol::tool {
namespace {

namespace fs = std::filesystem;

/// The number that a file contains; nullopt if there is no such file, or if it contains "max" (no limit).
std::optional<std::uint64_t> number_in(const fs::path& path) {
    std::uint64_t number = 0;
    if (std::ifstream(path) >> number) return number;
    return std::nullopt;
}

/// The number after the name `wanted` in a file with lines of the form "name number"; nullopt if there is none.
std::optional<std::uint64_t> named_number(const fs::path& path, const std::string& wanted) {
    std::ifstream file(path);
    std::string line;
    while (std::getline(file, line)) {
        std::istringstream words(line);
        std::string name;
        std::uint64_t number = 0;
        if (words >> name >> number && name == wanted) return number;
    }
    return std::nullopt;
}

/// Decodes a path of mountinfo, in which blanks and backslashes are escaped ("\040").
std::string unescaped(const std::string& text) {
    std::string path;
    for (std::size_t n = 0; n < text.size(); ++n) {
        unsigned code = 0;
        if (text[n] == '\\' && n + 3 < text.size() &&
            std::from_chars(text.data() + n + 1, text.data() + n + 4, code, 8).ptr == text.data() + n + 4) {
            path += static_cast<char>(code);
            n += 3;
        } else {
            path += text[n];
        }
    }
    return path;
}

bool lists(const std::string& words, const std::string& wanted) {
    std::istringstream list(words);
    for (std::string word; std::getline(list, word, ',');)
        if (word == wanted) return true;
    return false;
}

/// A hierarchy of control groups with a memory controller, as visible to this process.
struct Hierarchy {
    bool is_v2 = false;
    fs::path mount;  ///< the mount point of the hierarchy
    fs::path top;    ///< the group at the mount point
};

std::vector<Hierarchy> hierarchies(const std::string& root) {
    std::vector<Hierarchy> all;
    std::ifstream file(root + "/proc/self/mountinfo");
    std::string line;
    while (std::getline(file, line)) {
        // The fields of a line of mountinfo are: id parent device top mount options... - type source options
        std::istringstream words(line);
        std::string id, parent, device, top, mount, word, type, source, options;
        words >> id >> parent >> device >> top >> mount;
        while (words >> word && word != "-") {
        }
        words >> type >> source >> options;
        if (type == "cgroup2" || (type == "cgroup" && lists(options, "memory")))
            all.push_back({type == "cgroup2", root + unescaped(mount), unescaped(top)});
    }
    return all;
}

/// The path of the group of this process within the hierarchy, from "/" on; empty if it is in no group.
std::string own_group(const std::string& root, bool is_v2) {
    std::ifstream file(root + "/proc/self/cgroup");
    std::string line;
    while (std::getline(file, line)) {
        // The format of a line is number:controllers:group.
        const std::size_t first = line.find(':'), second = line.find(':', first + 1);
        if (second == std::string::npos) continue;
        const std::string controllers = line.substr(first + 1, second - first - 1);
        if (is_v2 ? controllers.empty() : lists(controllers, "memory")) return line.substr(second + 1);
    }
    return {};
}

/// Folders of the group and of all groups that contain it, beginning at the mount point. If the group lies outside of
/// the mount, as in a cgroup namespace, only the mount point is returned.
std::vector<fs::path> group_folders(const Hierarchy& hierarchy, const std::string& group) {
    std::vector<fs::path> folders{hierarchy.mount};
    const fs::path below = fs::path(group).lexically_relative(hierarchy.top);
    if (below.empty() || *below.begin() == "..") return folders;
    for (const fs::path& part : below)
        if (part != ".") folders.push_back(folders.back() / part);
    return folders;
}

/// Memory of the group's processes, bytes, without file caches, which the kernel reclaims on demand.
std::uint64_t used_by(const fs::path& folder, bool is_v2) {
    const std::uint64_t all = number_in(folder / (is_v2 ? "memory.current" : "memory.usage_in_bytes")).value_or(0);
    const std::string prefix = is_v2 ? "" : "total_";  // in v1, the values named total_... include the groups below
    std::uint64_t caches = 0;
    for (const char* name : {"inactive_file", "active_file"})
        caches += named_number(folder / "memory.stat", prefix + name).value_or(0);
    return all - std::min(all, caches);
}

/// The minimum of the group's memory limits, bytes; nullopt if it has none.
std::optional<std::uint64_t> limit_of(const fs::path& folder, bool is_v2) {
    std::array<std::optional<std::uint64_t>, 2> limits;
    if (is_v2) {
        limits = {number_in(folder / "memory.max"), number_in(folder / "memory.high")};
    } else {
        // hierarchical_memory_limit also includes the limits of groups above the mount point.
        limits = {number_in(folder / "memory.limit_in_bytes"),
                  named_number(folder / "memory.stat", "hierarchical_memory_limit")};
    }
    if (!limits[0] || (limits[1] && *limits[1] < *limits[0])) return limits[1];
    return limits[0];
}

void add(std::optional<FreeMemory>& minimum, std::uint64_t limit, std::uint64_t used, const std::string& where) {
    const std::uint64_t bytes = limit - std::min(limit, used);
    if (!minimum || bytes < minimum->bytes) minimum = FreeMemory{bytes, where};
}

void add_machine(std::optional<FreeMemory>& minimum, const std::string& root) {
    if (const auto kilobytes = named_number(root + "/proc/meminfo", "MemAvailable:"))
        add(minimum, *kilobytes * 1024, 0, "this machine");
}

void add_groups(std::optional<FreeMemory>& minimum, const std::string& root) {
    for (const Hierarchy& hierarchy : hierarchies(root)) {
        const std::string group = own_group(root, hierarchy.is_v2);
        if (group.empty()) continue;
        for (const fs::path& folder : group_folders(hierarchy, group))
            if (const auto limit = limit_of(folder, hierarchy.is_v2))
                add(minimum, *limit, used_by(folder, hierarchy.is_v2),
                    "the control group " + folder.string().substr(root.size()));
    }
}

void add_limits(std::optional<FreeMemory>& minimum, const std::string& root) {
    std::array<std::uint64_t, 6> pages{};  // fields of statm: size, resident, shared, text, libraries, data
    std::ifstream statm(root + "/proc/self/statm");
    for (std::uint64_t& count : pages) statm >> count;
    const auto page = static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
    const auto add_limit = [&](auto resource, std::uint64_t used, const char* where) {
        rlimit limit{};
        if (::getrlimit(resource, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
            add(minimum, limit.rlim_cur, used * page, where);
    };
    add_limit(RLIMIT_AS, pages[0], "the limit of address space (ulimit -v)");
    add_limit(RLIMIT_DATA, pages[5], "the limit of data (ulimit -d)");
}

}  // namespace

std::optional<FreeMemory> find_free_memory(const std::string& root) {
    std::optional<FreeMemory> minimum;
    add_machine(minimum, root);
    add_groups(minimum, root);
    add_limits(minimum, root);
    return minimum;
}

}  // namespace covol::tool
