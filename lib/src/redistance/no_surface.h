#pragma once
#include <string>

#include "covol/error.h"

namespace covol {

/// A level set has no zero crossing where its surface was searched for. Some callers handle this; for all others it is
/// invalid input.
class NoSurface : public Error {
public:
    explicit NoSurface(const std::string& message) : Error(Errc::InvalidInput, message) {}
};

}  // namespace covol
