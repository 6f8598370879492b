#pragma once
#include <cstdint>
#include <string>

#include "covol/fwd.h"
#include "serve/web_server.h"

namespace covol::tool {

/// A field of a request's query. @throws Error InvalidInput: it is missing, or not a whole number.
[[nodiscard]] std::int64_t number_of(const serve::Request& request, const std::string& name);

/// Three numbers that are separated by commas. @throws Error InvalidInput: it is anything else.
[[nodiscard]] Vec3 vector_of(const serve::Request& request, const std::string& name);

}  // namespace covol::tool
