#pragma once
#include <string>

#include "covol/error.h"

namespace covol::detail {

/// Returns the result of work(). The messages of errors that it throws are prefixed with `name`, that of the structure.
template <typename Work>
auto with_name(const std::string& name, const Work& work) {
    try {
        return work();
    } catch (const Error& error) {
        if (name.empty()) throw;
        throw Error(error.code(), name + ": " + error.what(), error.option());
    }
}

}  // namespace covol::detail
