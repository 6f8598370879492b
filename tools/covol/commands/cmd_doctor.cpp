#include <link.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>
#include <thread>

#include "cli/output/bytes_text.h"
#include "cli/system/free_memory.h"
#include "commands/commands.h"
#include "covol/evolve.h"
#include "covol/reader_parts.h"
#include "covol/version.h"
#include "mark/browser.h"

namespace covol::tool {
namespace {

namespace fs = std::filesystem;

std::string variable(const char* name) {
    const char* const value = std::getenv(name);
    return value == nullptr ? "" : value;
}

/// The shared libraries that are loaded now, with symbolic links resolved.
std::set<fs::path> loaded_libraries() {
    std::set<fs::path> found;
    const auto add = [](dl_phdr_info* info, std::size_t, void* to) {
        std::error_code failed;
        const fs::path path = fs::canonical(info->dlpi_name, failed);
        if (*info->dlpi_name != '\0' && !failed) static_cast<std::set<fs::path>*>(to)->insert(path);
        return 0;
    };
    dl_iterate_phdr(add, &found);
    return found;
}

/// The number of files in each folder. Files in subfolders are counted for the outermost folder that contains a file.
std::map<std::string, int> count_by_folder(const std::set<fs::path>& files) {
    std::set<fs::path> folders;
    for (const fs::path& file : files) folders.insert(file.parent_path());
    std::map<std::string, int> counts;
    for (const fs::path& file : files) {
        fs::path outermost = file.parent_path();
        for (fs::path above = outermost; above.has_relative_path(); above = above.parent_path())
            if (folders.contains(above)) outermost = above;
        ++counts[outermost.string()];
    }
    return counts;
}

bool is_main(const std::string& name) {
    constexpr const char* kNames[] = {"libcovol.", "libopenvdb.", "libtbb.", "libtiff.", "libITKIONRRD", "libhdf5"};
    return std::any_of(std::begin(kNames), std::end(kNames), [&](const char* main) { return name.starts_with(main); });
}

struct DoctorJob {
    void run(Session& session) const {
        Json& report = session.report()["doctor"];
        session.print(std::string("covol ") + version() + ", " + build_text());
        if (std::string(version()) != COVOL_VERSION_STRING)
            session.warn(
                std::string("the program has version " COVOL_VERSION_STRING ", the library that it loaded has ") +
                version() + "; install covol again, and check LD_LIBRARY_PATH");
        const std::string program = fs::read_symlink("/proc/self/exe").string();
        session.print("program: " + program);
        report = {{"build", build_text()}, {"program", program}};
        report["readers"] = readers(session);  // before libraries(), so that the readers' libraries are loaded
        report["libraries"] = libraries(session);
        const unsigned cores = std::max(1U, std::thread::hardware_concurrency());
        session.print(std::string("processor: ") + std::to_string(cores) + " cores, instruction set " +
                      instruction_set());
        report["cores"] = cores;
        report["memory"] = memory(session);
        report["scratch"] = scratch(session);
        report["browser"] = browser(session);
    }

private:
    static Json readers(Session& session) {
        Json list = Json::array();
        for (const ReaderPart& part : check_reader_parts()) {
            if (part.problem.empty())
                session.print("reader " + part.name + ": found (" + part.formats + ")");
            else
                session.warn("reader " + part.name + " (" + part.formats + "): " + part.problem);
            list.push_back(
                {{"name", part.name}, {"formats", part.formats}, {"path", part.path}, {"problem", part.problem}});
        }
        session.print(
            "formats that need no separate reader: TIFF, NIfTI, OME-Zarr, MRC, ICS, NumPy, OpenVDB, meshes, tables");
        return list;
    }

    static Json libraries(Session& session) {
        const std::set<fs::path> loaded = loaded_libraries();
        Json list = Json::array();
        std::string main;
        for (const fs::path& path : loaded) {
            list.push_back(path.string());
            if (is_main(path.filename().string())) main += (main.empty() ? "" : ", ") + path.filename().string();
        }
        std::string text = "libraries: " + main;
        for (const auto& [folder, count] : count_by_folder(loaded))
            text += "\n  " + std::to_string(count) + " in " + folder;
        for (const char* const name : {"LD_LIBRARY_PATH", "LD_PRELOAD"})
            if (const std::string value = variable(name); !value.empty())
                text += std::string("\n  ") + name + " is " + value;
        session.print(text);
        return list;
    }

    static Json memory(Session& session) {
        const std::optional<FreeMemory> free = find_free_memory();
        if (!free) {
            session.print("memory: the free memory is unknown");
            return {{"free_bytes", nullptr}, {"where", ""}};
        }
        session.print("memory: " + bytes_text(double(free->bytes)) + " free, limited by " + free->where);
        return {{"free_bytes", free->bytes}, {"where", free->where}};
    }

    static Json scratch(Session& session) {
        std::error_code failed;
        const fs::path folder = fs::temp_directory_path(failed);
        const fs::space_info space = failed ? fs::space_info{0, 0, 0} : fs::space(folder, failed);
        if (failed) {
            session.warn("temporary files: " + (folder.empty() ? "no folder" : folder.string()) + ": " +
                         failed.message() + "; set TMPDIR to a writable folder");
            return {{"folder", folder.string()}, {"free_bytes", 0}};
        }
        session.print("temporary files: " + folder.string() + ", " + bytes_text(double(space.available)) + " free");
        return {{"folder", folder.string()}, {"free_bytes", space.available}};
    }

    static Json browser(Session& session) {
        const std::string opener = find_opener();
        const std::string display =
            variable("WAYLAND_DISPLAY").empty() ? variable("DISPLAY") : variable("WAYLAND_DISPLAY");
        if (opener.empty() || display.empty())
            session.print(
                std::string("browser: ") + (opener.empty() ? "no xdg-open, " : "no display, ") +
                "so covol mark prints its address; from another machine: covol mark IMAGE --no-browser --port "
                "9000 through ssh -L 9000:127.0.0.1:9000");
        else
            session.print("browser: opened by " + opener);
        return {{"opener", opener}, {"display", display}};
    }
};

}  // namespace

void add_doctor(Session& session) {
    session.add_job<DoctorJob>(
        "doctor", "Report the version of covol and what it finds on this machine: libraries, readers, memory, browser");
}

}  // namespace covol::tool
