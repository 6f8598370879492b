#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "covol/error.h"
#include "covol/run.h"

namespace covol::detail {

/// How a piece of work ended that was tried in a copy of this process.
struct Trial {
    bool crashed = false;          ///< it ended by a signal, or took too long
    std::optional<Error> refused;  ///< what it threw; the message cut after some 4,000 characters
};

/// Zeros that copies of this process share with it: what they write there stays.
class SharedMemory {
public:
    /// @throws std::bad_alloc
    explicit SharedMemory(std::uint64_t bytes);
    SharedMemory(SharedMemory&& other) noexcept;
    SharedMemory& operator=(SharedMemory&&) = delete;
    ~SharedMemory();

    [[nodiscard]] char* data() const noexcept { return data_; }

private:
    char* data_ = nullptr;
    std::uint64_t bytes_;
};

/// Calls work(0) to work(count - 1) in copies of this process, which are then given up, but for what they wrote into
/// SharedMemory: what a library that crashes on damaged files would do with them. A copy does a few pieces, and as many
/// are at work at once as the caller's arena has threads. Only the calling thread goes on in a copy, so `work` must
/// need no other, nor a lock that one may hold. Where the system gives no copy, and where a piece throws what is no
/// Error, it is done in this process.
/// @param seconds  that one piece may compute; waiting, it may take ten times as long
/// @returns how each ended
/// @throws Error Cancelled, and what is thrown in this process.
std::vector<Trial> try_in_children(std::size_t count, const std::function<void(std::size_t)>& work, double seconds,
                                   const RunContext& run);

/// One piece, by this thread.
Trial try_in_child(const std::function<void()>& work, double seconds);

/// Seconds that a library may compute for a header, or a voxel: far beyond what sound files need.
constexpr double kMostSecondsForHeader = 10;
/// The same for pixels of so many bytes: text and JPEG 2000 take a twentieth of it.
[[nodiscard]] double most_seconds_for_pixels(std::uint64_t bytes);

/// Why `library` cannot read the image `path`; nothing where it can.
std::optional<Error> reading_error(const Trial& trial, const std::string& path, const char* library);

/// Tries whether `library` can read the image `path`. @throws Error InvalidInput where it crashed, or took
/// kMostSecondsForHeader, and what `read` threw.
void try_reading(const std::string& path, const char* library, const std::function<void()>& read);

}  // namespace covol::detail
