#include "io/points/point_text.h"

#include <cmath>

#include "covol/error.h"

namespace covol::detail {

void fail(const std::string& path, std::size_t line, const std::string& what) {
    throw Error(Errc::InvalidInput, "read_points: " + path + ":" + std::to_string(line) + ": " + what);
}

void fail(const std::string& path, const std::string& what) {
    throw Error(Errc::InvalidInput, "read_points: " + path + ": " + what);
}

double to_coordinate(const std::string& path, std::size_t line, std::string_view field) {
    const std::optional<double> value = to_number(field);
    if (!value) fail(path, line, "expected a number, got " + quote(field));
    if (!std::isfinite(*value)) fail(path, line, "expected a finite number, got " + quote(field));
    return *value;
}

}  // namespace covol::detail
