#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "covol/domain.h"
#include "covol/pipeline.h"

namespace covol::tool {

/// The command line is invalid: exit code 2.
struct UsageError : std::runtime_error {
    explicit UsageError(const std::string& message, std::string option_ = {})
        : std::runtime_error(message), option(std::move(option_)) {}
    std::string option;  ///< name of the invalid option, as on the command line; may be empty
};

/// A length as given by the user, in world units or in voxels ("3vx"); voxels are converted once their size is known.
struct Length {
    double value = 0;
    bool in_voxels = false;
    bool given = false;

    /// The length in world units; `fallback` if the option was not given.
    [[nodiscard]] double resolve(double voxel_size, double fallback) const {
        if (!given) return fallback;
        return in_voxels ? value * voxel_size : value;
    }
    /// The length in world units; nullopt if the option was not given.
    [[nodiscard]] std::optional<double> resolve(double voxel_size) const {
        return given ? std::optional(resolve(voxel_size, 0)) : std::nullopt;
    }
};

// Parsers of option values. `flag` is the name of the option, for error messages.
// @throws UsageError for text that is not a number, Error InvalidOptions for numbers out of range.
[[nodiscard]] Length parse_length(const std::string& flag, const std::string& text);
[[nodiscard]] double parse_number(const std::string& flag, const std::string& text);
[[nodiscard]] Vec3 parse_vec3(const std::string& flag, const std::string& text);
[[nodiscard]] WorldBox parse_box(const std::string& flag, const std::string& text);
/// Value of `--init`: auto, guess, cloud, tag, sphere:x,y,z,r, box:x0,y0,z0,x1,y1,z1, mesh:FILE, mask:FILE or vdb:FILE.
/// `path` is the file that the start is read from, or empty.
struct StartChoice {
    Start start;
    std::string path;
};
[[nodiscard]] StartChoice parse_start(const std::string& flag, const std::string& text);
/// Value of `--frame`: one time point, a range of time points, or all.
struct FrameChoice {
    bool given = false, all = false;
    int first = 0, last = 0;
    [[nodiscard]] bool is_one() const { return given && !all && first == last; }
};
/// Parses "all", "3" or "0-9".
[[nodiscard]] FrameChoice parse_frames(const std::string& flag, const std::string& text);

/// "name=value"; the name is empty if there is no '=', or if a file with the whole text as its name exists.
struct Named {
    std::string name, value;
};
[[nodiscard]] Named split_name(const std::string& text);

/// Parses a number of bytes, with or without a suffix k, M, G or T for a power of 1024: "8G", "512M", "100k", "4096".
[[nodiscard]] std::uint64_t parse_bytes(const std::string& flag, const std::string& text);
/// Parses a width and a height: "1200x800".
[[nodiscard]] std::array<int, 2> parse_size(const std::string& flag, const std::string& text);

}  // namespace covol::tool
