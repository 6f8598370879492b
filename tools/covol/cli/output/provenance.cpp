#include "cli/output/provenance.h"

#include <algorithm>
#include <filesystem>

namespace covol::tool {
namespace fs = std::filesystem;

std::pair<std::size_t, std::size_t> path_within(const std::string& text) {
    const std::size_t equals = text.find('=');
    std::size_t begin = text.find('/') > equals ? equals + 1 : 0;  // a '=' after the first '/' belongs to the path
    for (const char* kind : {"mesh:", "mask:", "vdb:"})
        if (text.compare(begin, std::string(kind).size(), kind) == 0) begin += std::string(kind).size();
    return {begin, std::min(text.find(":/", begin), text.size())};
}

std::optional<std::pair<std::string, std::string>> around_frame(const std::string& text) {
    const std::size_t begin = text.find("{frame"), end = text.find('}', std::min(begin, text.size()));
    if (begin == std::string::npos || end == std::string::npos) return {};
    return std::pair(text.substr(0, begin), text.substr(end + 1));
}

std::vector<std::string> files_of_frames(const std::string& text) {
    const fs::path pattern = text.substr(path_within(text).first);
    const auto parts = around_frame(pattern.filename().string());
    std::vector<std::string> files;
    if (!parts) return files;
    std::error_code status;
    const fs::path folder = pattern.has_parent_path() ? pattern.parent_path() : fs::path(".");
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, status))
        if (is_frame(entry.path().filename().string(), *parts) && entry.is_regular_file(status))
            files.push_back((pattern.parent_path() / entry.path().filename()).string());
    std::sort(files.begin(), files.end());
    return files;
}

bool is_frame(const std::string& name, const std::pair<std::string, std::string>& parts) {
    const auto& [before, behind] = parts;
    if (name.size() <= before.size() + behind.size() || !name.starts_with(before) || !name.ends_with(behind))
        return false;
    return std::all_of(name.begin() + std::ptrdiff_t(before.size()), name.end() - std::ptrdiff_t(behind.size()),
                       [](char c) { return c >= '0' && c <= '9'; });
}

std::string without_folder(const std::string& text) {
    const auto [begin, end] = path_within(text);
    std::size_t last = end;
    while (last > begin && text[last - 1] == '/') --last;  // the path of a folder may end in slashes, as in a.zarr/
    const std::size_t slash = last > begin ? text.rfind('/', last - 1) : std::string::npos;
    return slash == std::string::npos || slash < begin ? text : text.substr(0, begin) + text.substr(slash + 1);
}

Json without_folders(const Json& options) {
    Json result = options;
    for (Json& value : result) {
        if (value.is_string()) value = without_folder(value.get<std::string>());
        if (value.is_array() || value.is_object()) value = without_folders(value);
    }
    return result;
}

Json describe_inputs(const std::vector<std::string>& paths) {
    Json inputs = Json::array();
    for (const std::string& path : paths) {
        const fs::path name = fs::path(path).has_filename() ? fs::path(path) : fs::path(path).parent_path();
        Json input{{"name", name.filename().string()}, {"digest", digest_of(path)}};
        if (std::find(inputs.begin(), inputs.end(), input) == inputs.end()) inputs.push_back(std::move(input));
    }
    return inputs;
}

}  // namespace covol::tool
