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

/// A structure as a report page shows it.
struct PageStructure {
    std::string name;
    std::array<std::uint8_t, 3> color{237, 179, 107};  ///< red, green, blue
    const TriangleMesh* mesh = nullptr;                ///< world units; not null
    std::vector<Vec3> marks;                           ///< world units
    const Evidence* evidence = nullptr;                ///< of that mesh; null: it was not judged
};

/// What a report page tells. What it points to has to outlive the call alone.
struct ReportPage {
    std::string title;
    std::string facts = "{}";  ///< JSON: the report of the run, as the command line writes it
    std::vector<PageStructure> structures;
    const Image* image = nullptr;  ///< null: no slices
    std::string unit;              ///< of lengths; empty: unknown
    /// World axes are anatomical (LPS): the page writes letters at the edges of its views.
    bool is_anatomical = false;
    /// Of a time-lapse: the file names of all frames' pages, which lie in one folder, and which of them this one is.
    std::vector<std::string> frames;
    std::size_t frame = 0;
};

struct ReportPageOptions {
    /// of all structures together; larger meshes are drawn together, cell by cell, vertices stay on the surface
    std::int64_t max_triangles = 400'000;
    /// of the slices; larger images are cut to the structures and their marks, and then thinned
    std::int64_t max_voxels = 16'000'000;
    std::int64_t max_marks = 20'000;  ///< of each structure; of more, every n-th
    int jpeg_quality = 80;            ///< 1 to 100
};

template <>
inline constexpr auto kOptions<ReportPageOptions> =
    std::tuple{Option{"most_triangles", &ReportPageOptions::max_triangles, at_least(100)},
               Option{"most_voxels", &ReportPageOptions::max_voxels, at_least(1000)},
               Option{"most_marks", &ReportPageOptions::max_marks, at_least(1)},
               Option{"jpeg_quality", &ReportPageOptions::jpeg_quality, between(1, 100)}};

/// What a page holds.
struct ReportPageSummary {
    std::int64_t triangles = 0;
    Index3 slices_size{0, 0, 0};  ///< voxels; 0: no slices
    Index3 slices_step{1, 1, 1};  ///< voxels of the image from one to the next
    std::uint64_t bytes = 0;
};

/// Writes a page for a web browser, one file that asks no host for anything: the surfaces in 3D with their marks,
/// three planes of the image with outlines, a table of the structures, and the facts of the run; marks can be set and
/// saved. The same input gives the same bytes.
/// Whole or not at all: to a temporary name beside the target, then renamed.
/// @throws Error InvalidOptions; InvalidInput (no structure, an empty mesh, facts that are no JSON object); Io;
///               Cancelled; what reading the image throws.
COVOL_API ReportPageSummary write_report_page(const std::string& path, const ReportPage& page,
                                              const ReportPageOptions& options = {}, const RunContext& run = {});

}  // namespace covol
