// Tests of the free memory that a machine and its control groups report, on file trees that imitate /proc and /sys.
#include "cli/system/free_memory.h"

#include <sys/resource.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <string>

#include "support/scratch.h"

namespace {

using covol::tool::find_free_memory;
using covol::tool::FreeMemory;

constexpr std::uint64_t kMiB = std::uint64_t(1) << 20;
constexpr std::uint64_t kMachine = 8000 * kMiB;

/// A machine with 8000 MiB available.
class FakeMachine {
public:
    FakeMachine() { write("proc/meminfo", "MemTotal: 16384000 kB\nMemAvailable:    8192000 kB\nSwapFree: 5 kB\n"); }

    FakeMachine& write(const std::string& name, const std::string& text) {
        const std::filesystem::path path = std::filesystem::path(root()) / name;
        std::filesystem::create_directories(path.parent_path());
        std::ofstream(path) << text;
        return *this;
    }
    FakeMachine& group(const std::string& lines) { return write("proc/self/cgroup", lines); }
    FakeMachine& mounts(const std::string& lines) { return write("proc/self/mountinfo", lines); }
    FakeMachine& v1(const std::string& folder, const std::string& limit, std::uint64_t usage, std::uint64_t cache) {
        write(folder + "/memory.limit_in_bytes", limit + "\n");
        write(folder + "/memory.usage_in_bytes", std::to_string(usage) + "\n");
        return write(folder + "/memory.stat", "inactive_file 1\ntotal_inactive_file " + std::to_string(cache / 2) +
                                                  "\ntotal_active_file " + std::to_string(cache / 2) + "\n");
    }
    FakeMachine& v2(const std::string& folder, const std::string& max, const std::string& high, std::uint64_t current,
                    std::uint64_t cache) {
        write(folder + "/memory.max", max + "\n");
        write(folder + "/memory.high", high + "\n");
        write(folder + "/memory.current", std::to_string(current) + "\n");
        return write(folder + "/memory.stat", "anon 7\nfile 9\ninactive_file " + std::to_string(cache / 2) +
                                                  "\nactive_file " + std::to_string(cache / 2) + "\n");
    }
    [[nodiscard]] FreeMemory free() const {
        const auto found = find_free_memory(root());
        REQUIRE(found.has_value());
        return *found;
    }

private:
    [[nodiscard]] std::string root() const { return folder_.path("machine"); }
    Scratch folder_;
};

const std::string kV2 = "30 23 0:26 / /sys/fs/cgroup rw,nosuid shared:4 - cgroup2 cgroup2 rw,nsdelegate\n";
const std::string kV1 =
    "31 23 0:27 / /sys/fs/cgroup ro - tmpfs tmpfs ro,mode=755\n"
    "32 31 0:28 / /sys/fs/cgroup/cpu,cpuacct rw shared:9 - cgroup cgroup rw,cpu,cpuacct\n"
    "33 31 0:29 / /sys/fs/cgroup/memory rw shared:10 master:2 - cgroup cgroup rw,memory\n";
const std::string kUnlimited = "9223372036854771712";
std::string mib(std::uint64_t n) { return std::to_string(n * kMiB); }

}  // namespace

TEST_CASE("Without control groups the available memory of the machine is reported") {
    const FakeMachine machine;
    CHECK(machine.free().bytes == kMachine);
    CHECK(machine.free().where == "this machine");
}

TEST_CASE("Without any source of information the free memory is unknown") {
    const Scratch empty;
    CHECK_FALSE(find_free_memory(empty.path("nothing")).has_value());
}

TEST_CASE("Control groups, version 2: the limit of the process's group less its memory that is not cache") {
    FakeMachine machine;
    machine.mounts(kV2).group("0::/user.slice/job\n");
    machine.v2("sys/fs/cgroup/user.slice/job", mib(400), "max", 150 * kMiB, 50 * kMiB);
    CHECK(machine.free().bytes == 300 * kMiB);
    CHECK(machine.free().where == "the control group /sys/fs/cgroup/user.slice/job");
}

