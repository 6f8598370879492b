#pragma once
#include <string>

#include "covol/error.h"

namespace covol::detail {

/// Returns the result of `work`; its errors are prefixed with the structure's name.
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
