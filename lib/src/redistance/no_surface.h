#pragma once
#include <string>

#include "covol/error.h"

namespace covol {

/// Thrown if a level set has no zero crossing in the region in which its surface was searched for. Some callers catch
/// it; for all others it is an Error InvalidInput.
class NoSurface : public Error {
public:
    explicit NoSurface(const std::string& message) : Error(Errc::InvalidInput, message) {}
};

}  // namespace covol
