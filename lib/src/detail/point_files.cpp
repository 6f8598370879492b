#include "detail/point_files.h"

#include <filesystem>
#include <fstream>

#include "covol/error.h"
#include "detail/file.h"
#include "detail/point_formats.h"
#include "detail/point_text.h"

namespace covol::detail {
namespace {

namespace fs = std::filesystem;

std::string read_text(const std::string& path) {
    std::error_code status;
    if (!fs::exists(path, status)) throw Error(Errc::Io, "read_points: " + path + ": no such file");
    std::ifstream file(path, std::ios::binary);
    if (!fs::is_regular_file(path, status) || !file)
        throw Error(Errc::Io, "read_points: " + path + ": cannot be opened");
    std::string text(fs::file_size(path), '\0');
    file.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(file.gcount()));
    return text;
}

}  // namespace

void add_line(PointTable& table, const std::vector<Vec3>& points, bool closed, const std::string& name) {
    const std::size_t begin = table.points.size();
    table.points.insert(table.points.end(), points.begin(), points.end());
    table.lines.push_back({begin, table.points.size(), closed, name});
}

PointTable read_point_table(const std::string& path) {
    const std::string extension = detail::extension(path);
    const bool blanks = extension == ".xyz" || extension == ".txt" || extension == ".pts" || extension == ".asc";
    const bool columns = blanks || extension == ".csv" || extension == ".tsv";
    if (!columns && extension != ".ply" && extension != ".obj" && extension != ".off")
        throw Error(Errc::Unsupported, "read_points: " + path +
                                           ": expected a name ending in .xyz, .txt, .pts, .csv, .tsv, .ply, .obj or "
                                           ".off, got '" +
                                           extension + "'");
    const std::string text = read_text(path);
    if (text.empty()) fail(path, "the file is empty");
    if (columns) return parse_columns(path, text, blanks);
    if (extension == ".ply") return parse_ply(path, text);
    return extension == ".obj" ? parse_obj(path, text) : parse_off(path, text);
}

}  // namespace covol::detail
