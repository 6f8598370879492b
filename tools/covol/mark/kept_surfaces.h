#pragma once
#include <memory>
#include <optional>
#include <string>

#include "cli/json.h"
#include "covol/mesh.h"
#include "covol/study.h"

namespace covol::tool {

/// Surfaces of a study, kept in its folder: when it is opened again they are there at once, until they are found anew.
class KeptSurfaces {
public:
    /// @param of  what they were made from beside the structures: the image, and the program
    KeptSurfaces(const std::string& folder, std::string of);

    struct Kept {
        Json
            figures;  ///< of a message `result`: triangles, volume, area, extent, mean, sd, expected, warnings, seconds
        std::shared_ptr<const TriangleMesh> mesh;
    };
    /// None where nothing is kept that was made from exactly this. The file may come from anywhere.
    [[nodiscard]] std::optional<Kept> find(const StudyStructure& structure, const StudyOptions& options) const;
    /// A folder that cannot be written keeps nothing: the surface is found anew then.
    void keep(const StudyStructure& structure, const StudyOptions& options, const Json& result,
              const TriangleMesh& mesh) const;

private:
    [[nodiscard]] std::string path_of(StudyId structure) const;

    std::string folder_, of_;
};

}  // namespace covol::tool
