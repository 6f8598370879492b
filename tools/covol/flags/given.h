#pragma once
#include <algorithm>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <type_traits>

#include "cli/options/arguments.h"
#include "covol/options_table.h"

namespace covol::tool {

/// The type of a field's values, whether the field is optional or not.
template <typename T>
struct Plain {
    using type = T;
};
template <typename T>
struct Plain<std::optional<T>> {
    using type = T;
};
template <typename T>
using PlainOf = typename Plain<T>::type;

/// Options as given by the user: lengths in voxels are resolved once the voxel size is known.
template <typename Options>
struct Given {
    Options options;                                     ///< all options except lengths that were given
    std::map<std::string, Length, std::less<>> lengths;  ///< the given lengths; for a volume, the edge of a cube
    std::set<std::string, std::less<>> names;            ///< names of all options that were given

    [[nodiscard]] bool has(std::string_view name) const { return names.contains(name); }
    [[nodiscard]] Length length(std::string_view name) const {
        const auto found = lengths.find(name);
        return found != lengths.end() ? found->second : Length{};
    }
    [[nodiscard]] Options resolve(double h) const {
        Options resolved = options;
        for_each_option(resolved, [&](const OptionInfo& option, auto& value) {
            if constexpr (std::is_same_v<PlainOf<std::remove_cvref_t<decltype(value)>>, double>)
                if (const Length found = length(option.name); found.given) {
                    const double a = found.resolve(h, 0);
                    // A volume must not become infinite. It is limited to the largest double, which the validation of
                    // the option rejects.
                    value =
                        option.range.unit == Unit::Volume ? std::min(a * a * a, std::numeric_limits<double>::max()) : a;
                }
        });
        return resolved;
    }
};

}  // namespace covol::tool
