#include "io/chunked/zarr_store.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "base/text.h"
#include "io/pixels/raw_image.h"

namespace covol::detail {
namespace {

constexpr std::uint64_t kMaxJson = std::uint64_t(64) << 20;
constexpr int kDeepestJson = 64;

Error cannot_read(const std::string& path, int code) {
    return read_error(Errc::Io, path, std::string("cannot be read: ") + std::strerror(code));
}

}  // namespace

std::optional<StoreFile> StoreFile::open(const std::string& path) {
    // Without O_NONBLOCK, opening a named pipe would wait for a writer.
    const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (file < 0 && errno == ENOENT) return std::nullopt;
    if (file < 0) throw cannot_read(path, errno);
    struct stat status {};
    const bool known = ::fstat(file, &status) == 0;
    if (!known || !S_ISREG(status.st_mode)) {
        ::close(file);
        throw read_error(Errc::Io, path, "expected a file");
    }
    return StoreFile(path, file, std::uint64_t(status.st_size));
}

StoreFile::StoreFile(StoreFile&& other) noexcept
    : path_(std::move(other.path_)), file_(std::exchange(other.file_, -1)), size_(other.size_) {}

StoreFile::~StoreFile() {
    if (file_ >= 0) ::close(file_);
}

Bytes StoreFile::read(std::uint64_t begin, std::uint64_t count) const {
    const auto truncated = [&](std::uint64_t there) {
        return read_error(Errc::InvalidInput, path_,
                          "truncated: expected " + std::to_string(count) + " bytes from byte " + std::to_string(begin) +
                              " on, got " + std::to_string(there));
    };
    if (begin > size_ || count > size_ - begin) throw truncated(begin > size_ ? 0 : size_ - begin);
    Bytes bytes(count);
    for (std::uint64_t done = 0; done < count;) {
        const ssize_t got = ::pread(file_, bytes.data() + done, count - done, off_t(begin + done));
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) throw cannot_read(path_, errno);
        if (got == 0) throw truncated(done);
        done += std::uint64_t(got);
    }
    return bytes;
}

std::optional<Json> read_json(const std::string& path) {
    const std::optional<StoreFile> file = StoreFile::open(path);
    if (!file) return std::nullopt;
    if (file->size() > kMaxJson)
        throw read_error(Errc::InvalidInput, path,
                         "expected metadata of 64 MiB at most, got " + std::to_string(file->size()) + " bytes");
    const Bytes text = file->read(0, file->size());
    return parse_json(path, {text.data(), text.size()});
}

Json parse_json(const std::string& path, std::string_view text) {
    const auto check_depth = [&](int depth, Json::parse_event_t, const Json&) {
        if (depth > kDeepestJson)
            throw read_error(Errc::InvalidInput, path,
                             "its JSON is nested more than " + std::to_string(kDeepestJson) + " deep");
        return true;
    };
    try {
        Json json = Json::parse(text.begin(), text.end(), check_depth);
        if (!json.is_object()) throw read_error(Errc::InvalidInput, path, "expected a JSON object");
        return json;
    } catch (const Json::exception& error) {
        const auto* parsing = dynamic_cast<const Json::parse_error*>(&error);
        throw read_error(Errc::InvalidInput, path,
                         "it is not valid JSON" +
                             (parsing != nullptr ? ", from byte " + std::to_string(parsing->byte) + " on" : ""));
    }
}

const Json& member(const Json& object, const char* key) {
    static const Json kNull;
    if (!object.is_object()) return kNull;
    const auto found = object.find(key);
    return found == object.end() ? kNull : *found;
}

std::string text_of(const Json& value) { return value.is_string() ? value.get<std::string>() : std::string(); }

std::string path_within(const std::string& path, const std::string& folder, const std::string& inside) {
    namespace fs = std::filesystem;
    const fs::path relative = inside;
    bool good = !inside.empty() && relative.is_relative() && inside.find('\0') == std::string::npos;
    for (const fs::path& part : relative) good = good && part != "..";
    if (!good)
        throw read_error(Errc::InvalidInput, path, "expected the path of an array below it, got " + quote(inside));
    const fs::path normal = (fs::path(folder) / relative).lexically_normal();
    return (normal.has_filename() ? normal : normal.parent_path()).string();
}

}  // namespace covol::detail
