#pragma once
#include <memory>
#include <optional>
#include <string>

#include "cli/output/json.h"
#include "covol/mesh.h"
#include "covol/study.h"

namespace covol::tool {

/// Surfaces of a study that are stored in its folder. When the study is opened again, they are displayed until new
/// surfaces have been computed.
class KeptSurfaces {
public:
    /// @param of  text that identifies the image and the version of the program: a stored surface is used only if
    /// neither has changed
    KeptSurfaces(const std::string& folder, std::string of);

    struct Kept {
        /// Fields of the message `result` that pages get: triangles, volume, area, extent, mean, sd, expected,
        /// warnings, seconds.
        Json figures;
        std::shared_ptr<const TriangleMesh> mesh;
    };
    /// The stored surface for exactly this structure and options, or nullopt. Its file may be from an untrusted source.
    [[nodiscard]] std::optional<Kept> find(const StudyStructure& structure, const StudyOptions& options) const;
    /// Stores a surface. If the folder is not writable, nothing is stored, and the surface is recomputed next time.
    void keep(const StudyStructure& structure, const StudyOptions& options, const Json& result,
              const TriangleMesh& mesh) const;

private:
    [[nodiscard]] std::string path_of(StudyId structure) const;

    std::string folder_, of_;
};

}  // namespace covol::tool
