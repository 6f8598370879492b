#pragma once
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

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
/// `cloud.xyz:18: expected 3 numbers, got 2`. Where an option would help they name its field, as
/// option_names.h tells.
class COVOL_API Error : public std::runtime_error {
public:
    Error(Errc code, const std::string& message, std::string option = {})
        : std::runtime_error(message), code_(code), option_(std::make_shared<const std::string>(std::move(option))) {}
    [[nodiscard]] Errc code() const noexcept { return code_; }
    /// The field of options that is wrong, or that would help, `tag_distance` say; empty where there is none.
    [[nodiscard]] const std::string& option() const noexcept { return *option_; }

private:
    Errc code_;
    std::shared_ptr<const std::string> option_;  // exceptions must not throw where they are copied
};

}  // namespace covol
