#include "cloud/indicator/patches.h"

namespace covol::cloud {

std::vector<std::vector<std::uint32_t>> neighbours_of(const PointCells& cells) {
    std::vector<std::uint32_t> cell_of(cells.sorted().size());
    for (std::uint32_t cell = 0; cell < cells.cell_count(); ++cell)
        for (std::uint32_t at = cells.cell(cell).begin; at < cells.cell(cell).end; ++at) cell_of[at] = cell;
    std::vector<std::vector<std::uint32_t>> beside(cells.cell_count());
    std::vector<PointCells::Range> ranges;
    for (std::uint32_t cell = 0; cell < cells.cell_count(); ++cell) {
        cells.find(cells.sorted()[cells.cell(cell).begin], cells.edge(), ranges);
        for (const PointCells::Range& range : ranges)
            for (std::uint32_t at = range.begin; at < range.end; at = cells.cell(cell_of[at]).end)
                if (cell_of[at] != cell) beside[cell].push_back(cell_of[at]);
    }
    return beside;
}

std::vector<int> patches_of(const std::vector<std::vector<std::uint32_t>>& beside, const std::vector<int>& side) {
    std::vector<int> patch(side.size(), -1);
    int count = 0;
    std::vector<std::uint32_t> front;
    for (std::uint32_t first = 0; first < patch.size(); ++first) {
        if (patch[first] >= 0 || side[first] == 0) continue;
        patch[first] = count;
        front.push_back(first);
        while (!front.empty()) {
            const std::uint32_t cell = front.back();
            front.pop_back();
            for (const std::uint32_t next : beside[cell])
                if (patch[next] < 0 && side[next] == side[first]) {
                    patch[next] = count;
                    front.push_back(next);
                }
        }
        ++count;
    }
    return patch;
}

}  // namespace covol::cloud
