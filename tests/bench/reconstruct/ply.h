// Reads and writes PLY files of points, with or without normals, and triangles.
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
/// Writes binary little-endian PLY with single-precision coordinates.
void write_ply(const std::string& path, const Ply& ply);
