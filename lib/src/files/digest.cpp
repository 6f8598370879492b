#include "covol/digest.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "covol/error.h"
#include "covol/file_set.h"
#include "files/dicom_class.h"

namespace covol {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kPiece = 1 << 20, kPieces = 64;

class Digest {
public:
    Digest() { XXH3_128bits_reset(state_.get()); }
    void add(const void* bytes, std::size_t count) { XXH3_128bits_update(state_.get(), bytes, count); }
    /// In the form that xxh128sum prints.
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

/// @return whether the folder has such files
bool add_metadata(const fs::path& folder, Digest& hash) {
    const std::set<std::string> names{".zarray", ".zattrs", ".zgroup", "zarr.json",
                                      "journal.jsonl"};  // files of a Zarr store, or of a study
    std::set<fs::path> found;
    // The chunks, which are in deeper folders or next to these files, are not read, because their number is unlimited.
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
    return !found.empty();
}

/// Adds the names, sizes and contents of the DICOM images directly in a folder, or of all its files if none of them is
/// one. DICOM objects without an image, such as segmentations and structure sets, are left out, as the reader of series
/// does. If together the files are larger than a file that is read as a whole, the middle of each is left out.
void add_files(const fs::path& folder, Digest& hash) {
    // If there are DICOM images, the other files are not parts of the image: results may be in the same folder.
    std::set<fs::path> all, dicom;
    std::error_code status;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, status)) {
        std::error_code is_gone;
        if (!entry.is_regular_file(is_gone) || detail::holds_no_image(entry.path().string())) continue;
        all.insert(entry.path());
        if (detail::is_marked_dicom(entry.path().string())) dicom.insert(entry.path());
    }
    if (status) throw Error(Errc::Io, folder.string() + ": cannot read");
    const std::set<fs::path>& found = dicom.empty() ? all : dicom;
    std::uint64_t sum = 0;
    for (const fs::path& path : found) sum += fs::file_size(path, status);
    const std::uint64_t maximum = sum <= kPieces * kPiece ? sum : kPieces * kPiece / found.size();
    std::vector<char> bytes;
    for (const fs::path& path : found) {
        std::ifstream file = open_regular_file(path.string());
        const std::uint64_t size = fs::file_size(path, status), half = std::min(size, maximum) / 2;
        if (status) throw Error(Errc::Io, path.string() + ": cannot read");
        const std::string name = path.filename().string();
        hash.add(name.c_str(), name.size() + 1);
        hash.add(&size, sizeof size);
        const std::uint64_t rest = size <= maximum ? half : size - half;
        for (const auto& [begin, end] : {std::pair{std::uint64_t(0), half}, std::pair{rest, size}}) {
            bytes.resize(end - begin);
            file.seekg(std::streamoff(begin));
            file.read(bytes.data(), std::streamsize(bytes.size()));
            hash.add(bytes.data(), std::size_t(file.gcount()));
        }
        if (!file) throw Error(Errc::Io, path.string() + ": cannot read");
    }
}

}  // namespace

std::string digest_of_bytes(const std::string& bytes) {
    Digest hash;
    hash.add(bytes.data(), bytes.size());
    return "xxh128:" + hash.hex();
}

std::string digest_of(const std::string& path) {
    Digest hash;
    std::error_code status;
    if (fs::is_directory(path, status)) {
        if (add_metadata(path, hash)) return "xxh128-of-metadata:" + hash.hex();
        add_files(path, hash);
        return "xxh128-of-files:" + hash.hex();
    }
    add_file(path, hash);
    return (fs::file_size(path, status) > kPieces * kPiece ? "xxh128-of-pieces:" : "xxh128:") + hash.hex();
}

}  // namespace covol
