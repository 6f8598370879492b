#include "covol/file_set.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <csignal>
#include <cstdlib>

#include "covol/error.h"
#include "files/folder_lock.h"
#include "support/scratch.h"

using namespace covol;
namespace fs = std::filesystem;

/// Defined in support/kill_at.cpp: counts, from now on, the calls that put files in place (rename, unlink, fsync, ...),
/// and kills this process before the number-th of them; 0: never.
extern "C" void covol_kill_before(long number);

namespace {

void kill_before(long number) { covol_kill_before(number); }

void write(FileSet& set, const std::string& path, const std::string& text) {
    set.write(path, [&](const std::string& to) { std::ofstream(to) << text; });
}

/// Runs `body` in a separate process that is killed at the end, so that nothing is cleaned up.
template <typename Body>
void run_and_kill(const Body& body) {
    const pid_t child = ::fork();
    REQUIRE(child >= 0);
    if (child == 0) {
        body();
        ::kill(::getpid(), SIGKILL);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    REQUIRE(WIFSIGNALED(status));
}

/// Runs `body` in a separate process. @returns whether kill_before() killed that process
template <typename Body>
bool is_killed(const Body& body) {
    const pid_t child = ::fork();
    REQUIRE(child >= 0);
    if (child == 0) {
        body();
        ::_exit(0);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    REQUIRE((WIFSIGNALED(status) || WEXITSTATUS(status) == 0));
    return WIFSIGNALED(status);
}

fs::path scratch_in(const fs::path& folder) {
    for (const auto& entry : fs::directory_iterator(folder))
        if (entry.path().filename().string().starts_with(".covol-")) return entry.path();
    return {};
}

}  // namespace

TEST_CASE("file_set: publish() puts all files in place together and leaves no scratch files") {
    const Scratch folder;
    const fs::path root = folder.path("");
    folder.write("a", "old a");
    fs::create_directory(root / "other");
    {
        FileSet set;
        write(set, folder.path("a"), "new a");
        write(set, folder.path("other/b"), "new b");
        CHECK(bytes_of(folder.path("a")) == "old a");
        CHECK_FALSE(fs::exists(folder.path("other/b")));
        CHECK(set.paths() == std::vector{folder.path("a"), folder.path("other/b")});
        set.publish();
        CHECK(set.paths().empty());
    }
    CHECK(bytes_of(folder.path("a")) == "new a");
    CHECK(bytes_of(folder.path("other/b")) == "new b");
    CHECK(folder.file_count() == 2);
    CHECK(std::distance(fs::directory_iterator(root / "other"), fs::directory_iterator()) == 1);
}

TEST_CASE("file_set: without publish() existing files stay and nothing else is left") {
    const Scratch folder;
    const fs::path root = folder.path("");
    folder.write("a", "old a");
    {
        FileSet set;
        write(set, folder.path("a"), "new a");
        CHECK_THROWS_AS(set.write(folder.path("b"),
                                  [&](const std::string& to) {
                                      std::ofstream(to) << "half";
                                      throw Error(Errc::Io, to + ": disk full");
                                  }),
                        Error);
        try {
            set.write(folder.path("b"), [](const std::string& to) { throw Error(Errc::Io, to + ": disk full"); });
        } catch (const Error& error) {
            CHECK(error.what() == folder.path("b") + ": disk full");
        }
    }
    CHECK(bytes_of(folder.path("a")) == "old a");
    CHECK(folder.file_count() == 1);
}

TEST_CASE("file_set: messages show the requested paths instead of scratch paths") {
    const Scratch folder;
    FileSet set;
    std::string shown;
    set.write(folder.path("a"), [&](const std::string& to) {
        shown = set.shown(to + ": odd, " + to);
        std::ofstream(to) << "a";
    });
    CHECK(shown == folder.path("a") + ": odd, " + folder.path("a"));
    CHECK(set.shown("nothing of it") == "nothing of it");
}

TEST_CASE("file_set: if publish() fails midway, the previous files are restored") {
    const Scratch folder;
    const fs::path root = folder.path("");
    folder.write("a", "old a");
    fs::create_directory(root / "gone");
    FileSet set;
    write(set, folder.path("a"), "new a");
    write(set, folder.path("b"), "new b");
    write(set, folder.path("gone/c"), "new c");
    fs::remove_all(root / "gone");
    CHECK_THROWS_AS(set.publish(), Error);
    CHECK(bytes_of(folder.path("a")) == "old a");
    CHECK_FALSE(fs::exists(folder.path("b")));
}

TEST_CASE("file_set: a folder is replaced by a folder, and never by a file") {
    const Scratch folder;
    const fs::path root = folder.path("");
    fs::create_directory(root / "s.zarr");
    folder.write("s.zarr/old", "old");
    FileSet set;
    CHECK_THROWS_AS(write(set, folder.path("s.zarr"), "a file"), Error);
    FileSet other;
    other.write(folder.path("s.zarr/"), [](const std::string& to) {
        fs::create_directory(to);
        std::ofstream(to + "/new") << "new";
    });
    other.publish();
    CHECK(bytes_of(folder.path("s.zarr/new")) == "new");
    CHECK_FALSE(fs::exists(folder.path("s.zarr/old")));
}

TEST_CASE("file_set: the next run removes scratch folders of killed runs and keeps those of running ones") {
    const Scratch folder;
    const fs::path root = folder.path("");
    folder.write("a", "old a");
    run_and_kill([&] {
        FileSet* set = new FileSet;  // never destroyed, as in a process that is killed
        write(*set, folder.path("a"), "half of a set");
    });
    CHECK(folder.file_count() == 2);
    const ScratchFolder living(root);
    CHECK(folder.file_count() == 2);  // the file, and the folder of this run; that of the killed one is removed
    const ScratchFolder another(root);
    CHECK(fs::exists(living.path()));
    const ScratchFolder inner(living.path());  // another folder can be made in that of a living run
    CHECK(bytes_of(folder.path("a")) == "old a");
}

TEST_CASE("file_set: remove_all() removes the scratch folders of a process that ends without unwinding") {
    const Scratch folder;
    folder.write("a", "old a");
    FileSet set;
    write(set, folder.path("a"), "new a");
    CHECK(folder.file_count() == 2);
    ScratchFolder::remove_all();
    CHECK(folder.file_count() == 1);
    CHECK(bytes_of(folder.path("a")) == "old a");
}

TEST_CASE("file_set: if publish() is killed at any call, recovery leaves both folders either old or new") {
    const Scratch folder;
    const std::vector<std::string> names{"one/a", "two/b", "one/c", "two/fresh"};
    int new_count = 0, old_count = 0;
    for (const std::string recovered : {"one", "two"}) {
        bool killed = true;
        for (long call = 1; killed; ++call) {
            INFO("killed before call " << call << ", then a run in " << recovered);
            REQUIRE(call < 500);
            for (const char* name : {"one", "two"}) {
                fs::remove_all(folder.path(name));
                fs::create_directory(folder.path(name));
            }
            for (const std::string& name : names)
                if (name != "two/fresh") folder.write(name, "old");
            // This file seems to be newer than the set, as if a server whose clock is ahead had written it.
            fs::last_write_time(folder.path("one/c"), fs::file_time_type::clock::now() + std::chrono::hours(1));
            killed = is_killed([&] {
                FileSet set;
                for (const std::string& name : names) write(set, folder.path(name), "new");
                kill_before(call);
                set.publish();
                kill_before(0);
            });
            { const ScratchFolder next(folder.path(recovered)); }
            const std::string state = bytes_of(folder.path(names[0]));
            CHECK((state == "old" || state == "new"));
            for (const std::string& name : names) {
                INFO(name);
                if (name == "two/fresh" && state == "old")
                    CHECK_FALSE(fs::exists(folder.path(name)));
                else
                    CHECK(bytes_of(folder.path(name)) == state);
            }
            (state == "new" ? new_count : old_count) += 1;
            // The next run in each folder removes the scratch folder that is left there, and changes no other file.
            for (const char* name : {"one", "two"}) {
                { const ScratchFolder clears(folder.path(name)); }
                CHECK(scratch_in(folder.path(name)).empty());
            }
            for (const std::string& name : names)
                CHECK((bytes_of(folder.path(name)) == state) == fs::exists(folder.path(name)));
        }
    }
    // The set was killed at several calls before it was committed (`old_count`), and at several calls during the
    // renames and while clearing up (`new_count`).
    CHECK(old_count > 2 * 5);
    CHECK(new_count > 2 * 5);
}

TEST_CASE("file_set: a recovery that is killed is completed by the next run") {
    const Scratch folder;
    const std::vector<std::string> names{"one/a", "two/b", "one/c"};
    long last = 0;
    for (long first = 12; first < 40; first += 4)
        for (long second = 1; second < 30; second += 5) {
            INFO("killed before call " << first << ", the next run before call " << second);
            for (const char* name : {"one", "two"}) fs::create_directory(folder.path(name));
            for (const std::string& name : names) folder.write(name, "old");
            if (is_killed([&] {
                    FileSet set;
                    for (const std::string& name : names) write(set, folder.path(name), "new");
                    kill_before(first);
                    set.publish();
                    kill_before(0);
                }))
                last = first;
            is_killed([&] {
                kill_before(second);
                const ScratchFolder next(folder.path("two"));
                kill_before(0);
            });
            for (const char* name : {"one", "two"}) {
                { const ScratchFolder clears(folder.path(name)); }
                CHECK(scratch_in(folder.path(name)).empty());
            }
            for (const std::string& name : names) CHECK(bytes_of(folder.path(name)) == bytes_of(folder.path(names[0])));
        }
    CHECK(last > 20);
}

TEST_CASE("file_set: completing a committed set keeps a file that was replaced since by another program") {
    const Scratch folder;
    const fs::path root = folder.path("");
    bool is_committed = false;
    for (long call = 1; call < 100 && !is_committed; ++call) {
        for (const char* name : {"a", "b", "c"}) folder.write(name, "old");
        is_killed([&] {
            FileSet set;
            for (const char* name : {"a", "b", "c"}) write(set, folder.path(name), "new");
            kill_before(call);
            set.publish();
        });
        if (bytes_of(folder.path("a")) != "new" || bytes_of(folder.path("c")) != "old") {
            const ScratchFolder clears(root);
            continue;
        }
        is_committed = true;
        folder.write("c", "another's");
        // Another file than the set's, with an older time of modification, as for example a copy has it.
        fs::last_write_time(root / "c", fs::file_time_type::clock::now() - std::chrono::hours(1));
        { const ScratchFolder next(root); }
        CHECK(bytes_of(folder.path("b")) == "new");
        CHECK(bytes_of(folder.path("c")) == "another's");
        CHECK(folder.file_count() == 3);
    }
    CHECK(is_committed);
}

TEST_CASE("file_set: only files and folders that covol made are removed") {
    const Scratch folder;
    const fs::path root = folder.path("");
    // A user's folders whose names resemble those of covol's scratch folders, and copies of a folder that covol left
    // behind: all of them must stay.
    run_and_kill([&] {
        FileSet* set = new FileSet;
        write(*set, folder.path("a"), "half of a set");
    });
    const fs::path left = scratch_in(root);
    REQUIRE_FALSE(left.empty());
    const std::vector<fs::path> kept{root / ".covol-notes", root / ".covol-abcdef", root / ".covol-abcde",
                                     root / ".covol-abcdefg", root / ".covol-abc.ef"};
    for (const fs::path& path : kept) {
        fs::create_directory(path);
        std::ofstream(path / "diary") << "important";
    }
    fs::copy(left, root / ".covol-copied");
    fs::create_directory(root / ".covol-locked");
    std::ofstream(root / ".covol-locked/.covol-lock") << "another program's";
    fs::create_directory(root / "outside");
    std::ofstream(root / "outside/file") << "important";
    fs::create_directory_symlink(root / "outside", root / ".covol-linked");
    std::ofstream(root / ".covol-single") << "a file";
    // As left by a process that is killed right after it has made its folder.
    fs::create_directory(root / ".covol-empty1");
    fs::create_directory(root / ".covol-empty1.5");
    // A link in a folder that covol left behind is not followed, and files there that covol did not list are kept.
    fs::create_directory_symlink(root / "outside", left / "a.zarr");
    std::ofstream(left / "a stranger's") << "important";
    { const ScratchFolder next(root); }
    for (const fs::path& path : kept) CHECK(bytes_of(path / "diary") == "important");
    CHECK(fs::exists(root / ".covol-copied/a"));
    CHECK(fs::exists(root / ".covol-locked/.covol-lock"));
    CHECK(bytes_of(root / "outside/file") == "important");
    CHECK(fs::is_symlink(root / ".covol-linked"));
    CHECK(fs::exists(root / ".covol-single"));
    CHECK_FALSE(fs::exists(root / ".covol-empty1"));
    CHECK(fs::exists(root / ".covol-empty1.5"));
    CHECK(bytes_of(left / "a stranger's") == "important");
    CHECK_FALSE(fs::exists(left / "a"));
}

TEST_CASE("file_set: a manifest that was copied to another folder moves no files") {
    const Scratch folder;
    for (const char* name : {"one", "two"}) {
        fs::create_directory(folder.path(name));
        folder.write(std::string(name) + "/a", "old");
    }
    for (long call = 1;; ++call) {
        REQUIRE(call < 100);
        is_killed([&] {
            FileSet set;
            write(set, folder.path("one/a"), "new");
            kill_before(call);
            set.publish();
        });
        const fs::path left = scratch_in(folder.path("one"));
        if (!left.empty() && fs::exists(left / ".covol-publish")) break;
        { const ScratchFolder clears(folder.path("one")); }
        folder.write("one/a", "old");
    }
    // The folder that covol left behind is copied to another place, as may happen with an archive from somebody else.
    // The files that it names are not in this place, so they must not be moved.
    const fs::path left = scratch_in(folder.path("one")), moved = fs::path(folder.path("two")) / left.filename();
    fs::copy(left, moved, fs::copy_options::recursive);
    { const ScratchFolder next(folder.path("two")); }
    CHECK(bytes_of(folder.path("two/a")) == "old");
    CHECK(fs::exists(moved));
}

TEST_CASE("file_set: waiting for a locked folder is logged, ends with an error, and can be cancelled") {
    const Scratch folder;
    const fs::path root = folder.path("");
    folder.write("a", "old");
    const int held = ::open(root.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    REQUIRE(::flock(held, LOCK_EX) == 0);
    std::vector<std::string> messages;
    std::atomic<bool> cancel = false;
    RunContext run;
    run.cancel = &cancel;
    run.log = [&](LogLevel level, const std::string& line) {
        CHECK(level == LogLevel::Info);
        messages.push_back(line);
    };
    const std::string why = message_of([&] { detail::FolderLock(root, run, std::chrono::milliseconds(1200)); });
    CHECK(why.find("waited 1 s for process " + std::to_string(::getpid())) != std::string::npos);
    REQUIRE(messages.size() == 1);
    CHECK(messages.front().find("waiting for process " + std::to_string(::getpid())) != std::string::npos);
    run.log = [&](LogLevel, const std::string&) { cancel = true; };
    CHECK(code_of([&] { wait_for_folder(root, run); }) == Errc::Cancelled);
    cancel = false;
    run.log = [&](LogLevel, const std::string&) { ::flock(held, LOCK_UN); };
    FileSet set;
    set.write(
        folder.path("a"), [](const std::string& to) { std::ofstream(to) << "new"; }, run);
    ::flock(held, LOCK_EX);
    set.publish(run);
    CHECK(bytes_of(folder.path("a")) == "new");
    ::close(held);
}

TEST_CASE("file_set: files written under two names of one folder are all published") {
    const Scratch folder;
    fs::create_directory(folder.path("one"));
    fs::create_directory_symlink(folder.path("one"), folder.path("also"));
    FileSet set;
    write(set, folder.path("one/a"), "new a");
    write(set, folder.path("also/b"), "new b");
    set.publish();
    CHECK(bytes_of(folder.path("one/a")) == "new a");
    CHECK(bytes_of(folder.path("one/b")) == "new b");
}

TEST_CASE("file_set, write_text_file: a link is kept and its target replaced, and permissions are kept") {
    const Scratch folder;
    const fs::path root = folder.path("");
    const auto mode_of = [&](const std::string& name) {
        struct stat entry {};
        REQUIRE(::stat(folder.path(name).c_str(), &entry) == 0);
        return entry.st_mode & 07777;
    };
    for (const bool in_set : {true, false}) {
        const auto put = [&](const std::string& name, const std::string& text) {
            if (!in_set) return write_text_file(folder.path(name), text);
            FileSet set;
            write(set, folder.path(name), text);
            set.publish();
        };
        for (const mode_t mode : {0600, 0640, 0444, 0666, 0755}) {
            folder.write("file", "old");
            ::chmod(folder.path("file").c_str(), mode);
            put("file", "new");
            CHECK(mode_of("file") == mode);
            CHECK(bytes_of(folder.path("file")) == "new");
            fs::remove(root / "file");
        }
        folder.write("file", "old");
        ::chmod(folder.path("file").c_str(), 0600);
        fs::create_symlink("file", root / "link");
        fs::create_symlink("made", root / "dangling");
        put("link", "through the link");
        put("dangling", "through the other");
        CHECK(fs::read_symlink(root / "link") == "file");
        CHECK(fs::read_symlink(root / "dangling") == "made");
        CHECK(bytes_of(folder.path("file")) == "through the link");
        CHECK(bytes_of(folder.path("made")) == "through the other");
        CHECK(mode_of("file") == 0600);
        for (const char* name : {"file", "link", "made", "dangling"}) fs::remove(root / name);
    }
    if (::geteuid() == 0) {
        folder.write("file", "old");
        REQUIRE(::chown(folder.path("file").c_str(), 1234, 2345) == 0);
        write_text_file(folder.path("file"), "new");
        struct stat entry {};
        REQUIRE(::stat(folder.path("file").c_str(), &entry) == 0);
        CHECK(entry.st_uid == 1234);
        CHECK(entry.st_gid == 2345);
        // In a world-writable folder with the sticky bit, as /tmp is, a link of another user is not followed.
        fs::create_directory(root / "tmp");
        ::chmod((root / "tmp").c_str(), 01777);
        fs::create_symlink(root / "file", root / "tmp/link");
        REQUIRE(::lchown((root / "tmp/link").c_str(), 1234, 2345) == 0);
        CHECK(message_of([&] { write_text_file((root / "tmp/link").string(), "x"); }).find("another user's") !=
              std::string::npos);
        CHECK(bytes_of(folder.path("file")) == "new");
    }
}

TEST_CASE("write_text_file: a new file has the default permissions, and an error leaves no file") {
    const Scratch folder;
    const fs::path root = folder.path("");
    write_text_file(folder.path("t"), "text");
    CHECK(bytes_of(folder.path("t")) == "text");
    const mode_t mask = ::umask(0);
    ::umask(mask);
    struct stat entry {};
    REQUIRE(::stat(folder.path("t").c_str(), &entry) == 0);
    CHECK((entry.st_mode & 0777) == (0666 & ~mask));
    CHECK_THROWS_AS(write_text_file(folder.path("no/t"), "text"), Error);
    CHECK(folder.file_count() == 1);
}
