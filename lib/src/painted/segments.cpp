#include "painted/segments.h"

#include "io/pixels/nrrd_segments.h"

namespace covol::painted {

std::map<int, std::string> segment_names(const std::string& path) {
    const auto [file, chosen] = detail::split_segment_name(path);
    if (!chosen.empty()) return {{1, chosen}};  // the segment is read as a mask with the label 1
    std::map<int, std::string> names;
    for (const detail::NrrdSegment& segment : detail::read_nrrd_segments(file))
        if (!segment.name.empty()) names[segment.label] = segment.name;
    return names;
}

}  // namespace covol::painted
