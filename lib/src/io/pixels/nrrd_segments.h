#pragma once
#include <string>
#include <utility>
#include <vector>

// 3D Slicer's segmentations, .seg.nrrd: label images whose segments have names. Segments that overlap lie in layers,
// which are the file's channels.
namespace covol::detail {

struct NrrdSegment {
    std::string id, name;
    int label = 0, layer = 0;
};

/// SegmentN_ID, _Name, _LabelValue and _Layer of the header. Empty for other files, and for those that cannot be read.
[[nodiscard]] std::vector<NrrdSegment> read_nrrd_segments(const std::string& path);

/// "FILE.seg.nrrd:name" is {"FILE.seg.nrrd", "name"}; no name where none is given, or where a file has the whole text
/// as its name.
[[nodiscard]] std::pair<std::string, std::string> split_segment_name(const std::string& text);

}  // namespace covol::detail
