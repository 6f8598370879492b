// Writes RT structure sets of DICOM: PS3.3 A.19.
#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "covol/error.h"
#include "covol/slice_contours.h"
#include "files/atomic.h"
#include "files/dicom_class.h"
#include "io/dicom/dicom_source.h"

namespace covol {
namespace {

using detail::DicomItem, detail::DicomSource, detail::SourcePlane, detail::decimal_string;

constexpr std::uint32_t kFrameOfReferenceUid = 0x00200052;

/// Adds the references of a structure set to the frame of reference, and to the series and planes of the contours.
void put_frame_of_reference(DicomItem& file, const DicomSource& from, const std::vector<SourcePlane>& planes) {
    DicomItem frame;
    frame.put(kFrameOfReferenceUid, "UI", from.frame_of_reference);
    if (!from.series.empty() && !planes.empty()) {
        std::vector<DicomItem> images;
        for (const SourcePlane& plane : planes) images.push_back(DicomSource::reference(plane));
        DicomItem series, study;
        series.put(0x0020000E, "UI", from.series);
        series.put_items(0x30060016, images);
        study.put(0x00081150, "UI", "1.2.840.10008.3.1.2.3.1");
        study.put(0x00081155, "UI", from.study);
        study.put_items(0x30060014, {series});
        frame.put_items(0x30060012, {study});
    }
    file.put_items(0x30060010, {frame});
}

DicomItem roi_item(const DicomSource& from, const std::string& number, const ContouredStructure& structure) {
    constexpr std::size_t kLongest = 64;
    DicomItem item;
    item.put(0x30060022, "IS", number);
    item.put(0x30060024, "UI", from.frame_of_reference);
    item.put(0x30060026, "LO", from.name(structure.name, kLongest));
    item.put(0x30060036, "CS", "SEMIAUTOMATIC");
    return item;
}

DicomItem observation_item(const std::string& number) {
    DicomItem item;
    item.put(0x30060082, "IS", number);
    item.put(0x30060084, "IS", number);
    item.put(0x300600A4, "CS", "");
    item.put(0x300600A6, "PN", "");
    return item;
}

/// @param scale  factor that converts the lattice's unit to mm
DicomItem contour_item(const SliceContour& contour, std::size_t number, double scale,
                       const std::optional<SourcePlane>& plane) {
    std::string text;
    for (const Vec3& point : contour.points)
        for (const double x : point) text += (text.empty() ? "" : "\\") + decimal_string(x * scale);
    DicomItem item;
    if (plane) item.put_items(0x30060016, {DicomSource::reference(*plane)});
    item.put(0x30060042, "CS", "CLOSED_PLANAR");
    item.put(0x30060046, "IS", std::to_string(contour.points.size()));
    item.put(0x30060048, "IS", std::to_string(number));
    item.put(0x30060050, "DS", text);
    return item;
}

}  // namespace

void write_rt_structures(const std::string& path, const std::vector<ContouredStructure>& structures,
                         const ImageGeometry& geometry, const std::string& like, const std::optional<int>& frame,
                         const RunContext& run) {
    const ImageGeometry g = detail::in_millimetres(path, geometry, run);
    const double scale = g.spacing[2] / geometry.spacing[2];
    const DicomSource from = detail::read_dicom_source(like, frame, g, run);
    std::map<int, std::optional<SourcePlane>> plane_of;
    std::vector<SourcePlane> planes;
    for (int k = 0; k < g.size[2]; ++k) {
        plane_of[k] = from.plane_of(g, k);
        if (plane_of[k]) planes.push_back(*plane_of[k]);
    }
    std::vector<DicomItem> rois, contoured, observations;
    for (std::size_t n = 0; n < structures.size(); ++n) {
        run.check();
        const ContouredStructure& structure = structures[n];
        const std::string number = std::to_string(n + 1);
        rois.push_back(roi_item(from, number, structure));
        observations.push_back(observation_item(number));
        std::vector<DicomItem> contours;
        for (const SliceContour& contour : structure.contours)
            contours.push_back(contour_item(contour, contours.size() + 1, scale, plane_of[contour.slice]));
        const auto [red, green, blue] = structure.color;
        DicomItem item;
        item.put(0x3006002A, "IS", std::to_string(red) + "\\" + std::to_string(green) + "\\" + std::to_string(blue));
        if (!contours.empty()) item.put_items(0x30060040, contours);
        item.put(0x30060084, "IS", number);
        contoured.push_back(std::move(item));
    }
    DicomItem file = from.instance("RTSTRUCT", "Contours by covol");
    const auto [date, time] = detail::dicom_time();
    file.put(0x00081070, "PN", "");
    file.put(0x30060002, "SH", "covol");
    file.put(0x30060008, "DA", date);
    file.put(0x30060009, "TM", time);
    put_frame_of_reference(file, from, planes);
    file.put_items(0x30060020, rois);
    file.put_items(0x30060039, contoured);
    file.put_items(0x30060080, observations);
    file.put(0x300E0002, "CS", "UNAPPROVED");
    detail::write_atomically(path, [&](const std::string& temporary) {
        detail::write_dicom_instance(temporary, file, false, detail::kRtStructureSet);
    });
}

}  // namespace covol
