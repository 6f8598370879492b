#pragma once
#include <cstdint>
#include <string>

#include "covol/fwd.h"
#include "serve/web_server.h"

namespace covol::tool {

/// A field of a request's query. @throws Error InvalidInput: there is none, or it is no whole number.
[[nodiscard]] std::int64_t number_of(const serve::Request& request, const std::string& name);

/// Three numbers that are parted by commas. @throws Error InvalidInput: it is something else.
[[nodiscard]] Vec3 vector_of(const serve::Request& request, const std::string& name);

}  // namespace covol::tool
