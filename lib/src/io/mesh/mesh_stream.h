#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "covol/mesh_io.h"

// Writes meshes that are produced in pieces: vertices in the order of their indices, triangles in any order.
namespace covol::mesh_io {

class MeshStream {
public:
    /// @param path  the file to write, which has a temporary name
    /// @param name  of the final file, whose extension determines the format: .ply, .stl or .obj
    /// @param origin  of the mesh; vertices are relative to it
    /// @throws Error Io, Unsupported (more than the format can hold).
    static std::unique_ptr<MeshStream> open(const std::string& path, const std::string& name, std::uint64_t vertices,
                                            std::uint64_t triangles, const Vec3& origin,
                                            const std::vector<std::string>& comments);
    MeshStream() = default;
    MeshStream(const MeshStream&) = delete;
    MeshStream& operator=(const MeshStream&) = delete;
    virtual ~MeshStream() = default;

    virtual void vertex(const std::array<float, 3>& position, const std::array<float, 3>& normal) = 0;
    virtual void triangle(const std::array<std::uint32_t, 3>& vertices,
                          const std::array<std::array<float, 3>, 3>& corners) = 0;
    virtual void finish() = 0;
};

}  // namespace covol::mesh_io
