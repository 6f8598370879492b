#include "mark/request_fields.h"

#include <charconv>

#include "covol/error.h"

namespace covol::tool {

std::int64_t number_of(const serve::Request& request, const std::string& name) {
    const auto found = request.query.find(name);
    std::int64_t value = -1;
    if (found != request.query.end()) {
        const std::string& text = found->second;
        const auto end = text.data() + text.size();
        if (const auto read = std::from_chars(text.data(), end, value); read.ec == std::errc() && read.ptr == end)
            return value;
    }
    throw Error(Errc::InvalidInput, "'" + name + "': expected a whole number");
}

Vec3 vector_of(const serve::Request& request, const std::string& name) {
    const auto found = request.query.find(name);
    const std::string text = found != request.query.end() ? found->second : "";
    Vec3 vector{};
    const char* at = text.data();
    const char* const end = at + text.size();
    for (std::size_t a = 0; a < 3; ++a) {
        const auto read = std::from_chars(at, end, vector[a]);
        const bool is_last = a == 2;
        if (read.ec != std::errc() || (is_last ? read.ptr != end : read.ptr == end || *read.ptr != ','))
            throw Error(Errc::InvalidInput, "'" + name + "': expected three numbers");
        at = read.ptr + (is_last ? 0 : 1);
    }
    return vector;
}

}  // namespace covol::tool
