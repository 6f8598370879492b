#include "cli/options/option_names.h"

#include <algorithm>

#include "covol/option_names.h"

namespace covol::tool {

std::string flag_of(const std::string& name) {
    std::string flag = "--" + name;
    std::replace(flag.begin(), flag.end(), '_', '-');
    return flag;
}

std::string with_flags(const std::string& message) {
    return replace_names(message, [](const std::string& name, const std::string& value) {
        return flag_of(name) + (value.empty() ? "" : " " + value);
    });
}

}  // namespace covol::tool
