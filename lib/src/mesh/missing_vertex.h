#pragma once
#include <cstdint>
#include <string>

namespace covol::detail {

/// For error messages: "refers to vertex 7 (counted from 0), but the number of vertices is 7".
inline std::string refers_to_missing(std::uint64_t vertex, std::uint64_t count) {
    return "refers to vertex " + std::to_string(vertex) + " (counted from 0), but the number of vertices is " +
           std::to_string(count);
}

}  // namespace covol::detail
