#include "cli/output/json.h"

#include <filesystem>
#include <fstream>
#include <iterator>

#include "covol/error.h"

namespace covol::tool {

Json parse_json(const std::string& text, const std::string& what) {
    constexpr int kMaxLevels = 32;
    try {
        return Json::parse(text, [&](int depth, Json::parse_event_t, const Json&) {
            // Depth is limited because the JSON library copies and writes values recursively: deep ones exhaust the
            // stack.
            if (depth > kMaxLevels)
                throw Error(Errc::InvalidInput,
                            what + ": expected JSON of at most " + std::to_string(kMaxLevels) + " levels");
            return true;
        });
    } catch (const Json::exception& error) {
        throw Error(Errc::InvalidInput, what + ": expected JSON; it is damaged: " + error.what());
    }
}

Json read_json(const std::string& path, std::uintmax_t max_bytes) {
    std::error_code status;
    const std::filesystem::file_status found = std::filesystem::status(path, status);
    if (!std::filesystem::is_regular_file(found))
        throw Error(Errc::Io, path + ": cannot read: " +
                                  (std::filesystem::exists(found) ? "it is not a regular file" : status.message()));
    if (std::filesystem::file_size(path, status) > max_bytes)
        throw Error(Errc::Io,
                    path + ": cannot read: expected a file of at most " + std::to_string(max_bytes >> 20U) + " MiB");
    std::ifstream file(path, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    if (!file) throw Error(Errc::Io, path + ": cannot read");
    return parse_json(text, path);
}

}  // namespace covol::tool
