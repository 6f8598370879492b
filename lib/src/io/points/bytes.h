#pragma once
#include <bit>
#include <cstdint>
#include <string>
#include <string_view>

#include "base/load.h"
#include "io/points/point_text.h"

namespace covol::detail {

/// Reads numbers and ranges of bytes from the contents of a file, with bounds checks.
class Bytes {
public:
    /// @param name  of the file, for messages; `data` and `name` must outlive this object
    Bytes(std::string_view data, const std::string& name, std::endian order)
        : data_(data), name_(name), swap_(order != std::endian::native) {}

    [[nodiscard]] std::uint64_t size() const { return data_.size(); }
    /// @throws Error InvalidInput if the number extends beyond the end of the file.
    template <typename T>
    [[nodiscard]] T at(std::uint64_t offset) const {
        return load<T>(part(offset, sizeof(T)).data(), swap_);
    }
    [[nodiscard]] std::string_view part(std::uint64_t offset, std::uint64_t count) const {
        if (offset > data_.size() || count > data_.size() - offset)
            fail(name_, "expected " + std::to_string(count) + " bytes at byte " + std::to_string(offset) +
                            ", but the file has " + std::to_string(data_.size()) + "; it is truncated or damaged");
        return data_.substr(offset, count);
    }

private:
    std::string_view data_;
    const std::string& name_;
    bool swap_;
};

}  // namespace covol::detail
