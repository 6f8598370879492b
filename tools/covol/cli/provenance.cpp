#include "cli/provenance.h"

#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>

#include "covol/error.h"

namespace covol::tool {
namespace fs = std::filesystem;
namespace {

constexpr std::uint64_t kPiece = 1 << 20, kPieces = 64;

class Sha256 {
public:
    Sha256() { EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr); }
    void add(const void* bytes, std::size_t count) { EVP_DigestUpdate(context_.get(), bytes, count); }
    [[nodiscard]] std::string hex() {
        std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
        unsigned length = 0;
        EVP_DigestFinal_ex(context_.get(), digest.data(), &length);
        std::string text;
        for (unsigned n = 0; n < length; ++n) {
            text += "0123456789abcdef"[digest[n] >> 4];
            text += "0123456789abcdef"[digest[n] & 15];
        }
        return text;
    }

private:
    std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_{EVP_MD_CTX_new(), EVP_MD_CTX_free};
};

void add_file(const fs::path& path, Sha256& hash) {
    std::ifstream file(path, std::ios::binary);
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

void add_metadata(const fs::path& folder, Sha256& hash) {
    const std::set<std::string> names{".zarray", ".zattrs", ".zgroup", "zarr.json"};
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
    std::size_t begin = text.find('=') + 1;
    for (const char* kind : {"mesh:", "mask:", "vdb:"})
        if (text.compare(begin, std::string(kind).size(), kind) == 0) begin += std::string(kind).size();
    return {begin, std::min(text.find(":/", begin), text.size())};
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
    Sha256 hash;
    std::error_code status;
    if (fs::is_directory(path, status)) {
        add_metadata(path, hash);
        return "sha256-of-metadata:" + hash.hex();
    }
    add_file(path, hash);
    return (fs::file_size(path, status) > kPieces * kPiece ? "sha256-of-pieces:" : "sha256:") + hash.hex();
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
