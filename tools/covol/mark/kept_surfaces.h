#pragma once
#include <memory>
#include <optional>
#include <string>

#include "cli/output/json.h"
#include "covol/mesh.h"
#include "covol/study.h"

namespace covol::tool {

/// Surfaces of a study that are stored in its folder: when the study is opened again they are shown until they have
/// been recomputed.
class KeptSurfaces {
public:
    /// @param of  identifies what else they were computed from: the image, and the program
    KeptSurfaces(const std::string& folder, std::string of);

    struct Kept {
        Json
            figures;  ///< of a message `result`: triangles, volume, area, extent, mean, sd, expected, warnings, seconds
        std::shared_ptr<const TriangleMesh> mesh;
    };
    /// nullopt if no surface of exactly this input is stored. The file may come from an untrusted source.
    [[nodiscard]] std::optional<Kept> find(const StudyStructure& structure, const StudyOptions& options) const;
    /// If the folder is not writable nothing is stored, and the surface is recomputed later.
    void keep(const StudyStructure& structure, const StudyOptions& options, const Json& result,
              const TriangleMesh& mesh) const;

private:
    [[nodiscard]] std::string path_of(StudyId structure) const;

    std::string folder_, of_;
};

}  // namespace covol::tool
