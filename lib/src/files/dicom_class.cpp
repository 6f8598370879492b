#include "files/dicom_class.h"

#include <filesystem>
#include <fstream>

namespace covol::detail {
namespace {

/// The first `count` bytes of a file, or fewer if it is shorter; none if it is not a regular file or cannot be read.
std::string first_bytes(const std::string& path, std::size_t count) {
    std::error_code status;
    if (!std::filesystem::is_regular_file(path, status)) return {};  // opening a named pipe would wait for a writer
    std::string begin(count, '\0');
    std::ifstream file(path, std::ios::binary);
    file.read(begin.data(), std::streamsize(begin.size()));
    begin.resize(static_cast<std::size_t>(file.gcount()));
    return begin;
}

}  // namespace

bool has_dicom_marker(std::string_view begin) {
    return begin.size() >= kFirstDicomElement && begin.substr(kDicomPreamble, kDicomMarker.size()) == kDicomMarker;
}

bool is_marked_dicom(const std::string& path) { return has_dicom_marker(first_bytes(path, kFirstDicomElement)); }

std::string dicom_class(const std::string& path) {
    // [bytes] Size of the part of the file that is searched for the SOP class, which is near the beginning.
    constexpr std::size_t kMeta = 1024;
    const std::string begin = first_bytes(path, kMeta);
    constexpr std::string_view kMediaClass("\x02\x00\x02\x00UI", 6);
    const std::size_t at = begin.find(kMediaClass, kFirstDicomElement);
    if (!has_dicom_marker(begin) || at == std::string::npos || at + 8 > begin.size()) return {};
    const auto length = std::size_t(static_cast<unsigned char>(begin[at + 6]));
    std::string uid = begin.substr(at + 8, length);
    if (!uid.empty() && uid.back() == '\0') uid.pop_back();
    return uid;
}

bool holds_no_image(const std::string& path) {
    const std::string own = dicom_class(path);
    constexpr std::string_view kClasses = "1.2.840.10008.5.1.4.1.1.";
    if (!own.starts_with(kClasses)) return false;
    const std::string kind = own.substr(kClasses.size());
    if (kind == "481.1" || kind == "481.2") return false;  // RT images and RT doses, which have pixels
    for (const char* group : {"481.", "66.", "88.", "11.", "104."})
        if (kind.starts_with(group)) return true;
    return false;
}

}  // namespace covol::detail
