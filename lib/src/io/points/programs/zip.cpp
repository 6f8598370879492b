#include "io/points/programs/zip.h"

#include <zlib.h>

#include "covol/error.h"
#include "io/points/bytes.h"

// The format is defined by PKWARE's APPNOTE.TXT 6.3, sections 4.3.7, 4.3.12 and 4.3.16.
namespace covol::detail {
namespace {

constexpr std::uint32_t kEndSignature = 0x06054b50, kEntrySignature = 0x02014b50, kLocalSignature = 0x04034b50;
constexpr std::uint64_t kEndSize = 22, kEntrySize = 46, kLocalSize = 30;
constexpr std::uint64_t kLargestRatio = 1032;  // maximum ratio of unpacked to packed bytes in Deflate
// Limits for the unpacked size of the archive: a multiple of its own size, and a number of bytes that is always allowed
// in addition. ROIs are usually compressed to between a half and a tenth of their size.
constexpr std::uint64_t kLargestArchiveRatio = 16, kAlwaysAllowed = std::uint64_t(16) << 20;

struct Entry {
    std::string name;
    std::uint16_t flags = 0, method = 0;
    std::uint32_t checksum = 0;
    std::uint64_t packed = 0, size = 0, local = 0;
};

std::uint64_t find_end(const Bytes& bytes, const std::string& path) {
    constexpr std::uint64_t kLongestComment = 65535;
    if (bytes.size() >= kEndSize)
        for (std::uint64_t back = 0; back <= kLongestComment && back + kEndSize <= bytes.size(); ++back) {
            const std::uint64_t at = bytes.size() - kEndSize - back;
            if (bytes.at<std::uint32_t>(at) == kEndSignature) return at;
        }
    fail(path, "expected a ZIP archive, found no directory at its end; it is truncated, or not a ZIP archive");
}

Entry read_entry(const Bytes& bytes, std::uint64_t at, const std::string& path) {
    if (bytes.at<std::uint32_t>(at) != kEntrySignature) fail(path, "the ZIP archive's directory is damaged");
    Entry entry;
    entry.flags = bytes.at<std::uint16_t>(at + 8);
    entry.method = bytes.at<std::uint16_t>(at + 10);
    entry.checksum = bytes.at<std::uint32_t>(at + 16);
    entry.packed = bytes.at<std::uint32_t>(at + 20);
    entry.size = bytes.at<std::uint32_t>(at + 24);
    entry.local = bytes.at<std::uint32_t>(at + 42);
    entry.name = bytes.part(at + kEntrySize, bytes.at<std::uint16_t>(at + 28));
    return entry;
}

std::string inflate(const Entry& entry, std::string_view packed, const std::string& path) {
    std::string content(entry.size, '\0');
    z_stream stream{};
    if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) throw Error(Errc::Io, path + ": zlib could not be initialised");
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
    stream.avail_in = static_cast<uInt>(packed.size());
    stream.next_out = reinterpret_cast<Bytef*>(content.data());
    stream.avail_out = static_cast<uInt>(content.size());
    const int status = ::inflate(&stream, Z_FINISH);
    const bool whole = status == Z_STREAM_END && stream.total_out == entry.size;
    inflateEnd(&stream);
    if (!whole) fail(path, "the archive's entry " + quote(entry.name) + " cannot be unpacked; it is damaged");
    return content;
}

/// The compressed bytes of an entry, after checking that this number of bytes can expand to the entry's stated size.
std::string_view find_packed(const Bytes& bytes, const Entry& entry, const std::string& path) {
    const auto unsupported = [&](const char* what) {
        throw Error(Errc::Unsupported, path + ": entry " + quote(entry.name) + " is " + what);
    };
    if ((entry.flags & 1) != 0) unsupported("encrypted");
    if (entry.method != 0 && entry.method != 8)
        unsupported("neither stored nor deflated; create the archive again with one of these methods");
    if (entry.size == 0xFFFFFFFF || entry.packed == 0xFFFFFFFF)
        unsupported("in the ZIP64 format, which is not supported; create the archive again without ZIP64");
    if (bytes.at<std::uint32_t>(entry.local) != kLocalSignature) fail(path, "the ZIP archive's directory is damaged");
    const std::uint64_t begin = entry.local + kLocalSize + bytes.at<std::uint16_t>(entry.local + 26) +
                                bytes.at<std::uint16_t>(entry.local + 28);
    const std::string_view packed = bytes.part(begin, entry.packed);
    if (entry.size > kLargestRatio * entry.packed + 1024 || (entry.method == 0 && entry.size != entry.packed))
        fail(path, "entry " + quote(entry.name) + ": " + std::to_string(entry.packed) + " bytes cannot hold " +
                       std::to_string(entry.size) + " unpacked bytes; the archive is damaged");
    return packed;
}

std::string unpack(const Entry& entry, std::string_view packed, const std::string& path) {
    const std::string content = entry.method == 0 ? std::string(packed) : inflate(entry, packed, path);
    if (crc32(0, reinterpret_cast<const Bytef*>(content.data()), static_cast<uInt>(content.size())) != entry.checksum)
        fail(path, "entry " + quote(entry.name) + " does not match its checksum; the archive is damaged");
    return content;
}

}  // namespace

void for_each_in_zip(const std::string& path, std::string_view archive,
                     const std::function<bool(const std::string& name)>& wanted,
                     const std::function<void(const std::string& name, const std::string& bytes)>& use) {
    const Bytes bytes(archive, path, std::endian::little);
    const std::uint64_t end = find_end(bytes, path);
    const int count = bytes.at<std::uint16_t>(end + 10);
    std::uint64_t at = bytes.at<std::uint32_t>(end + 16);
    const std::uint64_t maximum = kAlwaysAllowed + kLargestArchiveRatio * bytes.size();
    std::uint64_t total = 0, unpacked = 0;
    for (int n = 0; n < count; ++n) {
        const Entry entry = read_entry(bytes, at, path);
        at += kEntrySize + entry.name.size() + bytes.at<std::uint16_t>(at + 30) + bytes.at<std::uint16_t>(at + 32);
        // In archive bombs, entries overlap, so that a small archive expands to huge contents. The sum of the packed
        // sizes then exceeds the size of the archive.
        total += entry.packed;
        if (total > bytes.size()) fail(path, "the archive's entries overlap");
        if (!wanted(entry.name)) continue;
        const std::string_view packed = find_packed(bytes, entry, path);
        unpacked += entry.size;
        if (unpacked > maximum)
            throw Error(Errc::Unsupported, path + ": an archive of " + std::to_string(bytes.size()) +
                                               " bytes claims to contain more than " + std::to_string(maximum) +
                                               " bytes, which is implausible for marks; unpack it, and give its files");
        use(entry.name, unpack(entry, packed, path));
    }
}

}  // namespace covol::detail
