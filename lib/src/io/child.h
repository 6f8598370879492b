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

// Files that may crash the library that reads them are read in a separate program, which is started with posix_spawn()
// and returns its results in shared memory. A fork of this process is not used for this: if another thread holds a lock
// at the time of the fork, nothing releases this lock in the fork.
namespace covol::detail {

/// Memory, initially zero, that this process shares with a program that it starts. Its size is sealed, so neither
/// process can shrink it.
class SharedMemory {
public:
    /// @throws std::bad_alloc
    explicit SharedMemory(std::uint64_t bytes);
    /// Selects the constructor that maps memory which another process has made. The constructor takes ownership of the
    /// file descriptor. @throws std::bad_alloc
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

/// A file that the started program reads, and the place of the result in the shared memory.
struct Piece {
    std::string path;
    std::string detail = {};  ///< further input; its meaning depends on the task
    std::uint64_t begin = 0;  ///< position of the result in bytes, in the memory for results
    std::uint64_t bytes = 0;  ///< size of the result in bytes
};

/// Size of the answer in bytes that the program returns for each piece besides the result.
inline constexpr std::size_t kAnswerBytes = 4096;

/// The outcome for one piece.
struct PieceOutcome {
    /// The program ended while it read this piece, or was killed because it took too long.
    bool crashed = false;
    std::optional<Error> refused;  ///< the error that was thrown; its message is cut after about 4,000 characters
    std::vector<char> answer;      ///< kAnswerBytes bytes; empty if the piece crashed or was refused
};

/// Runs `program` for the pieces (files to read), and starts it again for the remaining ones after a piece has crashed
/// it. Each process works on a batch of pieces; as many processes run at once as the caller's arena has threads. A
/// process inherits no environment variable but LD_LIBRARY_PATH and no file descriptors of the caller, and ignores
/// SIGINT, SIGTERM and SIGHUP; it is killed when the calling thread ends.
/// @param task     what the program does with each piece; run_pieces() passes this number on without interpreting it
/// @param results  memory for the pieces' results
/// @param seconds  maximum CPU time for one piece; the elapsed time may be ten times as long
/// @returns the outcome for each piece
/// @throws Error Cancelled, Io (the program cannot be started); std::bad_alloc in this process or the program.
std::vector<PieceOutcome> run_pieces(const std::string& program, std::uint32_t task, const std::vector<Piece>& pieces,
                                     const SharedMemory& results, double seconds, const RunContext& run);

/// A piece in the started program: `result` and `answer` are its parts of the shared memory.
struct PieceAtWork {
    std::uint32_t task;
    const std::string &path, &detail;
    std::span<char> result, answer;
};

/// The main function of a program that run_pieces() starts: processes the pieces from the index arguments[1] to before
/// arguments[2]. @returns 2 if run_pieces() did not start it; otherwise it does not return.
int serve_pieces(int count, char** arguments, const std::function<void(const PieceAtWork&)>& work);

/// Maximum CPU time in seconds for reading a header or a single voxel: far more than valid files need.
constexpr double kMaxSecondsForHeader = 10;
/// Maximum CPU time in seconds for reading this many bytes of pixels. Even slow formats (text, JPEG 2000) need only a
/// twentieth of this time.
[[nodiscard]] double max_seconds_for_pixels(std::uint64_t bytes);

/// The reason why `library` cannot read the image `path`; empty if `trial`, the attempt to read it, succeeded.
std::optional<Error> reading_error(const PieceOutcome& trial, const std::string& path, const char* library);

}  // namespace covol::detail
