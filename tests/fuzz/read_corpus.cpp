// Reads each file of a corpus, FOLDER/FORMAT/*, as DamagedFile says: tests/cli/corpus_test.py unpacks it.
//
//   read_corpus FOLDER
//
// The name of a file is written before it is read, so that the last one is what a crash or a hang belongs to. Exit code
// 1 where one takes more memory than 64 MB and ten times its size, or throws what is no covol::Error.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>
#include <vector>

#include "damaged_file.h"

namespace {

namespace fs = std::filesystem;

/// A number of /proc/self/status, in bytes.
std::uint64_t status_of(const std::string& key) {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
        if (line.starts_with(key + ":")) return std::stoull(line.substr(key.size() + 1)) * 1024;
    return 0;
}

std::vector<fs::path> sorted(const fs::path& folder) {
    std::vector<fs::path> paths;
    for (const auto& entry : fs::directory_iterator(folder)) paths.push_back(entry.path());
    std::sort(paths.begin(), paths.end());
    return paths;
}

/// @return whether it was read as it should
bool read(const DamagedFile& file, const fs::path& path) {
    std::ifstream stream(path, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
    std::cout << path.string() << std::endl;
    std::ofstream("/proc/self/clear_refs") << 5;  // the peak begins anew
    const std::uint64_t before = status_of("VmRSS");
    try {
        file.read(bytes);
    } catch (const std::exception& error) {
        std::cout << "threw: " << error.what() << std::endl;
        return false;
    }
    constexpr std::uint64_t kFree = 64'000'000;
    const std::uint64_t peak = status_of("VmHWM");
    if (peak <= before + kFree + 10 * bytes.size()) return true;
    std::cout << "took " << (peak - before) / 1'000'000 << " MB" << std::endl;
    return false;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) return 2;
    bool good = true;
    for (const fs::path& format : sorted(argv[1])) {
        const DamagedFile file(format.filename());
        for (const fs::path& path : sorted(format)) good = read(file, path) && good;
    }
    std::cout.flush();
    std::_Exit(good ? 0 : 1);  // HDF5's library complains at its end of what damaged headers left in it
}
