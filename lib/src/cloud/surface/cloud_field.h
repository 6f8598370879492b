#pragma once
// The surface behind a cloud as a function of position.
#include <memory>

#include "covol/cloud_surface.h"
#include "covol/orientation.h"

namespace covol::cloud {

/// The distance to the surface according to quadrics and indicator, on any part of a lattice. The value at a voxel does
/// not depend on the part.
class CloudField {
public:
    /// @param h  voxel size of the lattices. Sets those fields of `report` that follow from the points alone.
    CloudField(const CloudOrientation& cloud, double h, CloudReport& report, const RunContext& run);
    ~CloudField();
    CloudField(const CloudField&) = delete;
    CloudField& operator=(const CloudField&) = delete;

    /// The distance according to the quadrics where they apply, and elsewhere according to the indicator's level 1/2;
    /// not yet the narrow band of a level set. @pre domain.voxel_size is h
    [[nodiscard]] FloatGridPtr on(const Domain& domain, const RunContext& run) const;

    /// Null if there are none.
    [[nodiscard]] const std::shared_ptr<const Creases>& creases() const { return creases_; }

    class Pieces;

private:
    std::unique_ptr<const Pieces> pieces_;
    std::shared_ptr<const Indicator> indicator_;
    std::shared_ptr<const Creases> creases_;
};

/// The same from the indicator alone.
[[nodiscard]] FloatGridPtr level_set_of(const Indicator& indicator, const Domain& domain, const RunContext& run);

/// Removes and joins pieces of a whole cloud's field and simplifies its topology, as its points suggest.
void settle(FloatGrid& field, const CloudOrientation& cloud, CloudReport& report, const RunContext& run);

/// The settled field over a domain. Its zero level set is the surface, but its values are no distances and its active
/// voxels no narrow band; use start_from_grid() or extract_surface() for these.
[[nodiscard]] CloudSurface settled_field(const Domain& domain, const CloudOrientation& cloud, const RunContext& run);

}  // namespace covol::cloud
