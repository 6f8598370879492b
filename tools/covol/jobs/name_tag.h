#pragma once
#include <optional>
#include <string>
#include <vector>

namespace covol::tool {

/// Inserts a suffix before the ending: "out.ply", "_ve" -> "out_ve.ply". Endings of two parts (.nii.gz) are not split.
[[nodiscard]] std::string with_suffix(const std::string& path, const std::string& suffix);
/// Replaces the ending: "out.nii.gz", ".txt" -> "out.txt".
[[nodiscard]] std::string with_ending(const std::string& path, const std::string& ending);

/// Inserts the number of a frame: "marks_{frame:03}.csv", 7 -> "marks_007.csv"; also {frame} and {frame:03d}.
/// @throws UsageError for any other text in braces that begins with "frame".
[[nodiscard]] std::string with_frame(const std::string& pattern, int frame);
[[nodiscard]] bool has_frame_pattern(const std::string& path);

/// The number with leading zeros: 7, 3 -> "007".
[[nodiscard]] std::string padded(int number, int digits);

/// Names the output files of a frame: {frame} in a name is replaced by the number of the frame; otherwise a suffix
/// ("_t003") is inserted before the ending. Names for a single image stay unchanged.
struct NameTag {
    std::string suffix;
    std::optional<int> frame;
    std::vector<NameTag> series = {};  ///< the tags of all frames of a time-lapse, in order
    /// An empty path stays empty.
    [[nodiscard]] std::string operator()(const std::string& path) const;
};

}  // namespace covol::tool
