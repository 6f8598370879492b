#pragma once
// The surface that a cloud samples, as a function of position.
#include <memory>

#include "covol/cloud_surface.h"
#include "covol/orientation.h"

namespace covol::cloud {

/// The distance to the surface according to quadrics and indicator, on any part of a lattice. The value at a voxel does
/// not depend on the part.
class CloudField {
public:
    /// @param h  voxel size of the lattices
    /// @param report  out: the fields that do not depend on a domain
    CloudField(const CloudOrientation& cloud, double h, CloudReport& report, const RunContext& run);
    ~CloudField();
    CloudField(const CloudField&) = delete;
    CloudField& operator=(const CloudField&) = delete;

    /// The distance according to the quadrics where they apply, and elsewhere according to the indicator's level 1/2.
    /// The active voxels are whole leaves, not yet a narrow band. @pre domain.voxel_size is h
    [[nodiscard]] FloatGridPtr on(const Domain& domain, const RunContext& run) const;

    /// The creases; null if there are none.
    [[nodiscard]] const std::shared_ptr<const Creases>& creases() const { return creases_; }

    class Pieces;

private:
    std::unique_ptr<const Pieces> pieces_;
    std::shared_ptr<const Indicator> indicator_;
    std::shared_ptr<const Creases> creases_;
};

/// Like CloudField::on(), from an indicator without quadrics.
[[nodiscard]] FloatGridPtr level_set_of(const Indicator& indicator, const Domain& domain, const RunContext& run);

/// Removes pieces with few points, joins pieces that were torn off, and gives the field of a whole cloud the topology
/// of the indicator's surface if this has fewer pieces and handles.
void settle(FloatGrid& field, const CloudOrientation& cloud, CloudReport& report, const RunContext& run);

/// The field over a domain after settle(). Its zero level set is the surface, but its values are not distances and its
/// active voxels not a narrow band; start_from_grid() and extract_surface() compute these.
[[nodiscard]] CloudSurface settled_field(const Domain& domain, const CloudOrientation& cloud, const RunContext& run);

}  // namespace covol::cloud
