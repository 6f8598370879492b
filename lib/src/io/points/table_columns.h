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

/// The indices of the columns that hold a point, its line and its other properties.
struct Columns {
    std::array<std::size_t, 3> at{0, 1, 2};
    PointSpace space = PointSpace::Unstated;
    PointOrder order = PointOrder::Unstated;
    bool slice_from_one = false;  ///< the third column counts slices from 1
    std::optional<std::array<std::size_t, 3>> normal;
    bool normal_is_assumed = false;        ///< `normal` is an assumption, because the columns have no names
    std::vector<std::size_t> line;         ///< rows with equal values in these columns form one line
    std::optional<std::size_t> shape;      ///< the column shape-type that napari writes
    std::optional<std::size_t> vertex;     ///< the column with the position of a mark in its line
    bool closed = true;                    ///< whether lines are closed that have no shape-type
    std::array<std::string, 3> unit{};     ///< unit of each coordinate; empty if the header names no unit of length
    std::optional<std::size_t> kind;       ///< the column with the kind of each mark: surface, inside or outside
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

/// Finds the columns that the fields of a header name. The result is empty if the names include neither x, y and z (or
/// slice) nor napari's axes.
[[nodiscard]] std::optional<Columns> find_columns(const std::vector<std::string_view>& fields);

}  // namespace covol::detail
