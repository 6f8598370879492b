#include "cli/provenance.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>

#include "covol/error.h"
#include "covol/file_set.h"

namespace covol::tool {
namespace fs = std::filesystem;
namespace {

constexpr std::uint64_t kPiece = 1 << 20, kPieces = 64;

class Digest {
public:
    Digest() { XXH3_128bits_reset(state_.get()); }
    void add(const void* bytes, std::size_t count) { XXH3_128bits_update(state_.get(), bytes, count); }
    /// As xxh128sum prints it.
    [[nodiscard]] std::string hex() const {
        XXH128_canonical_t digest;
        XXH128_canonicalFromHash(&digest, XXH3_128bits_digest(state_.get()));
        std::string text;
        for (const unsigned char byte : digest.digest) {
            text += "0123456789abcdef"[byte >> 4];
            text += "0123456789abcdef"[byte & 15];
        }
        return text;
    }

private:
    std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state_{XXH3_createState(), XXH3_freeState};
};

void add_file(const fs::path& path, Digest& hash) {
    std::ifstream file = open_regular_file(path.string());
    std::error_code status;
    const std::uint64_t bytes = fs::file_size(path, status);
    const bool whole = bytes <= kPieces * kPiece;
    std::vector<char> piece(kPiece);
    for (std::uint64_t n = 0; !status && file && (whole ? n * kPiece < bytes : n < kPieces); ++n) {
        const std::uint64_t begin = whole ? n * kPiece : (bytes - kPiece) * n / (kPieces - 1);
        file.seekg(std::streamoff(begin));
        file.read(piece.data(), std::streamsize(std::min(kPiece, bytes - begin)));
        hash.add(piece.data(), std::size_t(file.gcount()));
    }
    if (status || !file) throw Error(Errc::Io, path.string() + ": cannot read");
}

void add_metadata(const fs::path& folder, Digest& hash) {
    const std::set<std::string> names{".zarray", ".zattrs", ".zgroup", "zarr.json", "journal.jsonl"};  // or of a study
    std::set<fs::path> found;
    // Chunks lie deeper, or beside these, in any number.
    std::vector<fs::path> level{folder};
    for (int depth = 0; depth < 3; ++depth) {
        std::vector<fs::path> next;
        for (const fs::path& at : level) {
            bool is_array = false;
            for (const std::string& name : names) {
                std::error_code status;
                if (!fs::is_regular_file(at / name, status)) continue;
                found.insert(at / name);
                is_array = is_array || name == ".zarray";
            }
            if (is_array) continue;
            std::error_code status;
            for (const fs::directory_entry& entry : fs::directory_iterator(at, status))
                if (entry.is_directory(status) && entry.path().filename() != "c") next.push_back(entry.path());
        }
        level = std::move(next);
    }
    for (const fs::path& path : found) {
        const std::string name = fs::relative(path, folder).string();
        hash.add(name.c_str(), name.size() + 1);
        add_file(path, hash);
    }
}

}  // namespace

std::pair<std::size_t, std::size_t> path_within(const std::string& text) {
    const std::size_t equals = text.find('=');
    std::size_t begin = text.find('/') > equals ? equals + 1 : 0;  // a structure's name holds no slash
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
    while (last > begin && text[last - 1] == '/') --last;  // folders, such as .zarr/
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

std::string digest_of(const std::string& path) {
    Digest hash;
    std::error_code status;
    if (fs::is_directory(path, status)) {
        add_metadata(path, hash);
        return "xxh128-of-metadata:" + hash.hex();
    }
    add_file(path, hash);
    return (fs::file_size(path, status) > kPieces * kPiece ? "xxh128-of-pieces:" : "xxh128:") + hash.hex();
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
