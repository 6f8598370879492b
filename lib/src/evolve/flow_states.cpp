#include "evolve/flow_states.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "covol/file_set.h"
#include "covol/vdb_io.h"

namespace covol::detail {
namespace {

constexpr const char *kGrids = ".vdb", *kNumbers = ".state";

FloatGridPtr named(const FloatGrid& grid, const char* name) {
    // The copy shares its tree with `grid`, but it is only written to a file and never modified.
    FloatGridPtr copy = std::const_pointer_cast<FloatGrid>(grid.copy());
    copy->setName(name);
    return copy;
}

}  // namespace

bool FlowStates::any() const {
    std::error_code status;
    return all_ != nullptr && std::filesystem::is_regular_file(all_->file(number_, kNumbers), status);
}

FlowStates::Grids FlowStates::read_grids() const {
    const std::string path = all_->file(number_, kGrids);
    const std::vector<VdbGridInfo> all = list_vdb(path);
    const bool has_edge = std::any_of(all.begin(), all.end(), [](const VdbGridInfo& g) { return g.name == "edge"; });
    return {read_vdb(path, "u"), has_edge ? read_vdb(path, "edge") : nullptr};
}

void FlowStates::read(const Exchange& exchange) const {
    StateFile file(all_->file(number_, kNumbers), StateFile::Mode::Read);
    exchange(file);
    file.finish();
}

void FlowStates::write(const FloatGrid* u, const FloatGrid* edge, const Exchange& exchange) {
    FileSet files;
    if (u != nullptr) {
        std::vector<FloatGridPtr> grids{named(*u, "u")};
        if (edge != nullptr) grids.push_back(named(*edge, "edge"));
        files.write(all_->file(number_, kGrids), [&](const std::string& path) { write_vdb(path, grids); });
    }
    files.write(all_->file(number_, kNumbers), [&](const std::string& path) {
        StateFile file(path, StateFile::Mode::Write);
        exchange(file);
        file.finish();
    });
    files.publish();
    all_->restart_clock();
}

}  // namespace covol::detail
