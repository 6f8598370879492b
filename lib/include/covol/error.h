#pragma once
#include <stdexcept>
#include <string>

#include "covol/api.h"

namespace covol {

/// What kind of trouble an Error reports; the command line maps each to an exit code.
enum class Errc {
    InvalidOptions,  ///< an option is out of its range
    InvalidInput,    ///< a file or a grid holds something unusable
    Io,              ///< a file cannot be opened, read or written
    Unsupported,     ///< valid, but of a kind that covol does not handle
    Numerical,       ///< a value that is not finite appeared
    Cancelled        ///< the caller asked to stop
};

/// The one exception type that covol throws.
///
/// Messages say where, what, what was expected and what was found:
/// `read_points: cloud.xyz:18: expected 3 numbers, got 2`. Where an option would help they name its field, as
/// option_names.h tells.
class COVOL_API Error : public std::runtime_error {
public:
    Error(Errc code, const std::string& message) : std::runtime_error(message), code_(code) {}
    [[nodiscard]] Errc code() const noexcept { return code_; }
    /// The first field of options that the message names, `tag_distance` say; empty where it names none.
    [[nodiscard]] std::string option() const;

private:
    Errc code_;
};

}  // namespace covol
