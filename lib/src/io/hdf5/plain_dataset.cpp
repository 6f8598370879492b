// Reads a single dataset, as ilastik, h5py and many other programs write it.
#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "io/hdf5/hdf5_layouts.h"
#include "io/pixels/raw_image.h"

namespace covol::detail {
namespace {

/// The shape as a text, such as "50 x 1024 x 1024".
std::string shape_text(const std::vector<std::uint64_t>& shape) {
    std::string text;
    for (const std::uint64_t n : shape) text += (text.empty() ? "" : " x ") + std::to_string(n);
    return text;
}

/// The name of the only dataset of numbers in a group with at least three dimensions. @throws Error Unsupported if
/// there is none, or several, which the message lists.
std::string only_dataset(const Hdf5File& file, const std::string& group) {
    constexpr std::size_t kShown = 20;
    std::vector<std::string> names;
    std::string list;
    for (const std::string& name : file.datasets(group)) {
        const Hdf5Shape shape = shape_of(file, name);
        if (shape.shape.size() < 3 || !shape.has_numbers) continue;
        names.push_back(name);
        if (names.size() <= kShown)
            list += (names.size() == 1 ? "" : ", ") + name + " (" + shape_text(shape.shape) + ")";
    }
    if (names.size() == 1) return names.front();
    if (names.empty())
        throw read_error(Errc::Unsupported, file.path_of(group),
                         "expected a dataset of three dimensions with numbers, got none");
    if (names.size() > kShown) list += ", ... (" + std::to_string(names.size()) + ")";
    throw read_error(Errc::Unsupported, file.path_of(group),
                     "expected one dataset of three dimensions, got several; choose one with `" +
                         file.path_of(names.front()) + "`: " + list);
}

/// Determines the meaning of each dimension of a dataset.
class Axes {
public:
    Axes(const Hdf5File& file, std::string name) : file_(file), name_(std::move(name)), shape_(shape_of(file, name_)) {
        if (!from_axistags() && !from_labels()) by_order();
        for (const char letter : std::string("xyzct")) {
            const auto count = std::count(letters_.begin(), letters_.end(), letter);
            if (count > 1 || (count == 0 && (letter == 'x' || letter == 'y' || letter == 'z')))
                throw read_error(Errc::InvalidInput, file_.path_of(name_),
                                 "expected axes z, y and x, and at most one for channels and for time, got " +
                                     quote(letters_) + " for " + shape_text(shape_.shape));
        }
    }
    [[nodiscard]] const std::string& letters() const { return letters_; }
    /// How the axes were determined, such as "axistags: zyxc".
    [[nodiscard]] const std::string& source() const { return source_; }
    /// Distance between voxels along x, y, z, which axistags call "resolution"; 0 along axes for which they state none.
    [[nodiscard]] const Vec3& resolution() const { return resolution_; }

private:
    static char letter_of(const std::string& key) {
        return key.size() == 1 && std::string("xyzct").find(key) != std::string::npos ? key[0] : '?';
    }

    bool from_axistags() {
        const std::string text = file_.text(name_, "axistags");
        if (text.empty()) return false;
        const Json tags = parse_json(file_.path_of(name_), text);
        const Json& axes = member(tags, "axes");
        if (!axes.is_array() || axes.size() != shape_.shape.size())
            throw read_error(
                Errc::InvalidInput, file_.path_of(name_),
                "expected axistags for each of its " + std::to_string(shape_.shape.size()) + " dimensions");
        for (const Json& axis : axes) {
            letters_ += letter_of(lower(text_of(member(axis, "key"))));
            const Json& step = member(axis, "resolution");
            const std::size_t at = std::string("xyz").find(letters_.back());
            if (at < 3 && step.is_number() && std::isfinite(step.get<double>()) && step.get<double>() > 0)
                resolution_[at] = step.get<double>();
        }
        source_ = "axistags: " + letters_;
        return true;
    }