TEST_CASE("Control groups, version 2: the lower of memory.high and memory.max applies") {
    FakeMachine machine;
    machine.mounts(kV2).group("0::/job\n").v2("sys/fs/cgroup/job", mib(900), mib(300), 0, 0);
    CHECK(machine.free().bytes == 300 * kMiB);
    machine.v2("sys/fs/cgroup/job", "max", mib(200), 0, 0);
    CHECK(machine.free().bytes == 200 * kMiB);
}

TEST_CASE("Control groups, version 2: the limits of all groups above the process apply") {
    FakeMachine machine;
    machine.mounts(kV2).group("0::/slurm/job_7/step_0/task_0\n");
    machine.v2("sys/fs/cgroup/slurm/job_7", mib(500), "max", 100 * kMiB, 0);
    machine.v2("sys/fs/cgroup/slurm/job_7/step_0", mib(700), "max", 80 * kMiB, 0);
    machine.v2("sys/fs/cgroup/slurm/job_7/step_0/task_0", "max", "max", 80 * kMiB, 0);
    CHECK(machine.free().bytes == 400 * kMiB);
    CHECK(machine.free().where == "the control group /sys/fs/cgroup/slurm/job_7");
}

TEST_CASE("Control groups, version 1: limits are read at the memory controller's mount") {
    FakeMachine machine;
    machine.mounts(kV1).group("5:cpu,cpuacct:/elsewhere\n4:memory:/slurm/uid_1/job_7\n0::/\n");
    machine.v1("sys/fs/cgroup/memory", kUnlimited, 9000 * kMiB, 0);
    CHECK(machine.free().where == "this machine");
    machine.v1("sys/fs/cgroup/memory/slurm/uid_1/job_7", mib(400), 350 * kMiB, 250 * kMiB);
    CHECK(machine.free().bytes == 300 * kMiB);
    // Other processes in this group use most of its memory.
    machine.v1("sys/fs/cgroup/memory/slurm", mib(1000), 950 * kMiB, 0);
    CHECK(machine.free().bytes == 50 * kMiB);
    CHECK(machine.free().where == "the control group /sys/fs/cgroup/memory/slurm");
}

TEST_CASE("Control groups of both versions at once: the version with the memory controller applies") {
    FakeMachine machine;
    machine.mounts(kV1 + "40 31 0:30 / /sys/fs/cgroup/unified rw - cgroup2 cgroup2 rw\n");
    machine.group("4:memory:/job\n0::/job\n").v1("sys/fs/cgroup/memory/job", mib(400), 0, 0);
    machine.write("sys/fs/cgroup/unified/job/cgroup.procs", "1\n");
    CHECK(machine.free().bytes == 400 * kMiB);
}

TEST_CASE("Control groups: unlimited values do not reduce the machine's free memory") {
    FakeMachine machine;
    machine.mounts(kV1 + kV2).group("4:memory:/job\n0::/job\n");
    machine.v1("sys/fs/cgroup/memory/job", kUnlimited, 100 * kMiB, 0);
    machine.v2("sys/fs/cgroup/job", "max", "max", 100 * kMiB, 0);
    CHECK(machine.free().bytes == kMachine);
    CHECK(machine.free().where == "this machine");
}

TEST_CASE("Control groups: a container without a cgroup namespace reads the mount of its own group") {
    FakeMachine machine;
    machine.mounts("33 31 0:29 /docker/0ab1 /sys/fs/cgroup/memory ro - cgroup cgroup rw,memory\n");
    machine.group("4:memory:/docker/0ab1\n").v1("sys/fs/cgroup/memory", mib(256), 56 * kMiB, 0);
    CHECK(machine.free().bytes == 200 * kMiB);
    machine.group("4:memory:/docker/0ab1/inner\n").v1("sys/fs/cgroup/memory/inner", mib(100), 0, 0);
    CHECK(machine.free().bytes == 100 * kMiB);
}

