#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "covol/error.h"
#include "covol/run.h"

// Files that may crash the library that reads them are read by another program, which is started for it (posix_spawn)
// and answers in shared memory. It is no copy of this process: one of a process with threads may wait for ever for a
// lock that another thread held.
namespace covol::detail {

/// Zeros that this process and a program that it starts share. Their number is sealed: neither can take them away.
class SharedMemory {
public:
    /// @throws std::bad_alloc
    explicit SharedMemory(std::uint64_t bytes);
    /// What another process made, by its descriptor, which is taken over. @throws std::bad_alloc
    struct Given {
        int descriptor;
    };
    explicit SharedMemory(Given given);
    SharedMemory(SharedMemory&& other) noexcept;
    SharedMemory& operator=(SharedMemory&&) = delete;
    ~SharedMemory();

    [[nodiscard]] char* data() const noexcept { return data_; }
    [[nodiscard]] std::uint64_t size() const noexcept { return bytes_; }
    [[nodiscard]] int descriptor() const noexcept { return descriptor_; }

private:
    SharedMemory(int descriptor, std::uint64_t bytes);
    [[nodiscard]] char* mapped() const;

    int descriptor_;
    std::uint64_t bytes_;
    char* data_;
};

/// A file that the reading program is given.
struct Piece {
    std::string path;
    std::string detail = {};  ///< what else the task needs
    std::uint64_t begin = 0;  ///< where its result goes in the memory for results
    std::uint64_t bytes = 0;  ///< of the result
};

/// Bytes of an answer that comes beside the result.
inline constexpr std::size_t kAnswerBytes = 4096;

/// How a piece ended.
struct Trial {
    bool crashed = false;          ///< the program ended by a signal, or took too long
    std::optional<Error> refused;  ///< what it threw; the message cut after some 4,000 characters
    std::vector<char> answer;      ///< kAnswerBytes where it did neither
};

/// Starts `program` for the pieces, and again behind one that crashes it. One call of it does some of them, and as many
/// are at work at once as the caller's arena has threads. It gets no environment but LD_LIBRARY_PATH, no descriptor but
/// its own, and no stop signal of the terminal's; it ends when the calling thread does.
/// @param task     what to do with each; means nothing here
/// @param results  where the pieces' results go
/// @param seconds  that one piece may compute; waiting, it may take ten times as long
/// @returns how each ended
/// @throws Error Cancelled, Io (the program cannot be started); std::bad_alloc here or there.
std::vector<Trial> try_pieces(const std::string& program, std::uint32_t task, const std::vector<Piece>& pieces,
                              const SharedMemory& results, double seconds, const RunContext& run);

/// A piece, in the program.
struct PieceAtWork {
    std::uint32_t task;
    const std::string &path, &detail;
    std::span<char> result, answer;
};

/// The main function of such a program: does the pieces that its arguments name. @returns 2 where try_pieces() did not
/// start it; else it does not return.
int serve_pieces(int count, char** arguments, const std::function<void(const PieceAtWork&)>& work);

/// Seconds that a library may compute for a header, or a voxel: far beyond what sound files need.
constexpr double kMaxSecondsForHeader = 10;
/// The same for pixels of so many bytes: text and JPEG 2000 take a twentieth of it.
[[nodiscard]] double max_seconds_for_pixels(std::uint64_t bytes);

/// Why `library` cannot read the image `path`; nothing where it can.
std::optional<Error> reading_error(const Trial& trial, const std::string& path, const char* library);

}  // namespace covol::detail
