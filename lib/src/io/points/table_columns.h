#pragma once
#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "covol/points.h"

/// The meaning of the columns of a table, derived from their names.
namespace covol::detail {

/// The columns that hold a point, and those that identify its line.
struct Columns {
    std::array<std::size_t, 3> at{0, 1, 2};
    PointSpace space = PointSpace::Unstated;
    PointOrder order = PointOrder::Unstated;
    bool slice_from_one = false;  ///< the third column counts slices from 1
    std::optional<std::array<std::size_t, 3>> normal;
    bool normal_is_assumed = false;        ///< `normal` is an assumption, because the columns have no names
    std::vector<std::size_t> line;         ///< rows with equal values in these columns form one line
    std::optional<std::size_t> shape;      ///< napari's shape-type
    std::optional<std::size_t> vertex;     ///< position of a mark in its line
    bool closed = true;                    ///< whether lines are closed that have no shape-type
    std::array<std::string, 3> unit{};     ///< of each coordinate, if a header names a unit of length
    std::optional<std::size_t> kind;       ///< kind of each mark: surface, inside or outside
    std::optional<std::size_t> row_unit;   ///< the column that names each row's unit
    std::optional<std::size_t> structure;  ///< the column that names each row's structure
    std::string rule;

    [[nodiscard]] std::size_t count() const {
        std::size_t last = *std::max_element(at.begin(), at.end());
        for (const std::size_t column : line) last = std::max(last, column);
        return std::max({last, shape.value_or(0), vertex.value_or(0), row_unit.value_or(0), structure.value_or(0)}) + 1;
    }
};

/// A column's name and its unit: "X (microns)" is {"x", "microns"}, "x_px" is {"x", "px"}.
struct ColumnName {
    std::string name;
    std::string unit;
};

[[nodiscard]] ColumnName parse_name(std::string_view text);
[[nodiscard]] bool means_voxels(const std::string& unit);

/// Finds the columns that the fields of a header name. Nothing if these are neither x, y and z (or slice) nor napari's
/// axes.
[[nodiscard]] std::optional<Columns> find_columns(const std::vector<std::string_view>& fields);

}  // namespace covol::detail
