#pragma once
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "covol/api.h"

namespace covol {

/// The kind of problem that an Error reports; the command line maps each to an exit code.
enum class Errc {
    InvalidOptions,  ///< an option is out of its range
    InvalidInput,    ///< the content of a file or a grid cannot be used
    Io,              ///< a file cannot be opened, read or written
    Unsupported,     ///< the input is valid, but covol does not support it
    Numerical,       ///< a value that is not finite appeared
    Cancelled        ///< the caller cancelled the computation
};

/// The one exception type that covol throws.
///
/// Messages state where the problem is, what was expected and what was found: `cloud.xyz:18: expected 3 numbers, got
/// 2`. If changing an option would help, the message contains the option's name (see option_names.h).
class COVOL_API Error : public std::runtime_error {
public:
    Error(Errc code, const std::string& message, std::string option = {})
        : std::runtime_error(message), code_(code), option_(std::make_shared<const std::string>(std::move(option))) {}
    [[nodiscard]] Errc code() const noexcept { return code_; }
    /// The name of the option that is wrong or whose change would help, for example `tag_distance`; empty if there is
    /// none.
    [[nodiscard]] const std::string& option() const noexcept { return *option_; }

private:
    Errc code_;
    std::shared_ptr<const std::string> option_;  // shared, because copying an exception must not throw
};

}  // namespace covol
