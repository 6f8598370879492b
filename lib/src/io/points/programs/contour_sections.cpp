#include <limits>
#include <optional>

#include "covol/error.h"
#include "io/points/point_formats.h"
#include "io/points/point_text.h"

namespace covol::detail {
namespace {

using std::string_view;

/// The words of a text, separated by any white space.
class Words {
public:
    Words(const std::string& path, const std::string& text) : path_(path), lines_(text) {}

    string_view next(const char* what) {
        while (at_ == words_.size()) {
            string_view line;
            if (!lines_.next_words(line, words_))
                fail(path_, std::string("expected ") + what + ", found the file's end");
            at_ = 0;
        }
        return words_[at_++];
    }
    double number(const char* what) { return to_coordinate(path_, lines_.number(), next(what)); }
    /// An integer from `minimum` to `maximum`.
    std::size_t count(const char* what, std::size_t minimum, std::size_t maximum) {
        return to_count(next(what), what, minimum, maximum);
    }
    std::size_t to_count(string_view word, const char* what, std::size_t minimum, std::size_t maximum) const {
        const std::optional<double> value = to_number(word);
        if (!value || !(*value >= double(minimum)) || !(*value <= double(maximum)) ||
            *value != double(std::size_t(*value)))
            fail(path_, lines_.number(),
                 std::string("expected ") + what + ", a whole number from " + std::to_string(minimum) + " to " +
                     std::to_string(maximum) + ", got " + quote(word));
        return std::size_t(*value);
    }

private:
    const std::string& path_;
    Lines lines_;
    std::vector<string_view> words_;
    std::size_t at_ = 0;
};

}  // namespace

PointTable parse_sections(const std::string& path, const std::string& text, const std::string& structures_by) {
    PointTable table;
    Words words(path, text);
    if (words.next("CSLC") != "CSLC") fail(path, "expected the header CSLC of sections in planes");
    // A count that exceeds the size of the file in bytes is invalid, because each item needs at least two bytes.
    const std::size_t maximum = text.size();
    const std::size_t planes = words.count("the number of planes", 0, maximum);
    const std::size_t labels = words.count("the number of labels", 1, maximum);
    std::optional<std::size_t> only;
    for (std::size_t plane = 0; plane < planes; ++plane) {
        const std::string name = std::to_string(words.count("a plane's number", 0, maximum));
        const std::size_t vertices = words.count("the number of a plane's vertices", 0, maximum);
        const std::size_t contours = words.count("the number of a plane's contours", 0, maximum);
        for (int n = 0; n < 4; ++n) (void)words.number("the four numbers of a plane");
        std::vector<Vec3> places;
        for (std::size_t n = 0; n < vertices; ++n) {
            Vec3& at = places.emplace_back();
            for (double& x : at) x = words.number("a vertex");
        }
        for (std::size_t n = 0; n < contours; ++n) {
            const string_view sizes = words.next("a contour");
            const std::size_t count =
                words.to_count(sizes.substr(0, sizes.find('h')), "the number of a contour's vertices", 0, maximum);
            const std::size_t label = words.count("a contour's label", 0, labels);
            if (structures_by.empty() && only.value_or(label) != label)
                throw Error(Errc::InvalidInput,
                            path + ": plane " + name + ": expected contours of one label, got " +
                                std::to_string(*only) + " and " + std::to_string(label) +
                                "; `structure_column = label` makes a structure of each",
                            "structure_column");
            only = label;
            std::vector<Vec3> line;
            for (std::size_t m = 0; m < count; ++m) {
                if (places.empty())
                    fail(path, "plane " + name + ": a contour refers to vertices, but the plane has none");
                line.push_back(places[words.count("a vertex's number", 0, places.size() - 1)]);
            }
            if (line.empty()) continue;
            add_line(table, line, true, "plane " + name + ", contour " + std::to_string(n));
            if (structures_by == "label") name_structure(table, path, "label " + std::to_string(label));
        }
    }
    table.order = PointOrder::XYZ;
    table.rule = "sections in " + std::to_string(planes) + " planes";
    return table;
}

}  // namespace covol::detail
