#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "covol/file_set.h"

namespace covol::tool {

enum class OutputKind { Vdb, NanoVdb, Image, Mesh, Points, Picture, Page, Scene, Table, Text };

/// The files of one run: checked before the long work, written at its end, and put in place together when all are
/// there. Where one fails what was there before stays as it was.
class Outputs {
public:
    /// Names the files that this run reads: no output may replace one of them.
    void protect(std::vector<std::string> inputs) { inputs_ = std::move(inputs); }

    /// Checks the ending, that the folder exists and can be written, and that no output is an input, another output, or
    /// something that is not a file (a device; texts may go to one) or, for .zarr, a Zarr store.
    /// An empty path is an output that was not asked for. @throws Error InvalidOptions, Io.
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
    void check_store(const std::string& flag, const std::string& path, const std::filesystem::path& target) const;

    struct Pending {
        std::string path;
        std::function<void(const std::string&)> write;
    };
    std::vector<std::string> inputs_;
    std::vector<std::string> checked_;
    std::vector<Pending> pending_;
    std::vector<Pending> devices_;  ///< to be written last: that cannot be undone
    FileSet files_;
    std::vector<std::string> written_;
    std::vector<std::string> kept_;
};

/// Whole or not at all; straight to what is not a regular file, such as /dev/stdout or a pipe. @throws Error Io.
void write_text(const std::string& path, const std::string& text);

}  // namespace covol::tool
