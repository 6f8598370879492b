#pragma once
// What the why_invalid() of options are made of.
#include <cmath>
#include <optional>
#include <string>

#include "base/number.h"
#include "covol/error.h"

namespace covol::detail {

/// Checks fields one after the other; each bad one makes a line, "tau: expected > 0, got -1".
class FieldChecks {
public:
    void expect(bool ok, const char* field, const std::string& expected, const std::string& got) {
        if (!ok) add(std::string(field) + ": expected " + expected + ", got " + got);
    }
    void expect(bool ok, const char* field, const std::string& expected, double got) {
        expect(ok, field, expected, number(got));
    }
    void expect_finite(const char* field, double got) { expect(std::isfinite(got), field, "a finite number", got); }
    void expect_positive(const char* field, double got) { expect(got > 0 && std::isfinite(got), field, "> 0", got); }
    void expect_not_negative(const char* field, double got) {
        expect(got >= 0 && std::isfinite(got), field, ">= 0", got);
    }
    /// Without a value a field is automatic, and fine.
    void expect_positive(const char* field, const std::optional<double>& got) {
        if (got) expect_positive(field, *got);
    }
    void expect_not_negative(const char* field, const std::optional<double>& got) {
        if (got) expect_not_negative(field, *got);
    }
    void expect_share(const char* field, const std::optional<double>& got) {
        if (got) expect_share(field, *got);
    }
    void expect_share(const char* field, double got) { expect(got >= 0 && got <= 1, field, "0 to 1", got); }
    /// The lines of a part's own why_invalid().
    void add(const std::string& lines) {
        if (!lines.empty()) lines_ += (lines_.empty() ? "" : "\n") + lines;
    }

    /// Empty where all is well.
    [[nodiscard]] const std::string& lines() const { return lines_; }

private:
    std::string lines_;
};

/// @throws Error InvalidOptions, "function: field: expected ...".
template <typename Options>
void require_valid(const Options& options, const char* function) {
    if (const std::string why = options.why_invalid(); !why.empty())
        throw Error(Errc::InvalidOptions, std::string(function) + ": " + why);
}

}  // namespace covol::detail
