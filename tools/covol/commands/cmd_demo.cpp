#include <array>
#include <filesystem>

#include "commands/commands.h"
#include "commands/mark_call.h"
#include "covol/digest.h"
#include "covol/error.h"
#include "covol/file_set.h"

namespace covol::tool {
namespace {

namespace fs = std::filesystem;

constexpr const char* kImage = "celegans_embryo.tif";
constexpr const char* kMarks = "celegans_marks.csv";
constexpr std::array kFiles{kImage, kMarks, "README.md"};

/// The folder of the installed samples, at a fixed path relative to the program.
fs::path folder_of_samples() {
    const fs::path program = fs::read_symlink("/proc/self/exe").parent_path();
    return (program / COVOL_TO_DATA / "covol" / "demo").lexically_normal();
}

struct DemoJob {
    std::string folder = "covol_demo";
    bool without_browser = false;
    int port = 0;

    void run(Session& session) const {
        copy_samples(session.run());
        const std::string image = (fs::path(folder) / kImage).string(), marks = (fs::path(folder) / kMarks).string();
        session.note("wrote " + image + ", a C. elegans embryo with stained membranes, and " + marks +
                     ", marks on its envelope");
        session.note("from the command line: covol segment " + shell_quoted(image) + " --points " +
                     shell_quoted(marks) + " --voxel-size 3 -o embryo.vdb --report embryo.html");
        run_mark(session, {image, {"embryo=" + marks}, without_browser, port});
    }

private:
    /// Copies the samples into the folder, unless it already contains them: then its study is continued.
    void copy_samples(const RunContext& run) const {
        std::error_code failed;
        fs::create_directories(folder, failed);
        if (failed) throw Error(Errc::Io, folder + ": the folder cannot be created: " + failed.message());
        FileSet files;
        for (const char* const name : kFiles) {
            const fs::path from = folder_of_samples() / name, to = fs::path(folder) / name;
            if (!fs::is_regular_file(from, failed))
                throw Error(Errc::Io,
                            from.string() + ": expected the sample that is installed with covol; install covol again");
            if (fs::exists(fs::symlink_status(to, failed))) {
                if (fs::is_regular_file(to, failed) && digest_of(to.string()) == digest_of(from.string())) continue;
                throw Error(Errc::InvalidInput, to.string() +
                                                    ": another file of this name exists already; "
                                                    "choose another folder, as in covol demo FOLDER");
            }
            files.write(
                to.string(),
                [&](const std::string& path) {
                    std::error_code status;
                    if (!fs::copy_file(from, path, fs::copy_options::overwrite_existing, status))
                        throw Error(Errc::Io, path + ": cannot be written: " + status.message());
                },
                run);
        }
        files.publish(run);
    }
};

}  // namespace

void add_demo(Session& session) {
    const auto [job, command] =
        session.add_job<DemoJob>("demo", "Write a sample image and its marks, and open them in the page of covol mark");
    in_group(*command, Group::Output);
    command->add_option("folder", job->folder, "folder to which they are written, created if it does not exist")
        ->capture_default_str()
        ->type_name("OUT_FOLDER");
    bind_page(*command, job->without_browser, job->port);
}

}  // namespace covol::tool
