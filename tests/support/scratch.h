#pragma once
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <random>
#include <stdexcept>
#include <string>

#include "covol/error.h"

/// A folder for one test, which is removed when the test ends.
class Scratch {
public:
    Scratch() {
        static int count = 0;
        folder_ = std::filesystem::temp_directory_path() /
                  ("covol-test-" + std::to_string(::getpid()) + "-" + std::to_string(count++));
        std::filesystem::create_directories(folder_);
    }
    ~Scratch() {
        std::error_code ignored;
        std::filesystem::remove_all(folder_, ignored);
    }
    Scratch(const Scratch&) = delete;
    Scratch& operator=(const Scratch&) = delete;

    [[nodiscard]] std::string path(const std::string& name) const { return (folder_ / name).string(); }
    std::string write(const std::string& name, const std::string& bytes) const {
        std::ofstream(path(name), std::ios::binary) << bytes;
        return path(name);
    }
    [[nodiscard]] std::size_t file_count() const {
        return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder_), {}));
    }

private:
    std::filesystem::path folder_;
};

inline std::string bytes_of(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

/// The message of the covol::Error that `call` throws; empty if it throws none.
inline std::string message_of(const std::function<void()>& call) {
    try {
        call();
    } catch (const covol::Error& e) {
        return e.what();
    }
    return {};
}

/// The code of the covol::Error that `call` throws. Throws std::logic_error if `call` throws none, or one whose message
/// does not begin with `begin`. Other exceptions are passed on.
inline covol::Errc code_of(const std::function<void()>& call, const std::string& begin = "") {
    try {
        call();
    } catch (const covol::Error& e) {
        const std::string message = e.what();
        if (message.rfind(begin, 0) == 0) return e.code();
        throw std::logic_error("expected a message that begins with '" + begin + "', got '" + message + "'");
    }
    throw std::logic_error("expected a covol::Error, got none");
}

struct FuzzCounts {
    int truncated_accepted = 0;  ///< truncated files that were read without an Error
    int truncated = 0;
    int flipped = 0;
};

/// Reads truncated and bit-flipped versions of a good file; exceptions other than covol::Error are passed on to the
/// test.
inline FuzzCounts fuzz(const Scratch& scratch, const std::string& good,
                       const std::function<void(const std::string&)>& read, int tries = 60,
                       std::size_t header_bytes = 400) {
    const std::string bytes = bytes_of(good);
    const std::string bad = scratch.path("bad-" + std::filesystem::path(good).filename().string());
    const auto accepted = [&](const std::string& content) {
        std::ofstream(bad, std::ios::binary) << content;
        try {
            read(bad);
        } catch (const covol::Error&) {
            return false;
        }
        return true;
    };
    FuzzCounts counts;
    std::mt19937 random(7);
    for (int n = 0; n < tries; ++n) {
        counts.truncated_accepted += accepted(bytes.substr(0, random() % bytes.size())) ? 1 : 0;
        ++counts.truncated;
    }
    for (int n = 0; n < 4 * tries; ++n) {
        std::string damaged = bytes;
        const std::size_t reach = n % 2 == 0 ? std::min(header_bytes, bytes.size()) : bytes.size();
        for (int flips = 0; flips <= n % 4; ++flips) damaged[random() % reach] ^= static_cast<char>(1U << random() % 8);
        accepted(damaged);
        ++counts.flipped;
    }
    return counts;
}
