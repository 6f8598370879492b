#pragma once
#include <optional>
#include <string>
#include <vector>

namespace covol::tool {

/// "out.ply", "_ve" -> "out_ve.ply"; endings of two parts (.nii.gz, .seg.nrrd) stay whole.
[[nodiscard]] std::string with_suffix(const std::string& path, const std::string& suffix);
/// "out.nii.gz", ".txt" -> "out.txt"
[[nodiscard]] std::string with_ending(const std::string& path, const std::string& ending);

/// "marks_{frame:03}.csv", 7 -> "marks_007.csv"; {frame} and {frame:03d} are understood too.
/// @throws UsageError when braces hold something else.
[[nodiscard]] std::string with_frame(const std::string& pattern, int frame);
[[nodiscard]] bool has_frame_pattern(const std::string& path);

/// 7, 3 -> "007"
[[nodiscard]] std::string padded(int number, int digits);

/// What the names of a frame's files get: its number where a name has {frame}, else a suffix ("_t003") in front of the
/// ending. Of a single image nothing.
struct NameTag {
    std::string suffix;
    std::optional<int> frame;
    std::vector<NameTag> series = {};  ///< of a time-lapse those of all frames, in order
    /// Of an empty path an empty one.
    [[nodiscard]] std::string operator()(const std::string& path) const;
};

}  // namespace covol::tool
