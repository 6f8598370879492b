#pragma once
#include <string>

#include "io/points/point_files.h"

/// One reader for each family of point files. Each parses the whole contents of a file; `path` is used in messages.
/// @throws Error InvalidInput, Unsupported.
namespace covol::detail {

/// XYZ, CSV, TSV: one point per line, columns by name if there is a header. Lists of marks written by Fiji, napari or
/// by hand are recognized by their columns.
/// @param blanks_only  columns are separated by runs of blanks and tabs, unless there are commas or semicolons
/// @param structures_by  the column that names each row's structure; empty: structures are ignored
PointTable parse_columns(const std::string& path, const std::string& text, bool blanks_only,
                         const std::string& structures_by = {});

PointTable parse_obj(const std::string& path, const std::string& text);
PointTable parse_off(const std::string& path, const std::string& text);
PointTable parse_ply(const std::string& path, const std::string& bytes);

/// A selection (ROI) of Fiji (ImageJ), or a ZIP archive of several selections as saved by the ROI Manager.
/// @param name  of the selection, if the file has none
/// @param structures_by  "group" of a selection, "counter" of a multi-point's points, or empty
PointTable parse_roi(const std::string& path, const std::string& bytes, const std::string& name,
                     const std::string& structures_by = {});
PointTable parse_roi_zip(const std::string& path, const std::string& bytes, const std::string& structures_by = {});

/// Markers of Fiji's plugin Cell Counter, .xml. @param structures_by  "type" of the markers, or empty
PointTable parse_cell_counter(const std::string& path, const std::string& text, const std::string& structures_by = {});

/// 3D Slicer's .mrk.json and .fcsv, which state the coordinate system.
/// @param structures_by  "label" of each point, "node" (the markup's own name; not for .fcsv), or empty
PointTable parse_markups(const std::string& path, const std::string& text, const std::string& structures_by = {});
PointTable parse_fcsv(const std::string& path, const std::string& text, const std::string& structures_by = {});
/// Landmarks as for c3d -landmarks-to-spheres: lines "x y z label", in RAS; if the label is not a number, it may also
/// precede x.
PointTable parse_landmarks(const std::string& path, const std::string& text);
/// .csl, sections of bodies in planes of any direction. A header "CSLC" and the numbers of planes and labels are
/// followed by each plane: its number, the counts of its vertices and contours, the numbers A B C D of its equation A x
/// + B y + C z + D = 0, the vertices, and for each contour its count of vertices ("12", or "12h0" for a hole in contour
/// 0), its label, and the indices of its vertices from 0.
/// @param structures_by  "label": each label is a structure; empty: a file with several labels is an error
PointTable parse_sections(const std::string& path, const std::string& text, const std::string& structures_by = {});

/// DICOM RT structure sets: contours of ROIs in mm, LPS. A hole that is joined to its outline by a keyhole, a channel
/// of zero width, becomes a separate line.
/// @param structures_by  "roi": each ROI is a structure; empty: a file with several ROIs is an error
PointTable parse_rt_structures(const std::string& path, const std::string& bytes,
                               const std::string& structures_by = {});

/// ITK-SNAP's .annot: landmarks and line segments, in voxels whose corners have integer coordinates.
PointTable parse_annotations(const std::string& path, const std::string& text);

/// Leica's text format of scans (.ptx). Each scan begins with its numbers of columns and rows, the scanner's position
/// and axes, and a matrix; its points follow.
[[nodiscard]] bool is_ptx(const std::string& text);
PointTable parse_ptx(const std::string& path, const std::string& text);

PointTable parse_pcd(const std::string& path, const std::string& bytes);
PointTable parse_las(const std::string& path, const std::string& bytes);

}  // namespace covol::detail
