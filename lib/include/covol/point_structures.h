#pragma once
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/mark_kinds.h"

namespace covol {

/// The marks of one structure, from a file with marks of several structures.
struct StructurePoints {
    std::string name;
    KindedPoints points;
};

/// Reads a file as read_points() does and groups its marks by the names of structures, in the order in which the names
/// first occur in the file.
/// @param by  the field that contains the names: the column of a table, "group" or "counter" of Fiji's selections,
///     "type" of its Cell Counter, "label" or "node" of 3D Slicer's markups, "label" of .csl, "roi" of DICOM RT
///     structure sets
/// @throws Error as read_points(); InvalidInput if the file has no such names, a mark without a name, or more than 254
/// names.
[[nodiscard]] COVOL_API std::vector<StructurePoints> read_structures_of_points(const std::string& path,
                                                                               const std::string& by,
                                                                               const ReadPointsOptions& options = {});

}  // namespace covol
