#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

#include <vector>

#include "covol/error.h"
#include "detail/mesh_decimate.h"

namespace covol::detail {
namespace {

struct Traits : OpenMesh::DefaultTraitsDouble {
    VertexAttributes(OpenMesh::Attributes::Status);
    EdgeAttributes(OpenMesh::Attributes::Status);
    HalfedgeAttributes(OpenMesh::Attributes::PrevHalfedge);
    FaceAttributes(OpenMesh::Attributes::Status | OpenMesh::Attributes::Normal);
};
using HalfEdgeMesh = OpenMesh::TriMesh_ArrayKernelT<Traits>;

HalfEdgeMesh to_half_edges(const TriangleMesh& mesh) {
    HalfEdgeMesh result;
    std::vector<HalfEdgeMesh::VertexHandle> handles;
    handles.reserve(mesh.vertices.size());
    for (const auto& v : mesh.vertices) handles.push_back(result.add_vertex({v[0], v[1], v[2]}));
    for (const auto& t : mesh.triangles)
        if (!result.add_face(handles[t[0]], handles[t[1]], handles[t[2]]).is_valid())
            throw Error(Errc::InvalidInput, "decimate: expected a manifold mesh; repair it first");
    return result;
}

TriangleMesh from_half_edges(const HalfEdgeMesh& mesh) {
    TriangleMesh result;
    result.vertices.reserve(mesh.n_vertices());
    for (const auto v : mesh.vertices()) {
        const auto& p = mesh.point(v);
        result.vertices.push_back({float(p[0]), float(p[1]), float(p[2])});
    }
    result.triangles.reserve(mesh.n_faces());
    for (const auto f : mesh.faces()) {
        std::array<std::uint32_t, 3> t{};
        int n = 0;
        for (auto v = mesh.cfv_iter(f); v.is_valid() && n < 3; ++v) t[n++] = std::uint32_t(v->idx());
        result.triangles.push_back(t);
    }
    return result;
}

}  // namespace

void decimate(TriangleMesh& mesh, std::size_t triangles) {
    if (triangles >= mesh.triangles.size()) return;
    HalfEdgeMesh work = to_half_edges(mesh);
    work.update_normals();
    OpenMesh::Decimater::DecimaterT<HalfEdgeMesh> decimater(work);
    OpenMesh::Decimater::ModQuadricT<HalfEdgeMesh>::Handle quadric;
    OpenMesh::Decimater::ModNormalFlippingT<HalfEdgeMesh>::Handle flipping;
    decimater.add(quadric);
    decimater.add(flipping);
    decimater.module(quadric).unset_max_err();
    decimater.initialize();
    decimater.decimate_to_faces(0, triangles);
    work.garbage_collection();
    mesh = from_half_edges(work);
}

}  // namespace covol::detail
