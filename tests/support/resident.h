#pragma once
#include <unistd.h>

#include <cstdint>
#include <fstream>

/// Resident memory of this program, in bytes.
inline std::uint64_t resident_bytes() {
    std::uint64_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages >> pages;
    return pages * std::uint64_t(::sysconf(_SC_PAGESIZE));
}
