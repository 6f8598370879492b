#include "base/file.h"
#include "covol/compare.h"
#include "covol/mesh_io.h"
#include "covol/vdb_io.h"

namespace covol {

Solid read_solid(const std::string& path, int label, const RunContext& run) {
    Solid solid;
    solid.label = label;
    if (detail::extension(split_grid_name(path).path) == ".vdb") {
        solid.level_set = read_vdb_level_set(path, run);
    } else if (is_mesh_name(path)) {
        solid.mesh = read_mesh(path);
    } else {
        solid.mask = read_image(path, {}, run);
    }
    return solid;
}

}  // namespace covol
