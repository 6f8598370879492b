// Reads RT structure sets of DICOM: PS3.3 A.19.
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "covol/error.h"
#include "files/dicom_class.h"
#include "io/dicom/dicom_elements.h"
#include "io/dicom/dicom_tree.h"
#include "io/points/point_formats.h"
#include "io/points/point_text.h"

namespace covol::detail {
namespace {

using std::string_view;

constexpr std::uint32_t kRois = 0x30060020, kRoiNumber = 0x30060022, kRoiName = 0x30060026;
constexpr std::uint32_t kRoiContours = 0x30060039, kContours = 0x30060040, kContourType = 0x30060042;
constexpr std::uint32_t kPointCount = 0x30060046, kContourData = 0x30060050, kReferencedRoi = 0x30060084;

/// Splits a curve that touches itself at a vertex into its loops. This separates a hole that is joined to its outline
/// by a channel of zero width ("keyhole", PS3.3 C.8.8.6.3). Loops of fewer than three points are omitted.
std::vector<std::vector<Vec3>> loops_of(const std::vector<Vec3>& curve) {
    std::vector<std::vector<Vec3>> loops;
    std::vector<Vec3> walked;
    std::map<Vec3, std::size_t> place;  // index of each point in `walked`
    const auto keep = [&](std::vector<Vec3> loop) {
        if (loop.size() > 2) loops.push_back(std::move(loop));
    };
    for (const Vec3& point : curve) {
        if (const auto met = place.find(point); met != place.end()) {
            const auto begin = walked.begin() + std::ptrdiff_t(met->second);
            keep({begin, walked.end()});
            for (auto at = begin + 1; at != walked.end(); ++at) place.erase(*at);
            walked.erase(begin + 1, walked.end());
            continue;
        }
        place[point] = walked.size();
        walked.push_back(point);
    }
    keep(std::move(walked));
    return loops;
}

class StructureSet {
public:
    StructureSet(const std::string& path, const std::string& bytes)
        : path_(path), file_(parse_dicom(path, bytes, {kRois, kRoiContours, kContours})) {
        if (file_.text(0x00080016) != kRtStructureSet)
            fail(path, "expected contours of an RT structure set (RTSTRUCT), got a DICOM file of modality " +
                           quote(file_.text(0x00080060)));
        const bool is_utf8 = file_.text(0x00080005) == "ISO_IR 192";
        for (const DicomTree& roi : file_.items(kRois)) {
            const string_view name = roi.text(kRoiName);
            names_[std::string(roi.text(kRoiNumber))] = is_utf8 ? std::string(name) : latin_to_utf8(name);
        }
    }

    PointTable read(const std::string& structures_by) {
        PointTable table;
        table.space = PointSpace::World;
        table.order = PointOrder::XYZ;
        table.unit = "mm";
        std::set<std::string> seen;
        for (const DicomTree& roi : file_.items(kRoiContours)) {
            const std::string number(roi.text(kReferencedRoi));
            const auto known = names_.find(number);
            const std::string name = known == names_.end() || known->second.empty() ? "ROI " + number : known->second;
            const std::size_t before = table.points.size();
            for (const DicomTree& contour : roi.items(kContours)) add(table, name, contour);
            if (table.points.size() == before) continue;
            seen.insert(name);
            if (structures_by == "roi") name_structure(table, path_, name);
        }
        if (structures_by.empty() && seen.size() > 1) refuse(seen);
        table.rule = "DICOM RT structure set, " + std::to_string(table.lines.size()) + " contours of " +
                     std::to_string(seen.size()) + (seen.size() == 1 ? " ROI" : " ROIs");
        return table;
    }

private:
    void add(PointTable& table, const std::string& name, const DicomTree& contour) {
        const std::string which = "ROI " + quote(name) + ", contour " + std::to_string(++contours_);
        const std::vector<Vec3> points = points_of(contour, which);
        const string_view type = contour.text(kContourType);
        if (points.empty()) return;
        if (type == "POINT") {
            table.points.insert(table.points.end(), points.begin(), points.end());
        } else if (type == "OPEN_PLANAR" || type == "OPEN_NONPLANAR") {
            add_line(table, points, false, which);
        } else if (type == "CLOSED_PLANAR" || type == "CLOSEDPLANAR_XOR") {
            for (const std::vector<Vec3>& loop : loops_of(points)) add_line(table, loop, true, which);
        } else {
            fail(path_, which +
                            ": expected CLOSED_PLANAR, CLOSEDPLANAR_XOR, OPEN_PLANAR, OPEN_NONPLANAR or POINT, got " +
                            quote(type));
        }
    }

    [[nodiscard]] std::vector<Vec3> points_of(const DicomTree& contour, const std::string& which) const {
        std::vector<string_view> fields;
        const string_view data = contour.text(kContourData);
        if (!data.empty()) split(data, '\\', fields);
        if (fields.size() % 3 != 0)
            fail(path_, which + ": expected three numbers for each point, got " + std::to_string(fields.size()));
        if (const string_view count = contour.text(kPointCount);
            !count.empty() && to_number<std::size_t>(count) != fields.size() / 3)
            fail(path_, which + ": expected " + quote(count) + " points as the file says, got " +
                            std::to_string(fields.size() / 3));
        std::vector<Vec3> points(fields.size() / 3);
        for (std::size_t n = 0; n < fields.size(); ++n) {
            const std::optional<double> value = to_number(trim(fields[n]));
            if (!value || !std::isfinite(*value))
                fail(path_, which + ": expected a finite number, got " + quote(fields[n]));
            points[n / 3][n % 3] = *value;
        }
        return points;
    }

    [[noreturn]] void refuse(const std::set<std::string>& names) const {
        std::string list;
        for (const std::string& name : names) list += (list.empty() ? "" : ", ") + quote(name);
        throw Error(Errc::InvalidInput,
                    path_ + ": expected contours of one structure, got those of " + list +
                        "; `structure_column = roi` makes a structure of each",
                    "structure_column");
    }

    const std::string& path_;
    const DicomTree file_;
    std::map<std::string, std::string> names_;
    std::size_t contours_ = 0;
};

}  // namespace

PointTable parse_rt_structures(const std::string& path, const std::string& bytes, const std::string& structures_by) {
    return StructureSet(path, bytes).read(structures_by);
}

}  // namespace covol::detail
