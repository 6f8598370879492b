#pragma once
#include <string>

#include "covol/error.h"

namespace covol {

/// Nothing lies on both sides of a level set in the place where its surface was looked for. Some callers expect that;
/// for all others it is invalid input.
class NoSurface : public Error {
public:
    explicit NoSurface(const std::string& message) : Error(Errc::InvalidInput, message) {}
};

}  // namespace covol