    /// Uses HDF5's dimension labels. @returns false if they do not name all dimensions
    bool from_labels() {
        const std::vector<std::string> labels = file_.texts(name_, "DIMENSION_LABELS");
        std::string letters;
        for (const std::string& label : labels) letters += letter_of(lower(label));
        const bool known = std::all_of(letters.begin(), letters.end(), [](char c) { return c != '?'; });
        if (labels.size() != shape_.shape.size() || !known) return false;
        letters_ = letters;
        source_ = "DIMENSION_LABELS: " + letters_;
        return true;
    }

    /// Assumes the order z, y, x. If there are more than three dimensions, dimensions with a single element are not
    /// counted. @throws Error Unsupported unless three dimensions remain.
    void by_order() {
        std::vector<std::size_t> wide;
        for (std::size_t d = 0; d < shape_.shape.size(); ++d)
            if (shape_.shape[d] != 1 || shape_.shape.size() == 3) wide.push_back(d);
        if (wide.size() != 3)
            throw read_error(Errc::Unsupported, file_.path_of(name_),
                             "expected three dimensions z, y, x, or the attribute axistags that names channels and "
                             "time, got a dataset of " +
                                 shape_text(shape_.shape) + " without it");
        letters_.assign(shape_.shape.size(), '?');
        for (std::size_t n = 0; n < 3; ++n) letters_[wide[n]] = "zyx"[n];
        source_ = "by their order: zyx";
    }

    const Hdf5File& file_;
    std::string name_;
    Hdf5Shape shape_;
    std::string letters_, source_;
    Vec3 resolution_{0, 0, 0};
};

/// Reads the spacing from an attribute with one of the usual names, which has one number for each of z, y, x or for
/// each dimension. If there is no such attribute, the spacing is read from axistags.
void describe_spacing(const Hdf5File& file, const std::string& name, const Axes& axes, ImageInfo& info) {
    info.spacing_known = {false, false, false};
    const std::string unit = file.text(name, "unit"), units = file.text(name, "units");
    for (const char* attribute : {"element_size_um", "spacing", "resolution", "voxel_size"}) {
        const std::vector<double> numbers = file.numbers(name, attribute);
        const std::string& letters = axes.letters();
        std::string order;  // for each of `numbers`, the letter of the axis to which it belongs
        for (const char letter : letters)
            if (numbers.size() == letters.size() || letter == 'x' || letter == 'y' || letter == 'z') order += letter;
        const bool good = numbers.size() == order.size() &&
                          std::all_of(numbers.begin(), numbers.end(), [](double n) { return std::isfinite(n); });
        if (!good) continue;
        std::string text;
        for (std::size_t n = 0; n < numbers.size(); ++n) {
            text += (n == 0 ? "" : ", ") + std::to_string(numbers[n]);
            const std::size_t a = std::string("xyz").find(order[n]);
            if (a > 2 || !(numbers[n] > 0)) continue;
            info.geometry.spacing[a] = numbers[n];
            info.spacing_known[a] = true;
        }
        info.geometry.unit =
            attribute == std::string("element_size_um") ? "um" : normal_unit(units.empty() ? unit : units);
        info.fields.emplace_back(attribute, text);
        return;
    }
    for (int a = 0; a < 3; ++a) {
        info.spacing_known[a] = axes.resolution()[a] > 0;
        if (info.spacing_known[a]) info.geometry.spacing[a] = axes.resolution()[a];
    }
}

}  // namespace

Hdf5Layout plain_layout(const Hdf5File& file, const std::string& inside) {
    std::string name = inside.empty() || inside.front() != '/' ? "/" + inside : inside;
    while (name.size() > 1 && name.back() == '/') name.pop_back();
    if (name == "/" || (file.has(name) && !file.has_dataset(name))) name = only_dataset(file, name);
    const Axes axes(file, name);
    Hdf5Layout layout;
    layout.info.format = "HDF5";
    layout.letters = axes.letters();
    layout.info.fields.emplace_back("axes", axes.source());
    describe_spacing(file, name, axes, layout.info);
    layout.dataset = [name](std::uint64_t, std::uint64_t) { return name; };
    return layout;
}

}  // namespace covol::detail
