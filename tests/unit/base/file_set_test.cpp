#include "covol/file_set.h"

#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <csignal>

#include "covol/error.h"
#include "support/scratch.h"

using namespace covol;
namespace fs = std::filesystem;

namespace {

void write(FileSet& set, const std::string& path, const std::string& text) {
    set.write(path, [&](const std::string& to) { std::ofstream(to) << text; });
}

/// Runs `body` in a process of its own, which is killed at its end: nothing is cleaned up.
template <typename Body>
void die_after(const Body& body) {
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

fs::path scratch_in(const fs::path& folder) {
    for (const auto& entry : fs::directory_iterator(folder))
        if (entry.path().filename().string().starts_with(".covol-")) return entry.path();
    return {};
}

}  // namespace

TEST_CASE("file_set: files come together, and nothing else stays") {
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

TEST_CASE("file_set: without publish() all is as before") {
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

TEST_CASE("file_set: people see the paths that they gave") {
    const Scratch folder;
    FileSet set;
    std::string said;
    set.write(folder.path("a"), [&](const std::string& to) {
        said = set.shown(to + ": odd, " + to);
        std::ofstream(to) << "a";
    });
    CHECK(said == folder.path("a") + ": odd, " + folder.path("a"));
    CHECK(set.shown("nothing of it") == "nothing of it");
}

TEST_CASE("file_set: where publish() fails half way, what was there is put back") {
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

TEST_CASE("file_set: folders are replaced, and never by files") {
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

TEST_CASE("file_set: the next run clears after one that was killed, and leaves those that live") {
    const Scratch folder;
    const fs::path root = folder.path("");
    folder.write("a", "old a");
    die_after([&] {
        FileSet* set = new FileSet;  // never destroyed
        write(*set, folder.path("a"), "half of a set");
    });
    CHECK(folder.file_count() == 2);
    const ScratchFolder living(root);
    CHECK(folder.file_count() == 2);  // the file, and the one that lives
    const ScratchFolder another(root);
    CHECK(fs::exists(living.path()));
    const ScratchFolder inner(living.path());  // the life of one is no obstacle to one in it
    CHECK(bytes_of(folder.path("a")) == "old a");
}

TEST_CASE("file_set: a process that ends without unwinding can remove its folders") {
    const Scratch folder;
    folder.write("a", "old a");
    FileSet set;
    write(set, folder.path("a"), "new a");
    CHECK(folder.file_count() == 2);
    ScratchFolder::remove_all();
    CHECK(folder.file_count() == 1);
    CHECK(bytes_of(folder.path("a")) == "old a");
}

TEST_CASE("file_set: a set that was killed while it was put in place is completed") {
    const Scratch folder;
    const fs::path root = folder.path("");
    for (const char* name : {"a", "b", "c"}) folder.write(name, std::string("old ") + name);
    die_after([&] {
        FileSet* set = new FileSet;
        for (const char* name : {"a", "b", "c"}) write(*set, folder.path(name), std::string("new ") + name);
    });
    // As in the middle of publish(): the manifest is there, one file is in its place.
    const fs::path scratch = scratch_in(root);
    std::string manifest;
    for (const char* name : {"a", "b", "c"}) {
        struct stat entry {};
        REQUIRE(::stat((scratch / name).c_str(), &entry) == 0);
        manifest += std::to_string(entry.st_ino) + " " + name + '\0';
    }
    std::ofstream(scratch / ".covol-publish") << manifest;
    fs::rename(scratch / "a", root / "x");
    fs::rename(root / "a", scratch / "a");
    fs::rename(root / "x", root / "a");
    fs::last_write_time(root / "c", fs::file_time_type::clock::now() + std::chrono::hours(1));  // another's since
    const ScratchFolder next(root);
    CHECK(bytes_of(folder.path("a")) == "new a");
    CHECK(bytes_of(folder.path("b")) == "new b");
    CHECK(bytes_of(folder.path("c")) == "old c");
    CHECK_FALSE(fs::exists(scratch));
}

TEST_CASE("write_text_file: whole, with the permissions of any new file") {
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
