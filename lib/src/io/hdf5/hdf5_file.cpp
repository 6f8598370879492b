#include "io/hdf5/hdf5_file.h"

#include <algorithm>
#include <filesystem>
#include <mutex>
#include <set>
#include <utility>

#include "io/pixels/raw_image.h"

namespace covol::detail {
namespace {

constexpr std::uint64_t kMaxNumbers = 4096;
constexpr std::uint64_t kMaxText = std::uint64_t(1) << 20;

std::mutex& library_mutex() {
    static std::mutex mutex;
    return mutex;
}

// Number of Hdf5Lock objects that this thread holds; only the first of them locks the mutex.
thread_local int held_locks = 0;

herr_t refuse_link(const char*, const char*, const char*, const char*, unsigned*, hid_t, void*) { return -1; }

herr_t add_name(hid_t, const char* name, const H5L_info_t*, void* list) {
    constexpr std::size_t kMaxNames = 100000;
    auto& names = *static_cast<std::vector<std::string>*>(list);
    names.emplace_back(name);
    return names.size() < kMaxNames ? 0 : 1;
}

/// Number of elements in a simple dataspace; 0 if the dataspace is not simple, or has more than `maximum` elements.
std::uint64_t count_of(const Hdf5Id& space, std::uint64_t maximum) {
    if (!space || H5Sget_simple_extent_type(space.get()) == H5S_NULL) return 0;
    const hssize_t count = H5Sget_simple_extent_npoints(space.get());
    return count > 0 && std::uint64_t(count) <= maximum ? std::uint64_t(count) : 0;
}

bool holds_numbers(const Hdf5Id& type) {
    const H5T_class_t kind = type ? H5Tget_class(type.get()) : H5T_NO_CLASS;
    return kind == H5T_INTEGER || kind == H5T_FLOAT;
}

/// The text up to the first zero byte, with which HDF5 pads texts.
std::string cut(const char* begin, std::size_t size) { return {begin, std::find(begin, begin + size, '\0')}; }

std::vector<std::string> strings_of(const Hdf5Id& attribute) {
    std::vector<std::string> texts;
    const Hdf5Id type(H5Aget_type(attribute.get()), H5Tclose), space(H5Aget_space(attribute.get()), H5Sclose);
    const std::uint64_t count = count_of(space, kMaxNumbers);
    if (count == 0 || !type || H5Tget_class(type.get()) != H5T_STRING) return texts;
    if (H5Tis_variable_str(type.get()) > 0) {
        std::vector<char*> read(count, nullptr);
        const Hdf5Id memory(H5Tcopy(type.get()), H5Tclose);
        if (H5Aread(attribute.get(), memory.get(), static_cast<void*>(read.data())) < 0) return texts;
        for (const char* text : read) texts.emplace_back(text == nullptr ? "" : text);
        H5Dvlen_reclaim(memory.get(), space.get(), H5P_DEFAULT, static_cast<void*>(read.data()));
        return texts;
    }
    const std::size_t width = H5Tget_size(type.get());
    if (width == 0 || width > kMaxText / count) return texts;
    std::vector<char> read(count * width);
    if (H5Aread(attribute.get(), type.get(), read.data()) < 0) return texts;
    for (std::uint64_t n = 0; n < count; ++n) texts.push_back(cut(read.data() + n * width, width));
    return texts;
}

}  // namespace

Hdf5Lock::Hdf5Lock() {
    hdf5_module();  // loads the HDF5 library, and throws if this fails; therefore before the mutex is locked
    if (held_locks++ == 0) library_mutex().lock();
    H5Eget_auto2(H5E_DEFAULT, &print_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

Hdf5Lock::~Hdf5Lock() {
    H5Eset_auto2(H5E_DEFAULT, print_, data_);
    if (--held_locks == 0) library_mutex().unlock();
}

Hdf5Id::Hdf5Id(Hdf5Id&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}

Hdf5Id& Hdf5Id::operator=(Hdf5Id&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
}

Hdf5Id::~Hdf5Id() {
    if (id_ < 0) return;
    const Hdf5Lock lock;
    close_(id_);
}

Hdf5File::Hdf5File(std::string path) : path_(std::move(path)) {
    const Hdf5Lock lock;
    std::error_code status;
    bytes_ = std::filesystem::file_size(path_, status);
    const Hdf5Id how(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    // The file stays open until all its objects are closed. It is locked against writers unless the file system does
    // not support locks.
    H5Pset_fclose_degree(how.get(), H5F_CLOSE_WEAK);
    H5Pset_file_locking(how.get(), true, true);
    file_ = Hdf5Id(H5Fopen(path_.c_str(), H5F_ACC_RDONLY, how.get()), H5Fclose);
    if (!file_)
        throw read_error(Errc::InvalidInput, path_,
                         "damaged, truncated, open for writing elsewhere, or not an HDF5 file");
    access_ = Hdf5Id(H5Pcreate(H5P_LINK_ACCESS), H5Pclose);
    H5Pset_elink_cb(access_.get(), refuse_link, nullptr);
}

std::string Hdf5File::path_of(const std::string& name) const {
    return path_ + ":" + (name.empty() || name.front() != '/' ? "/" : "") + name;
}

bool Hdf5File::has(const std::string& name) const {
    const Hdf5Lock lock;
    return H5Oexists_by_name(file_.get(), name.c_str(), access_.get()) > 0;
}

H5O_type_t Hdf5File::type_of(const std::string& name) const {
    const Hdf5Lock lock;
    H5O_info_t info{};
    const bool known = H5Oget_info_by_name2(file_.get(), name.c_str(), &info, H5O_INFO_BASIC, access_.get()) >= 0;
    return known ? info.type : H5O_TYPE_UNKNOWN;
}

bool Hdf5File::has_dataset(const std::string& name) const { return type_of(name) == H5O_TYPE_DATASET; }

std::string Hdf5File::first_external_link(const std::string& name) const {
    for (std::size_t end = name.find('/', 1);; end = name.find('/', end + 1)) {
        std::string part = name.substr(0, end);
        H5L_info_t link{};
        if (part.empty() || H5Lget_info(file_.get(), part.c_str(), &link, access_.get()) < 0) return "";
        if (link.type == H5L_TYPE_EXTERNAL) return part;
        if (end == std::string::npos) return "";
    }
}

Hdf5Id Hdf5File::open(const std::string& name) const {
    const Hdf5Lock lock;
    Hdf5Id object(H5Oopen(file_.get(), name.c_str(), access_.get()), H5Oclose);
    if (object) return object;
    const std::string link = first_external_link(name);
    if (!link.empty())
        throw read_error(Errc::Unsupported, path_of(name),
                         link + " is a link into another file, which is not followed; give that file");
    throw read_error(Errc::InvalidInput, path_of(name),
                     has(name) ? "damaged or truncated" : "the file has no such dataset");
}

std::vector<std::string> Hdf5File::members(const std::string& group) const {
    const Hdf5Lock lock;
    std::vector<std::string> names;
    hsize_t next = 0;
    H5Literate_by_name(file_.get(), group.c_str(), H5_INDEX_NAME, H5_ITER_NATIVE, &next, add_name, &names,
                       access_.get());
    std::sort(names.begin(), names.end());
    return names;
}

std::vector<std::string> Hdf5File::datasets(const std::string& group) const {
    constexpr int kDeepest = 16;
    constexpr std::size_t kMaxObjects = 100000;
    const Hdf5Lock lock;
    std::vector<std::string> found, groups{group};
    std::set<haddr_t> seen;  // addresses of the objects seen so far, because hard links may form cycles
    H5O_info_t top{};
    if (H5Oget_info_by_name2(file_.get(), group.c_str(), &top, H5O_INFO_BASIC, access_.get()) >= 0)
        seen.insert(top.addr);
    std::size_t looked_at = 0;
    for (int depth = 0; depth < kDeepest && !groups.empty(); ++depth) {
        std::vector<std::string> below;
        for (const std::string& parent : groups)
            for (const std::string& name : members(parent)) {
                const std::string whole = (parent == "/" ? "" : parent) + "/" + name;
                H5L_info_t link{};
                H5O_info_t info{};
                if (++looked_at > kMaxObjects) return found;
                if (H5Lget_info(file_.get(), whole.c_str(), &link, access_.get()) < 0 || link.type != H5L_TYPE_HARD)
                    continue;
                if (H5Oget_info_by_name2(file_.get(), whole.c_str(), &info, H5O_INFO_BASIC, access_.get()) < 0 ||
                    !seen.insert(info.addr).second)
                    continue;
                if (info.type == H5O_TYPE_DATASET) found.push_back(whole);
                if (info.type == H5O_TYPE_GROUP) below.push_back(whole);
            }
        groups = std::move(below);
    }
    std::sort(found.begin(), found.end());
    return found;
}

Hdf5Id Hdf5File::open_attribute(const std::string& object, const char* attribute) const {
    if (H5Aexists_by_name(file_.get(), object.c_str(), attribute, access_.get()) <= 0) return {};
    return {H5Aopen_by_name(file_.get(), object.c_str(), attribute, H5P_DEFAULT, access_.get()), H5Aclose};
}

std::vector<double> Hdf5File::numbers(const std::string& object, const char* attribute) const {
    const Hdf5Lock lock;
    const Hdf5Id opened = open_attribute(object, attribute);
    if (!opened) return {};
    const Hdf5Id type(H5Aget_type(opened.get()), H5Tclose), space(H5Aget_space(opened.get()), H5Sclose);
    std::vector<double> values(holds_numbers(type) ? count_of(space, kMaxNumbers) : 0);
    if (values.empty() || H5Aread(opened.get(), H5T_NATIVE_DOUBLE, values.data()) < 0) return {};
    return values;
}

std::vector<std::string> Hdf5File::texts(const std::string& object, const char* attribute) const {
    const Hdf5Lock lock;
    const Hdf5Id opened = open_attribute(object, attribute);
    return opened ? strings_of(opened) : std::vector<std::string>();
}

std::string Hdf5File::text(const std::string& object, const char* attribute) const {
    std::string text;
    for (const std::string& part : texts(object, attribute)) text += part;
    return text;
}

std::vector<double> Hdf5File::table(const std::string& name) const {
    const Hdf5Lock lock;
    const Hdf5Id object(has_dataset(name) ? H5Oopen(file_.get(), name.c_str(), access_.get()) : -1, H5Oclose);
    if (!object) return {};
    const Hdf5Id type(H5Dget_type(object.get()), H5Tclose), space(H5Dget_space(object.get()), H5Sclose);
    std::vector<double> values(holds_numbers(type) ? count_of(space, kMaxNumbers) : 0);
    if (values.empty() || H5Dread(object.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
        return {};
    return values;
}

}  // namespace covol::detail
