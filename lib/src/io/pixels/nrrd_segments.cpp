#include "io/pixels/nrrd_segments.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>

#include "base/file.h"
#include "covol/file_set.h"

namespace covol::detail {

std::vector<NrrdSegment> read_nrrd_segments(const std::string& path) {
    constexpr std::size_t kMaxLines = 100000;
    const std::string end = extension(path);
    std::error_code status;
    if ((end != ".nrrd" && end != ".nhdr") || !std::filesystem::is_regular_file(path, status)) return {};
    std::map<std::string, NrrdSegment> found;  // segments by the prefix of their keys, such as "Segment3"
    std::vector<std::string> order;
    std::ifstream file = open_regular_file(path);
    std::string line;
    for (std::size_t n = 0; n < kMaxLines && std::getline(file, line); ++n) {
        if (!line.empty() && line.back() == '\r') line.pop_back();
        if (line.empty()) break;  // an empty line ends the header
        const std::size_t value = line.find(":="), field = line.find('_');
        if (!line.starts_with("Segment") || value == std::string::npos || field > value) continue;
        const std::string name = line.substr(0, field), key = line.substr(field + 1, value - field - 1),
                          text = line.substr(value + 2);
        const auto [place, is_new] = found.try_emplace(name);
        if (is_new) order.push_back(name);
        NrrdSegment& segment = place->second;
        if (key == "ID") segment.id = text;
        if (key == "Name") segment.name = text;
        if (key == "LabelValue") segment.label = std::atoi(text.c_str());
        if (key == "Layer") segment.layer = std::atoi(text.c_str());
    }
    std::vector<NrrdSegment> segments;
    for (const std::string& name : order)
        if (const NrrdSegment& segment = found[name]; segment.label > 0 && segment.layer >= 0)
            segments.push_back(segment);
    return segments;
}

std::pair<std::string, std::string> split_segment_name(const std::string& text) {
    std::error_code status;
    for (const char* ending : {".nrrd:", ".nhdr:"}) {
        const std::size_t colon = text.find(ending);
        if (colon == std::string::npos || std::filesystem::exists(text, status)) continue;
        return {text.substr(0, colon + 5), text.substr(colon + 6)};
    }
    return {text, ""};
}

}  // namespace covol::detail
