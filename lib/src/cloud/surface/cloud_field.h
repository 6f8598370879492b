#pragma once
// The surface behind a cloud as a function of place.
#include <memory>

#include "covol/cloud_surface.h"
#include "covol/orientation.h"

namespace covol::cloud {

/// What quadrics and indicator say of the distance to the surface, on any part of a lattice: its value at a voxel does
/// not depend on the part.
class CloudField {
public:
    /// @param h  voxel size of the lattices. Fills all of `report` that the points alone tell.
    CloudField(const CloudOrientation& cloud, double h, CloudReport& report, const RunContext& run);
    ~CloudField();
    CloudField(const CloudField&) = delete;
    CloudField& operator=(const CloudField&) = delete;

    /// The quadrics' distance where they act, what the indicator's level 1/2 says of it elsewhere; not yet a level
    /// set's band. @pre domain.voxel_size is h
    [[nodiscard]] FloatGridPtr on(const Domain& domain, const RunContext& run) const;

    /// Null if there are none.
    [[nodiscard]] const std::shared_ptr<const Creases>& creases() const { return creases_; }

    class Pieces;

private:
    std::unique_ptr<const Pieces> pieces_;
    std::shared_ptr<const Indicator> indicator_;
    std::shared_ptr<const Creases> creases_;
};

/// The indicator's alone.
[[nodiscard]] FloatGridPtr level_set_of(const Indicator& indicator, const Domain& domain, const RunContext& run);

/// Gives the field of a whole cloud the pieces and handles that points rest on.
void settle(FloatGrid& field, const CloudOrientation& cloud, CloudReport& report, const RunContext& run);

/// The settled field over a domain. Its zero level set is the surface; it is no distance, nor are its active voxels a
/// band, for which there is start_from_grid() or extract_surface().
[[nodiscard]] CloudSurface settled_field(const Domain& domain, const CloudOrientation& cloud, const RunContext& run);

}  // namespace covol::cloud
