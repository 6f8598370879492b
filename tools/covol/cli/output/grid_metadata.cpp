#include "cli/output/grid_metadata.h"

#include <openvdb/openvdb.h>

namespace covol::tool {

std::map<std::string, std::string> text_metadata(const FloatGrid& grid) {
    std::map<std::string, std::string> texts;
    for (auto entry = grid.beginMeta(); entry != grid.endMeta(); ++entry) texts[entry->first] = entry->second->str();
    return texts;
}

}  // namespace covol::tool
