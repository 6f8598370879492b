#include "covol/image_stream.h"

namespace covol {

PixelSource::~PixelSource() = default;
std::optional<double> PixelSource::uniform(const VoxelBox&) const { return std::nullopt; }
std::optional<std::array<double, 2>> PixelSource::range() const { return std::nullopt; }
void PixelSource::wrote(const VoxelBox&, const void*, double) const {}
std::vector<std::pair<std::string, std::string>> PixelSource::metadata() const { return {}; }
std::vector<NamedLabel> PixelSource::label_names() const { return {}; }

}  // namespace covol
