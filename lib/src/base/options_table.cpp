#include "covol/options_table.h"

#include <cmath>

#include "base/number.h"

namespace covol {

bool Range::holds(double value) const {
    return std::isfinite(value) && (above_min ? value > min : value >= min) && (below_max ? value < max : value <= max);
}

std::string Range::text() const {
    using detail::number;
    if (std::isinf(min) && std::isinf(max)) return "a finite number";
    if (std::isinf(max)) return (above_min ? "> " : ">= ") + number(min);
    if (above_min && below_max) return "between " + number(min) + " and " + number(max);
    if (above_min || below_max)
        return (above_min ? "> " : ">= ") + number(min) + " and " + (below_max ? "< " : "<= ") + number(max);
    return number(min) + " to " + number(max);
}

void Range::require(const std::string& name, double value) const {
    if (!holds(value))
        throw Error(Errc::InvalidOptions, name + ": expected " + text() + ", got " + detail::number(value), name);
}

void add_complaint(std::string& lines, const char* name, const std::string& complaint) {
    if (!complaint.empty()) lines += (lines.empty() ? "" : "\n") + std::string(name) + ": " + complaint;
}

void complain(std::string& lines, const OptionInfo& option, double value) {
    if (!option.range.holds(value))
        add_complaint(lines, option.name, "expected " + option.range.text() + ", got " + detail::number(value));
}

}  // namespace covol
