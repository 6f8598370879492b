#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/evidence.h"
#include "covol/image.h"
#include "covol/mesh.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

/// A structure on a report page.
struct PageStructure {
    std::string name;
    std::array<std::uint8_t, 3> color{237, 179, 107};  ///< red, green, blue
    const TriangleMesh* mesh = nullptr;                ///< world units; not null
    std::vector<Vec3> marks;                           ///< world units
    const Evidence* evidence = nullptr;                ///< evidence of that mesh; null: not assessed
};

/// The content of a report page. The objects pointed to only have to outlive the call.
struct ReportPage {
    std::string title;
    std::string facts = "{}";  ///< JSON: the report of the run, as the command line writes it
    std::vector<PageStructure> structures;
    const Image* image = nullptr;  ///< null: no slices
    std::string unit;              ///< of lengths; empty: unknown
    /// World axes are anatomical (LPS): the page labels the edges of its views with letters.
    bool is_anatomical = false;
    /// For a time-lapse: the file names of the pages of all frames, which are in one folder, and the index of this
    /// page.
    std::vector<std::string> frames;
    std::size_t frame = 0;
};

struct ReportPageOptions {
    /// maximum for all structures together; larger meshes are simplified by vertex clustering, with vertices on the
    /// surface
    std::int64_t max_triangles = 400'000;
    /// maximum for the slices; larger images are cropped to the structures and their marks, and then subsampled
    std::int64_t max_voxels = 16'000'000;
    std::int64_t max_marks = 20'000;  ///< maximum for each structure; of more marks, every n-th is shown
    int jpeg_quality = 80;            ///< 1 to 100
};

template <>
inline constexpr auto kOptions<ReportPageOptions> =
    std::tuple{Option{"most_triangles", &ReportPageOptions::max_triangles, at_least(100)},
               Option{"most_voxels", &ReportPageOptions::max_voxels, at_least(1000)},
               Option{"most_marks", &ReportPageOptions::max_marks, at_least(1)},
               Option{"jpeg_quality", &ReportPageOptions::jpeg_quality, between(1, 100)}};

/// Statistics of a page.
struct ReportPageSummary {
    std::int64_t triangles = 0;
    Index3 slices_size{0, 0, 0};  ///< voxels; 0: no slices
    Index3 slices_step{1, 1, 1};  ///< voxels of the image from one voxel of the slices to the next
    std::uint64_t bytes = 0;
};

/// Writes a page for a web browser, a single file that makes no network requests: the surfaces in 3D with their marks,
/// three planes of the image with outlines, a table of the structures, and the facts of the run; marks can be set and
/// saved. The same input gives the same bytes. The file is written completely or not at all: under a temporary name in
/// the same folder, then renamed.
/// @throws Error InvalidOptions; InvalidInput (no structure, an empty mesh, facts that are not a JSON object); Io;
///     Cancelled; whatever reading the image throws.
COVOL_API ReportPageSummary write_report_page(const std::string& path, const ReportPage& page,
                                              const ReportPageOptions& options = {}, const RunContext& run = {});

}  // namespace covol
