// Reads each file of a corpus, FOLDER/FORMAT/*, with DamagedFile; tests/cli/corpus_test.py unpacks the corpus.
//
//   read_corpus FOLDER
//
// The name of a file is printed before the file is read: if the program crashes or hangs, the last name is that of the
// file that caused it. The exit code is 1 if a file needs more memory than 64 MB plus ten times its size, or if reading
// it throws anything but a covol::Error.
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

/// The number after `key` in /proc/self/status, which is in kB there, converted to bytes.
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

/// @return whether the file was read within the limits
bool read(const DamagedFile& file, const fs::path& path) {
    std::ifstream stream(path, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
    std::cout << path.string() << std::endl;
    std::ofstream("/proc/self/clear_refs") << 5;  // 5: resets VmHWM, the peak of resident memory
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
    std::_Exit(good ? 0 : 1);  // at a normal exit, the HDF5 library prints errors about damaged files
}
