#pragma once
#include <optional>
#include <string>
#include <vector>

namespace covol::tool {

/// "out.ply", "_ve" -> "out_ve.ply"; endings of two parts (.nii.gz, .seg.nrrd) are kept together.
[[nodiscard]] std::string with_suffix(const std::string& path, const std::string& suffix);
/// "out.nii.gz", ".txt" -> "out.txt"
[[nodiscard]] std::string with_ending(const std::string& path, const std::string& ending);

/// "marks_{frame:03}.csv", 7 -> "marks_007.csv"; {frame} and {frame:03d} are accepted, too.
/// @throws UsageError if braces contain anything else.
[[nodiscard]] std::string with_frame(const std::string& pattern, int frame);
[[nodiscard]] bool has_frame_pattern(const std::string& path);

/// 7, 3 -> "007"
[[nodiscard]] std::string padded(int number, int digits);

/// Tags the names of a frame's files: with its number if a name contains {frame}, otherwise with a suffix ("_t003")
/// before the ending. Empty for a single image.
struct NameTag {
    std::string suffix;
    std::optional<int> frame;
    std::vector<NameTag> series = {};  ///< the tags of all frames of a time-lapse, in order
    /// An empty path stays empty.
    [[nodiscard]] std::string operator()(const std::string& path) const;
};

}  // namespace covol::tool