TEST_CASE("Control groups: for a group outside of the namespace the limits of the mounted groups apply") {
    FakeMachine machine;
    machine.mounts(kV2).v2("sys/fs/cgroup", mib(256), "max", 56 * kMiB, 0);
    for (const char* group : {"0::/../..\n", "0::/../other/job\n", "0::/..\n", "0::/\n"}) {
        CAPTURE(group);
        machine.group(group);
        CHECK(machine.free().bytes == 200 * kMiB);
    }
    // This mount was made outside of the namespace, so that it also contains the groups outside of it.
    machine.mounts("30 23 0:26 /../.. /sys/fs/cgroup rw - cgroup2 cgroup2 rw\n").group("0::/../../other/job\n");
    machine.v2("sys/fs/cgroup/other/job", mib(90), "max", 0, 0);
    CHECK(machine.free().bytes == 90 * kMiB);
    machine.group("0::/\n");
    CHECK(machine.free().bytes == 200 * kMiB);
}

TEST_CASE("Control groups, version 1: hierarchical_memory_limit includes limits above the mount") {
    FakeMachine machine;
    machine.mounts(kV1).group("4:memory:/\n").v1("sys/fs/cgroup/memory", kUnlimited, 10 * kMiB, 0);
    machine.write("sys/fs/cgroup/memory/memory.stat", "hierarchical_memory_limit " + mib(110) + "\n");
    CHECK(machine.free().bytes == 100 * kMiB);
}

TEST_CASE("Control groups: a group at its limit or beyond it has no free memory") {
    FakeMachine machine;
    machine.mounts(kV2).group("0::/job\n").v2("sys/fs/cgroup/job", mib(100), "max", 100 * kMiB, 0);
    CHECK(machine.free().bytes == 0);
    machine.v2("sys/fs/cgroup/job", mib(100), "max", 180 * kMiB, 0);
    CHECK(machine.free().bytes == 0);
}

TEST_CASE("Control groups: mount points with spaces are read, damaged lines and values are ignored") {
    FakeMachine machine;
    machine.mounts("damaged\n\n30 23 0:26 / /my\\040groups rw - cgroup2 cgroup2 rw\n").group("nothing\n0::/a b\n");
    machine.v2("my groups/a b", mib(100), "max", 0, 0);
    CHECK(machine.free().bytes == 100 * kMiB);
    machine.write("my groups/a b/memory.max", "garbage\n");
    CHECK(machine.free().bytes == kMachine);
}

TEST_CASE("Limits of address space and data size apply, less what is in use") {
    struct Restored {
        decltype(RLIMIT_AS) which;
        rlimit before{};
        explicit Restored(decltype(RLIMIT_AS) resource) : which(resource) { ::getrlimit(which, &before); }
        ~Restored() { ::setrlimit(which, &before); }
        void set(std::uint64_t bytes) const {
            const rlimit limit{bytes, before.rlim_max};
            REQUIRE(::setrlimit(which, &limit) == 0);
        }
    };
    FakeMachine machine;
    // In pages; address space is the first number, data the sixth.
    machine.write("proc/self/statm", "1000 500 100 10 0 300 0\n");
    constexpr std::uint64_t kPage = 4096;
    {
        const Restored space(RLIMIT_AS);
        space.set(std::uint64_t(5) << 30);
        CHECK(machine.free().bytes == (std::uint64_t(5) << 30) - 1000 * kPage);
        CHECK(machine.free().where.find("ulimit -v") != std::string::npos);
    }
    const Restored data(RLIMIT_DATA);
    data.set(std::uint64_t(4) << 30);
    CHECK(machine.free().bytes == (std::uint64_t(4) << 30) - 300 * kPage);
}
