#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "covol/file_set.h"

namespace covol::tool {

enum class OutputKind {
    Vdb,
    NanoVdb,
    Image,
    Mesh,
    Points,
    Picture,
    Page,
    Scene,
    Table,
    Text,
    ProgramMarks,
    StructureSet
};

/// The files of one run: checked before the long work, written at its end, and put in place together when all are
/// there. Where one fails what was there before stays as it was.
class Outputs {
public:
    /// Whoever waits for another program is told so there, and can be cancelled. @param run  lives as long as this
    explicit Outputs(const RunContext& run) : run_(run) {}

    /// Adds files and folders that this run reads: no output may replace one of them, or a file that it refers to.
    void protect(const std::vector<std::string>& inputs);

    /// Checks the ending, that the folder exists, can be written and is not locked, and that no output is a file that
    /// this run reads, another output, or something that is not a file (a device; texts may go to one) or, for .zarr, a
    /// Zarr store. An empty path is an output that was not asked for. @throws Error InvalidOptions, Io, Cancelled.
    void check(const std::string& flag, const std::string& path, OutputKind kind);

    /// Queues a file that write_queued() makes; does nothing for an empty path.
    void add(const std::string& path, std::function<void(const std::string& path)> write);

    /// Writes a file at once, to stay whatever comes after it. @returns false for an empty path.
    bool write(const std::string& path, const std::function<void(const std::string& path)>& write);
    [[nodiscard]] const std::vector<std::string>& kept() const noexcept { return kept_; }

    /// Makes what is queued, under temporary names. @throws what a writer throws.
    void write_queued();
    /// What a writer says of its file, with the path that was asked for.
    [[nodiscard]] std::string shown(const std::string& line) const { return files_.shown(line); }
    /// Puts in place what write_queued() has made. @throws Error Io.
    void publish();
    [[nodiscard]] const std::vector<std::string>& written() const noexcept { return written_; }

private:
    /// A folder that is there is replaced where it is a Zarr store in which no input lies.
    void check_store(const std::string& flag, const std::string& path, const std::filesystem::path& target);
    void check_inputs(const std::string& flag, const std::string& path, const std::filesystem::path& target);
    /// Those that an image's file refers to, where one of them may lie in `folder`.
    const std::vector<std::string>& files_of(const std::string& input, const std::filesystem::path& folder);

    struct Pending {
        std::string path;
        std::function<void(const std::string&)> write;
    };
    const RunContext& run_;
    std::vector<std::string> inputs_;
    std::map<std::string, std::vector<std::string>> files_of_;  ///< by input
    std::vector<std::string> checked_;
    std::vector<Pending> pending_;
    std::vector<Pending> devices_;  ///< to be written last: that cannot be undone
    FileSet files_;
    std::vector<std::string> written_;
    std::vector<std::string> kept_;
};

/// Whole or not at all; straight to what is not a regular file, such as /dev/stdout or a pipe, whose reader is waited
/// for. @throws Error Io, Cancelled.
void write_text(const std::string& path, const std::string& text, const RunContext& run);

/// To a stream that is open. @param name  for messages @throws Error Io, Cancelled.
void write_stream(int stream, const std::string& text, const std::string& name, const RunContext& run);

}  // namespace covol::tool
