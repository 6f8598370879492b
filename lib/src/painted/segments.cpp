#include "painted/segments.h"

#include <cstdlib>
#include <fstream>

#include "base/file.h"
#include "covol/file_set.h"

namespace covol::painted {

std::map<int, std::string> segment_names(const std::string& path) {
    std::map<int, std::string> names;
    const std::string extension = detail::extension(path);
    if (extension != ".nrrd" && extension != ".nhdr") return names;
    std::map<std::string, std::string> name_of;  // by "Segment3"
    std::map<std::string, int> label_of;
    std::ifstream file = open_regular_file(path);
    std::string line;
    while (std::getline(file, line)) {
        if (!line.empty() && line.back() == '\r') line.pop_back();
        if (line.empty()) break;  // the pixels follow
        const std::size_t value = line.find(":="), field = line.find('_');
        if (!line.starts_with("Segment") || value == std::string::npos || field > value) continue;
        const std::string segment = line.substr(0, field), key = line.substr(field + 1, value - field - 1);
        if (key == "Name") name_of[segment] = line.substr(value + 2);
        if (key == "LabelValue") label_of[segment] = std::atoi(line.c_str() + value + 2);
    }
    for (const auto& [segment, label] : label_of)
        if (const auto name = name_of.find(segment); label > 0 && name != name_of.end() && !name->second.empty())
            names[label] = name->second;
    return names;
}

}  // namespace covol::painted
