#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
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

/// The files of one run: checked before the computation, written at its end, and moved into place together when all are
/// complete. If one fails, the previous files stay unchanged.
class Outputs {
public:
    /// @param run  is used to report and to cancel waiting for other programs, for example for one that holds the lock
    /// on a folder; must outlive this object
    explicit Outputs(const RunContext& run) : run_(run) {}

    /// Adds files and folders that this run reads: no output may replace one of them, or a file that it refers to.
    /// Paths that were added before are left out.
    void protect(const std::vector<std::string>& inputs);

    /// Checks the ending of the name, that the folder exists, is writable and is not locked, and that the path is
    /// neither an input nor another output. An existing path must be a regular file or, for .zarr, a Zarr store; texts
    /// and tables may also go to a device, pipe or stream. An empty path is an output that was not requested.
    /// @throws Error InvalidOptions, Io, Cancelled.
    void check(const std::string& flag, const std::string& path, OutputKind kind);

    /// Queues an output for write_queued(); does nothing for an empty path.
    void add(const std::string& path, std::function<void(const std::string& path)> write);

    /// Writes a file at once. Unlike queued files, it is kept if the run fails later. @returns false for an empty path.
    bool write(const std::string& path, const std::function<void(const std::string& path)>& write);
    [[nodiscard]] const std::vector<std::string>& kept() const noexcept { return kept_; }

    /// Writes the queued files, under temporary names. @throws what a writer throws.
    void write_queued();
    /// The message of a writer, in which temporary paths are replaced by final ones.
    [[nodiscard]] std::string shown(const std::string& line) const { return files_.shown(line); }
    /// Moves the files of write_queued() into place. @throws Error Io.
    void publish();
    [[nodiscard]] const std::vector<std::string>& written() const noexcept { return written_; }

private:
    struct File {
        std::string path;
        FileId id;
    };
    struct Input : File {
        FileId folder;  ///< the folder that contains the file or, if the input is a folder, the input
        /// The files that it refers to; none until files_of() has read them.
        std::optional<std::vector<File>> refers_to;
    };

    /// Checks that an existing folder is a Zarr store that contains no input, because it will be replaced.
    void check_store(const std::string& flag, const std::string& path, const std::filesystem::path& target);
    void check_inputs(const std::string& flag, const std::string& path, const std::filesystem::path& target);
    /// The files that the file of an image refers to; empty if none of them can be in `folder`.
    static const std::vector<File>& files_of(Input& input, const FileId& folder);

    struct Pending {
        std::string path;
        std::function<void(const std::string&)> write;
    };
    const RunContext& run_;
    std::vector<Input> inputs_;
    std::set<std::string> protected_;  ///< the paths of inputs_
    std::vector<std::string> stores_;  ///< those of the inputs whose names end in .zarr
    std::vector<std::string> checked_;
    std::vector<Pending> pending_;
    std::vector<Pending> devices_;  ///< outputs to devices and pipes; written last, because they cannot be undone
    FileSet files_;
    std::vector<std::string> written_;
    std::vector<std::string> kept_;
};

/// Writes the whole file or nothing; writes directly to anything that is not a regular file, such as /dev/stdout or a
/// pipe, and waits for its reader. @throws Error Io, Cancelled.
void write_text(const std::string& path, const std::string& text, const RunContext& run);

/// Writes the text to an open stream. @param name  of the stream, for messages @throws Error Io, Cancelled.
void write_stream(int stream, const std::string& text, const std::string& name, const RunContext& run);

}  // namespace covol::tool
