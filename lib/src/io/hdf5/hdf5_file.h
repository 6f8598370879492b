#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/modules/hdf5_calls.h"

// Reads HDF5 files with the HDF5 library. Their contents are untrusted, because a file may come from anyone.
namespace covol::detail {

/// While an object of this class exists, only its thread uses the HDF5 library, which may have been built without
/// support for threads, and the library prints no messages. A thread may hold several objects. Calls of ITK's HDF5
/// reader need the lock, too.
class Hdf5Lock {
public:
    Hdf5Lock();
    ~Hdf5Lock();
    Hdf5Lock(const Hdf5Lock&) = delete;
    Hdf5Lock& operator=(const Hdf5Lock&) = delete;

private:
    H5E_auto2_t print_ = nullptr;
    void* data_ = nullptr;
};

/// Owns an object that the HDF5 library identifies by a number (ID). The destructor closes the object.
class Hdf5Id {
public:
    using Close = herr_t (*)(hid_t);
    Hdf5Id() = default;
    /// Takes ownership of an ID that a function of the library has returned; a negative ID means that it failed.
    Hdf5Id(hid_t id, Close close) : id_(id), close_(close) {}
    Hdf5Id(Hdf5Id&& other) noexcept;
    Hdf5Id& operator=(Hdf5Id&& other) noexcept;
    Hdf5Id(const Hdf5Id&) = delete;
    Hdf5Id& operator=(const Hdf5Id&) = delete;
    ~Hdf5Id();

    [[nodiscard]] hid_t get() const noexcept { return id_; }
    explicit operator bool() const noexcept { return id_ >= 0; }

private:
    hid_t id_ = -1;
    Close close_ = nullptr;
};

/// A file that is open for reading. Links to other files are not followed.
class Hdf5File {
public:
    /// @throws Error InvalidInput (damaged, truncated, not HDF5).
    explicit Hdf5File(std::string path);

    [[nodiscard]] const std::string& path() const noexcept { return path_; }
    [[nodiscard]] std::uint64_t bytes() const noexcept { return bytes_; }
    /// "FILE.h5:/name", for messages.
    [[nodiscard]] std::string path_of(const std::string& name) const;
    /// Whether there is such a group or dataset. Names are paths from the root.
    [[nodiscard]] bool has(const std::string& name) const;
    [[nodiscard]] bool has_dataset(const std::string& name) const;
    /// @throws Error InvalidInput if there is no such object, or if it is in another file.
    [[nodiscard]] Hdf5Id open(const std::string& name) const;
    /// The names in a group, sorted; at most 100000. Empty if `group` is not a group.
    [[nodiscard]] std::vector<std::string> members(const std::string& group) const;
    /// The paths from the root of the datasets in a group and in its subgroups, sorted. Soft links are not followed.
    [[nodiscard]] std::vector<std::string> datasets(const std::string& group) const;

    /// The numbers of an attribute; empty if there is no such attribute, or if it is not numeric or has more than 4096
    /// elements.
    [[nodiscard]] std::vector<double> numbers(const std::string& object, const char* attribute) const;
    /// The text of an attribute, which may be stored as a list of characters; empty if there is no such attribute.
    [[nodiscard]] std::string text(const std::string& object, const char* attribute) const;
    /// The texts of an attribute that is a list of texts; empty if there is no such attribute.
    [[nodiscard]] std::vector<std::string> texts(const std::string& object, const char* attribute) const;
    /// The numbers of a dataset, the last dimension fastest; empty if there is no such dataset, or if it is not numeric
    /// or has more than 4096 elements.
    [[nodiscard]] std::vector<double> table(const std::string& name) const;

private:
    [[nodiscard]] H5O_type_t type_of(const std::string& name) const;
    [[nodiscard]] Hdf5Id open_attribute(const std::string& object, const char* attribute) const;
    [[nodiscard]] std::string first_external_link(const std::string& name) const;

    std::string path_;
    std::uint64_t bytes_ = 0;
    Hdf5Id file_, access_;
};

}  // namespace covol::detail
