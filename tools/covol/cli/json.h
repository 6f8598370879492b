#pragma once
#include <nlohmann/json.hpp>

namespace covol::tool {

using Json = nlohmann::ordered_json;

}  // namespace covol::tool
