#pragma once
#include <string>
#include <utility>
#include <vector>

// 3D Slicer's segmentations, .seg.nrrd: label images whose segments have names. Segments that overlap are in separate
// layers, which are the file's channels.
namespace covol::detail {

struct NrrdSegment {
    std::string id, name;
    int label = 0, layer = 0;
};

/// The segments as stated by SegmentN_ID, _Name, _LabelValue and _Layer in the header. Empty for other files, and for
/// files that cannot be read.
[[nodiscard]] std::vector<NrrdSegment> read_nrrd_segments(const std::string& path);

/// Splits "FILE.seg.nrrd:name" into {"FILE.seg.nrrd", "name"}. The name is empty if the text contains none, or if a
/// file has the whole text as its name.
[[nodiscard]] std::pair<std::string, std::string> split_segment_name(const std::string& text);

}  // namespace covol::detail
