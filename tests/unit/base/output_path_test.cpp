#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <string>

#include "covol/error.h"
#include "covol/file_set.h"
#include "support/scratch.h"

using namespace covol;
namespace fs = std::filesystem;

TEST_CASE("place_of_output: links are resolved as by the system, and missing folders and link cycles are errors") {
    const Scratch folder;
    const fs::path root = fs::canonical(folder.path(""));
    fs::create_directories(root / "deep/inner");
    fs::create_directory_symlink(root / "deep/inner", root / "link");
    std::ofstream(root / "file") << "old";
    fs::create_symlink("file", root / "to_file");
    fs::create_symlink("deep/nothing", root / "dangling");
    fs::create_symlink("no/nothing", root / "nowhere");
    fs::create_symlink("round", root / "round");
    fs::create_directory_symlink("deep", root / "to_folder");
    const auto place = [&](const char* name) { return place_of_output((root / name).string()).path; };
    CHECK(place("link/../q") == root / "deep/q");
    CHECK(place("to_file") == root / "file");
    CHECK(place("dangling") == root / "deep/nothing");
    CHECK(place("to_folder/") == root / "deep");
    CHECK(place("new") == root / "new");
    CHECK(place_of_output("/dev/stdout").is_stream);
    CHECK_FALSE(place_of_output("/dev/null").is_stream);
    CHECK(message_of([&] { place("nowhere"); }).find("does not exist") != std::string::npos);
    CHECK(message_of([&] { place("round"); }).find("symbolic links") != std::string::npos);
    CHECK(message_of([&] { place("no/q"); }).find("does not exist") != std::string::npos);
}

TEST_CASE("file_id: a link has the identity of its target, and what does not exist has none") {
    const Scratch folder;
    const fs::path root = folder.path("");
    fs::create_directory(root / "deep");
    std::ofstream(root / "file") << "text";
    std::ofstream(root / "other") << "text";
    fs::create_symlink("file", root / "to_file");
    fs::create_symlink("nothing", root / "dangling");
    CHECK(file_id(root / "to_file") == file_id(root / "file"));
    CHECK(file_id(root / "other") != file_id(root / "file"));
    CHECK(file_id(root / "deep/../file") == file_id(root / "file"));
    CHECK(file_id(root / "deep") != FileId{});
    CHECK(file_id(root / "dangling") == FileId{});
    CHECK(file_id(root / "nothing") == FileId{});
}
