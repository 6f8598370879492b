#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "base/text.h"
#include "io/points/point_formats.h"
#include "io/points/point_text.h"
#include "io/xml.h"

// The format is defined by WriteXML.java of Fiji's plugin Cell Counter. MarkerX and MarkerY are pixels, counted from 0.
// MarkerZ is the number of the plane in the stack, counted from 1: in a hyperstack, channels vary fastest, then slices,
// then time points. BrainGlobe's cellfinder writes the same tags but counts slices from 0; its files are recognized by
// the name of the image, placeholder.tif.
namespace covol::detail {
namespace {

constexpr const char* kRoot = "CellCounter_Marker_File";

/// The text after a tag, without blanks and line ends around it.
std::string text_after(const XmlTags& tags) {
    std::string text = tags.text();
    std::replace(text.begin(), text.end(), '\n', ' ');
    return std::string(trim(text));
}

/// Reads the markers of a file from its XML tags, one after another.
class CellMarkers {
public:
    CellMarkers(const std::string& path, const std::string& structures_by)
        : path_(path), by_type_(structures_by == "type") {}

    void read(const std::string& text) {
        XmlTags tags(text);
        XmlTag tag;
        const bool has_root = tags.next(tag);
        if (has_root && tag.name == "SpimData")
            fail(path_, "this is the header of a BigDataViewer image, not marks; open the .h5 file of the same name");
        if (!has_root || tag.name != kRoot)
            fail(path_, std::string("expected a file of Fiji's Cell Counter, which begins with ") + kRoot + ", got " +
                            quote(tag.name));
        bool is_complete = false;
        while (!is_complete && tags.next(tag)) {
            if (in_name_ && !(tag.closing && tag.name == "Name")) refuse_name();
            is_complete = tag.closing && tag.name == kRoot;
            if (tag.closing)
                close(tag.name);
            else
                open(tag.name, tags);
            if (tag.empty) close(tag.name);
        }
        // After a syntax error, `tag` is the tag with the error. If that tag directly follows the start tag of a name,
        // the name contains '<'.
        if (in_name_ && !tag.closing && tag.name != "Name") refuse_name();
        if (!is_complete) fail(path_, "damaged or truncated: " + quote(kRoot) + " has no end");
    }

    [[nodiscard]] PointTable finish() {
        table_.space = PointSpace::Index;
        table_.order = PointOrder::XYZ;
        table_.rule = std::string(first_slice_ == 0 ? "Cell Counter's format as written by cellfinder ("
                                                    : "Fiji's Cell Counter (") +
                      std::to_string(types_) + (types_ == 1 ? " type" : " types") + "), slices from " +
                      std::to_string(first_slice_) + ", by pixel centres";
        return std::move(table_);
    }

private:
    void open(const std::string& name, const XmlTags& tags) {
        if (name == "Image_Filename") {
            first_slice_ = text_after(tags) == "placeholder.tif" ? 0 : 1;
        } else if (name == "Marker_Type") {
            type_ = {};
            has_markers_ = false;
        } else if (name == "Type") {
            if (const std::string number = text_after(tags); !number.empty()) type_ = "Type " + number;
        } else if (name == "Name") {
            in_name_ = true;
            if (const std::string given = text_after(tags); !given.empty()) type_ = given;
        } else if (name == "Marker") {
            if (std::exchange(in_marker_, true)) fail(path_, who() + ": expected its end before the next Marker");
            at_ = {};
        } else if (name == "MarkerX" || name == "MarkerY" || name == "MarkerZ") {
            const std::string text = text_after(tags);
            const std::optional<double> value = to_number(text);
            if (!value || !std::isfinite(*value))
                fail(path_, who() + ": expected a number as " + name + ", got " + quote(text));
            at_[std::size_t(name.back() - 'X')] = value;
            if (name == "MarkerZ") slice_ = text;
        }
    }

    void close(const std::string& name) {
        if (name == "Name") in_name_ = false;
        if (name == "Marker_Type") type_ = {};
        if (name != "Marker") return;
        in_marker_ = false;
        if (!at_[0] || !at_[1] || !at_[2]) fail(path_, who() + ": expected MarkerX, MarkerY and MarkerZ");
        if (type_.empty()) fail(path_, who() + ": expected the Type or Name of its Marker_Type before it");
        if (*at_[2] < first_slice_)
            fail(path_,
                 who() + ": expected a slice from " + std::to_string(first_slice_) + ", got MarkerZ " + quote(slice_) +
                     (first_slice_ == 1 ? "; does the file count slices from 0? Then add 1 to each MarkerZ" : ""));
        table_.points.push_back({*at_[0], *at_[1], *at_[2] - first_slice_});
        if (by_type_) name_structure(table_, path_, type_);
        if (!std::exchange(has_markers_, true)) ++types_;
        at_ = {};
    }

    [[noreturn]] void refuse_name() const {
        fail(path_,
             "not well-formed XML: expected no '<' in the name of a type; write it as &lt;, or rename the type "
             "in Cell Counter and save the markers again");
    }

    [[nodiscard]] std::string who() const { return "marker " + std::to_string(table_.points.size() + 1); }

    const std::string& path_;
    bool by_type_;
    PointTable table_;
    int first_slice_ = 1;
    std::string type_;  ///< name of the current type of markers; without a name, "Type 1" as in the plugin
    bool in_name_ = false, in_marker_ = false;
    std::array<std::optional<double>, 3> at_{};
    std::string slice_;  ///< MarkerZ of the current marker, as in the file
    bool has_markers_ = false;
    /// Number of types of markers that occur; the plugin also writes types without markers, which are not counted.
    int types_ = 0;
};

}  // namespace

PointTable parse_cell_counter(const std::string& path, const std::string& text, const std::string& structures_by) {
    CellMarkers markers(path, structures_by);
    markers.read(text);
    return markers.finish();
}

}  // namespace covol::detail
