// PLY files, binary little-endian: points with or without normals, triangles.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

struct Ply {
    std::vector<std::array<double, 3>> points;
    std::vector<std::array<double, 3>> normals;           ///< empty, or one for each point
    std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices of points
};

/// @throws std::runtime_error  no such file; not PLY, ASCII or binary little-endian; a face is no triangle
Ply read_ply(const std::string& path);
/// Binary, float coordinates.
void write_ply(const std::string& path, const Ply& ply);
