#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "base/text.h"
#include "io/points/point_formats.h"
#include "io/points/point_text.h"
#include "io/xml.h"

// Layout: WriteXML.java of Fiji's plugin Cell Counter. MarkerX and MarkerY are pixels, counted from 0. MarkerZ is the
// number of the plane in the stack, counted from 1; in a hyperstack, the channels of a slice are separate planes.
namespace covol::detail {
namespace {

constexpr const char* kRoot = "CellCounter_Marker_File";

/// The markers of a file, one tag after another.
class CellMarkers {
public:
    CellMarkers(const std::string& path, const std::string& structures_by)
        : path_(path), by_type_(structures_by == "type") {}

    void read(const std::string& text) {
        XmlTags tags(text);
        XmlTag tag;
        if (!tags.next(tag) || tag.name != kRoot)
            fail(path_, std::string("expected a file of Fiji's Cell Counter, which begins with ") + kRoot + ", got " +
                            quote(tag.name));
        bool is_complete = false;
        while (!is_complete && tags.next(tag)) {
            is_complete = tag.closing && tag.name == kRoot;
            if (tag.closing)
                close(tag.name);
            else
                open(tag.name, tags);
        }
        if (!is_complete) fail(path_, "damaged or truncated: " + quote(kRoot) + " has no end");
    }

    [[nodiscard]] PointTable finish() {
        table_.space = PointSpace::Index;
        table_.order = PointOrder::XYZ;
        table_.rule = "Fiji's Cell Counter (" + std::to_string(types_) + (types_ == 1 ? " type" : " types") +
                      "), slices from 1, by pixel centres";
        return std::move(table_);
    }

private:
    void open(const std::string& name, const XmlTags& tags) {
        if (name == "Marker_Type") {
            type_ = {};
            has_markers_ = false;
        } else if (name == "Type") {
            type_ = "type " + std::string(trim(tags.text()));
        } else if (name == "Name") {
            if (const std::string given = tags.text(); !trim(given).empty()) type_ = trim(given);
        } else if (name == "Marker") {
            at_ = {};
        } else if (name == "MarkerX" || name == "MarkerY" || name == "MarkerZ") {
            const std::string text = tags.text();
            const std::optional<double> value = to_number(trim(text));
            if (!value || !std::isfinite(*value))
                fail(path_, who() + ": expected a number as " + name + ", got " + quote(trim(text)));
            at_[std::size_t(name.back() - 'X')] = value;
        }
    }

    void close(const std::string& name) {
        if (name != "Marker") return;
        if (!at_[0] || !at_[1] || !at_[2]) fail(path_, who() + ": expected MarkerX, MarkerY and MarkerZ");
        if (*at_[2] < 1) fail(path_, who() + ": expected a slice from 1, got MarkerZ " + std::to_string(*at_[2]));
        table_.points.push_back({*at_[0], *at_[1], *at_[2] - 1});
        if (by_type_) name_structure(table_, path_, type_);
        if (!std::exchange(has_markers_, true)) ++types_;
        at_ = {};
    }

    [[nodiscard]] std::string who() const { return "marker " + std::to_string(table_.points.size() + 1); }

    const std::string& path_;
    bool by_type_;
    PointTable table_;
    std::string type_;  ///< name of the current type of markers; without a name, for example "type 1"
    std::array<std::optional<double>, 3> at_{};
    bool has_markers_ = false;
    int types_ = 0;  ///< number of types with markers; the plugin also writes types without any
};

}  // namespace

PointTable parse_cell_counter(const std::string& path, const std::string& text, const std::string& structures_by) {
    CellMarkers markers(path, structures_by);
    markers.read(text);
    return markers.finish();
}

}  // namespace covol::detail
