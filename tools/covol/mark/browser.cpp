#include "mark/browser.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <system_error>

#include "covol/error.h"

extern char** environ;

namespace covol::tool {

std::string find_opener() {
    const char* const path = std::getenv("PATH");
    for (const char* const name : {"xdg-open", "open"}) {
        std::istringstream folders(path == nullptr ? "" : path);
        for (std::string folder; std::getline(folders, folder, ':');) {
            const std::string program = (std::filesystem::path(folder) / name).string();
            std::error_code status;
            if (std::filesystem::is_regular_file(program, status) && ::access(program.c_str(), X_OK) == 0)
                return program;
        }
    }
    return {};
}

BrowserLink::BrowserLink(const std::string& url) {
    std::error_code failed;
    const std::filesystem::path folder = std::filesystem::temp_directory_path(failed);
    if (failed)
        throw Error(Errc::Io, "mark: the folder for temporary files cannot be used: " + failed.message() +
                                  "; set TMPDIR to a writable folder");
    std::string name = (folder / "covol-open-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr)
        throw Error(Errc::Io, "mark: cannot create the folder " + name + ": " + std::strerror(errno) +
                                  "; set TMPDIR to a writable folder");
    folder_ = name;
    std::ofstream page(folder_ / "open.html");
    page << "<!doctype html><meta charset=\"utf-8\"><meta name=\"referrer\" content=\"no-referrer\"><title>covol "
            "mark</title>"
         << "<meta http-equiv=\"refresh\" content=\"0;url=" << url << "\">\n";
    if (!page.flush()) throw Error(Errc::Io, "mark: " + folder_.string() + " cannot be written");
}

BrowserLink::~BrowserLink() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
}

bool BrowserLink::open() const {
    const std::string file = (folder_ / "open.html").string();
    const std::string program = find_opener();
    if (program.empty()) return false;
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", O_RDWR, 0);
    const std::array<const char*, 3> words{program.c_str(), file.c_str(), nullptr};
    pid_t child = 0;
    const int failed =
        ::posix_spawn(&child, program.c_str(), &actions, nullptr, const_cast<char* const*>(words.data()), environ);
    posix_spawn_file_actions_destroy(&actions);
    int status = 0;
    return failed == 0 && ::waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace covol::tool
