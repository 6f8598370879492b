#include "covol/marks.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <set>

#include "covol/error.h"
#include "covol/safe_text.h"

namespace covol {
namespace {

// Maximum number of structures of which all messages are logged; with more, only warnings are.
constexpr std::size_t kMaxInLines = 4;

/// Adds the normals and the directions to the sensor of a cloud whose points `world` are the last points of `marks`.
/// The points without a normal or a direction get a vector of zeros; a list remains empty until a cloud has values for
/// it.
void add_hints(const PointCloud& cloud, const std::vector<Vec3>& world, Marks& marks) {
    const std::size_t before = marks.points.size() - world.size();
    std::vector<Vec3>& normals = marks.hints.normals;
    std::vector<Vec3>& to_sensor = marks.hints.to_sensor;
    if (!cloud.normals.empty()) {
        normals.resize(before);
        normals.insert(normals.end(), cloud.normals.begin(), cloud.normals.end());
    }
    if (cloud.sensor) {
        to_sensor.resize(before);
        for (const Vec3& p : world) {
            const Vec3 d{(*cloud.sensor)[0] - p[0], (*cloud.sensor)[1] - p[1], (*cloud.sensor)[2] - p[2]};
            const double length = std::hypot(d[0], d[1], d[2]);
            to_sensor.push_back(length > 0 ? Vec3{d[0] / length, d[1] / length, d[2] / length} : Vec3{0, 0, 0});
        }
    }
    for (std::vector<Vec3>* list : {&normals, &to_sensor})
        if (!list->empty()) list->resize(marks.points.size());
}

void take(std::vector<Vec3>& list, const std::vector<std::uint32_t>& which) {
    if (list.empty()) return;
    std::vector<Vec3> taken(which.size());
    std::transform(which.begin(), which.end(), taken.begin(), [&](std::uint32_t n) { return list[n]; });
    list = std::move(taken);
}

/// The mask of a label: 1 at its voxels, else 0.
Image only(const Image& labels, int label) {
    const auto [ni, nj, nk] = labels.geometry().size;
    std::vector<std::uint8_t> values;
    values.reserve(std::size_t(ni) * std::size_t(nj) * std::size_t(nk));
    for (int k = 0; k < nk; ++k)
        for (int j = 0; j < nj; ++j)
            for (int i = 0; i < ni; ++i) values.push_back(labels.at(i, j, k) == label ? 1 : 0);
    return Image::from_values(labels.geometry(), values.data());
}

}  // namespace

PaintedImage make_painted(const Image& image, const PaintedOptions& options) {
    PaintedImage painted{image, options, find_painted_labels(image), {}, true};
    std::erase_if(painted.labels, [&](const LabelName& label) { return label.label == options.outside_label; });
    return painted;
}

GivenGuess make_guess(const Image& mask, int label, const std::optional<ImageGeometry>& image, bool force) {
    GivenGuess guess;
    const std::string who = "`guess`" + (mask.path().empty() ? "" : ": " + mask.path());
    guess.mask = image ? placed_on(mask, *image, force) : mask;
    const std::vector<LabelName> labels = find_painted_labels(*guess.mask);
    std::string list;
    for (const LabelName& l : labels) list += (list.empty() ? "" : ", ") + std::to_string(l.label);
    if (label == 0 && labels.size() > 1)
        throw Error(Errc::InvalidInput, who + ": expected one label, got " + list + "; choose one with `guess_label`",
                    "guess");
    guess.label = label != 0 ? label : labels.front().label;
    if (std::none_of(labels.begin(), labels.end(), [&](const LabelName& l) { return l.label == guess.label; }))
        throw Error(
            Errc::InvalidInput,
            "`guess_label`: expected one of the labels of the guess, " + list + ", got " + std::to_string(guess.label),
            "guess_label");
    guess.start = MaskStart{std::make_shared<const Image>(only(*guess.mask, guess.label))};
    return guess;
}

void add_points(Marks& marks, const PointCloud& cloud, const std::optional<ImageGeometry>& image,
                const RunContext& run) {
    const std::vector<Vec3> world = image ? to_world(cloud, *image) : to_world(cloud);
    if (image) check_inside(cloud, *image, run);
    marks.points.insert(marks.points.end(), world.begin(), world.end());
    add_hints(cloud, world, marks);
    marks.rules.push_back(cloud.rule);
    marks.count += world.size();
}

void add_contours(Marks& marks, PointCloud cloud, const std::optional<ImageGeometry>& image, const RunContext& run) {
    if (image) check_inside(cloud, *image, run);
    marks.count += cloud.points.size();
    marks.contours.push_back(std::move(cloud));
}

void thin_points(Marks& marks, std::size_t maximum, const RunContext& run) {
    const std::size_t given = marks.points.size();
    const std::vector<std::uint32_t> used =
        order_spatially(marks.points, maximum > 0 ? maximum : std::numeric_limits<std::size_t>::max());
    for (std::vector<Vec3>* list : {&marks.points, &marks.hints.normals, &marks.hints.to_sensor}) take(*list, used);
    if (used.size() == given) return;
    marks.thinned = used.size();
    run.info("cloud: " + std::to_string(used.size()) + " of " + std::to_string(given) +
             " points used, evenly distributed; `most_points = 0` uses all");
}

std::vector<Vec3> positions_of(const Marks& marks, const std::optional<ImageGeometry>& image) {
    std::vector<Vec3> all = marks.points;
    for (const PointCloud& lines : marks.contours) {
        const std::vector<Vec3> world = image ? to_world(lines, *image) : to_world(lines);
        all.insert(all.end(), world.begin(), world.end());
    }
    return all;
}

Marks* find_structure(std::vector<Marks>& structures, const std::string& name) {
    const std::string safe = safe_text(name);  // without characters that files, tables or terminals interpret
    const auto at =
        std::find_if(structures.begin(), structures.end(), [&](const Marks& marks) { return marks.name == safe; });
    return at != structures.end() ? &*at : nullptr;
}

Marks& find_or_add_structure(std::vector<Marks>& structures, const std::string& name) {
    if (Marks* const found = find_structure(structures, name)) return *found;
    structures.emplace_back().name = safe_text(name);
    return structures.back();
}

void add_paint(std::vector<Marks>& structures, const std::vector<std::shared_ptr<const PaintedImage>>& images) {
    std::size_t labels = 0;
    bool named_image = false, named_label = false;
    for (const auto& image : images) {
        labels += image->labels.size();
        named_image = named_image || !image->name.empty();
        for (const LabelName& label : image->labels) named_label = named_label || label.named;
    }
    const bool one = labels == 1 && !named_image &&
                     (structures.size() == 1 ? structures.front().name.empty() : structures.empty() && !named_label);
    for (const auto& image : images)
        for (const LabelName& label : image->labels) {
            const std::string& name = one || image->name.empty() ? label.name : image->name;
            find_or_add_structure(structures, one ? "" : name).paint.push_back({image, label.label});
        }
}

void number_labels(std::vector<Marks>& structures) {
    std::set<int> taken;
    for (const Marks& marks : structures) taken.insert(marks.label);
    for (Marks& marks : structures)
        for (const Marks::Paint& paint : marks.paint)
            if (marks.label == 0 && paint.image->is_shared && taken.insert(paint.label).second)
                marks.label = paint.label;
    int next = 1;
    for (Marks& marks : structures) {
        while (taken.contains(next)) ++next;
        if (marks.label == 0) taken.insert(marks.label = next);
    }
}

RunContext speaking_for(const std::string& name, std::size_t structures, const RunContext& run) {
    RunContext named = run;
    if (!name.empty() && run.log)
        named.log = [log = run.log, name, brief = structures > kMaxInLines](LogLevel level, const std::string& line) {
            if (!brief || level == LogLevel::Warning) log(level, name + ": " + line);
        };
    return named;
}

}  // namespace covol
