#include "io/points/point_files.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numbers>

#include "base/file.h"
#include "covol/error.h"
#include "covol/file_set.h"
#include "io/points/point_formats.h"
#include "io/points/point_text.h"

namespace covol::detail {
namespace {

namespace fs = std::filesystem;

std::string read_text(const std::string& path) {
    std::error_code status;
    if (!fs::exists(path, status)) throw Error(Errc::Io, path + ": no such file");
    std::ifstream file = open_regular_file(path);
    if (!file) throw Error(Errc::Io, path + ": cannot be opened");
    std::string text(fs::file_size(path), '\0');
    file.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(file.gcount()));
    return text;
}

using Parser = std::function<PointTable(const std::string& path, const std::string& content, const std::string& by)>;

struct Format {
    const char* ending;
    Parser parse;
};

PointTable parse_table(const std::string& path, const std::string& text, const std::string& by) {
    return parse_columns(path, to_utf8(text), false, by);
}
PointTable parse_blanks(const std::string& path, const std::string& bytes, const std::string& by) {
    const std::string text = to_utf8(bytes);
    return is_ptx(text) ? parse_ptx(path, text) : parse_columns(path, text, true, by);
}

PointTable parse_one_roi(const std::string& path, const std::string& bytes, const std::string& by) {
    return parse_roi(path, bytes, fs::path(path).stem().string(), by);
}

/// Adapts a parser to the signature of the other parsers. Its format does not name structures, so the third argument is
/// ignored.
template <PointTable (*parse)(const std::string&, const std::string&)>
PointTable of_one(const std::string& path, const std::string& content, const std::string&) {
    return parse(path, content);
}

PointTable refuse_laz(const std::string& path, const std::string&, const std::string&) {
    throw Error(Errc::Unsupported, path + ": LAZ is not read; unpack it to .las with laszip or pdal translate");
}

const std::vector<Format>& formats() {
    static const std::vector<Format> list{{".xyz", parse_blanks},
                                          {".txt", parse_blanks},
                                          {".pts", parse_blanks},
                                          {".asc", parse_blanks},
                                          {".csv", parse_table},
                                          {".tsv", parse_table},
                                          {".ptx", parse_blanks},
                                          {".ply", of_one<parse_ply>},
                                          {".obj", of_one<parse_obj>},
                                          {".off", of_one<parse_off>},
                                          {".roi", parse_one_roi},
                                          {".zip", parse_roi_zip},
                                          {".xml", parse_cell_counter},
                                          {".json", parse_markups},
                                          {".fcsv", parse_fcsv},
                                          {".csl", parse_sections},
                                          {".dcm", parse_rt_structures},
                                          {".landmarks", of_one<parse_landmarks>},
                                          {".lmk", of_one<parse_landmarks>},
                                          {".annot", of_one<parse_annotations>},
                                          {".pcd", of_one<parse_pcd>},
                                          {".las", of_one<parse_las>},
                                          {".laz", refuse_laz}};
    return list;
}

}  // namespace

std::vector<Vec3> ellipse(const Vec3& centre, const Vec3& u, const Vec3& v) {
    double longest = 0;
    for (int a = 0; a < 3; ++a) longest = std::max({longest, std::abs(u[a]), std::abs(v[a])});
    constexpr double kFewest = 16, kMax = 4096;
    const int count = static_cast<int>(std::clamp(std::ceil(2 * std::numbers::pi * longest), kFewest, kMax));
    std::vector<Vec3> points;
    for (int n = 0; n < count; ++n) {
        const double angle = 2 * std::numbers::pi * n / count, c = std::cos(angle), s = std::sin(angle);
        points.push_back(
            {centre[0] + c * u[0] + s * v[0], centre[1] + c * u[1] + s * v[1], centre[2] + c * u[2] + s * v[2]});
    }
    return points;
}

Vec3 normal_of(const Vec3& given) {
    const double length = std::hypot(given[0], given[1], given[2]);
    if (!std::isfinite(length) || !(length > 1e-30)) return {0, 0, 0};
    return {given[0] / length, given[1] / length, given[2] / length};
}

void add_line(PointTable& table, const std::vector<Vec3>& points, bool closed, const std::string& name) {
    const std::size_t begin = table.points.size();
    table.points.insert(table.points.end(), points.begin(), points.end());
    table.lines.push_back({begin, table.points.size(), closed, name});
}

void name_structure(PointTable& table, const std::string& path, const std::string& name) {
    constexpr std::size_t kMax = 254;  // maximum number of labels of a label image
    auto& names = table.structures;
    const bool is_last = !table.structure.empty() && names[table.structure.back()] == name;
    const auto found = is_last ? names.begin() + table.structure.back() : std::find(names.begin(), names.end(), name);
    const auto number = std::uint32_t(found - names.begin());
    if (found == names.end()) {
        if (names.size() == kMax)
            throw Error(Errc::InvalidInput,
                        path + ": `structure_column`: expected at most " + std::to_string(kMax) +
                            " structures, got more; is it another column that names them?",
                        "structure_column");
        names.push_back(name);
    }
    table.structure.resize(table.points.size(), number);
}

PointTable read_point_table(const std::string& path, const std::string& structures_by) {
    const std::string extension = detail::extension(path);
    const auto& list = formats();
    const auto format = std::find_if(list.begin(), list.end(), [&](const Format& f) { return f.ending == extension; });
    if (format == list.end()) {
        std::string known;
        for (const Format& f : list) known += (known.empty() ? "" : ", ") + std::string(f.ending);
        throw Error(Errc::Unsupported,
                    path + ": expected a name ending in one of " + known + ", got '" + extension + "'");
    }
    const std::string content = read_text(path);
    if (content.empty()) fail(path, "the file is empty");
    PointTable table = format->parse(path, content, structures_by);
    if (!structures_by.empty() && table.structure.size() != table.points.size())
        throw Error(
            Errc::InvalidInput,
            path + ": `structure_column`: expected a table with a column " + quote(structures_by) +
                ", Fiji's selections with group or counter, its Cell Counter with type, 3D Slicer's markups with "
                "label or node, .csl sections with label, or a DICOM RT structure set with roi; a " +
                extension + " file has no '" + structures_by + "'",
            "structure_column");
    return table;
}

}  // namespace covol::detail
