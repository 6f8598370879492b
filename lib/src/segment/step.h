#pragma once
// What every step of segment() returns in addition to its result.
#include <chrono>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "base/number.h"
#include "covol/pipeline.h"

namespace covol::pipeline {

using detail::number;

/// The automatic choices and warnings of a step. They are for users only: no step reads them.
class Remarks {
public:
    /// Records an automatic choice, and logs it.
    void choose(const std::string& what, const std::string& value, const std::string& reason, const RunContext& run);
    /// Records a warning, and logs it.
    void warn(const std::string& line, const RunContext& run);
    /// Adds the remarks of a later step. If both contain the same choice, the later value is kept.
    void add(const Remarks& later);
    void move_to(SegmentReport& report) &&;

private:
    std::map<std::string, std::string> automatic_;
    std::vector<std::string> warnings_;
};

/// Returned by every step in addition to its result.
struct StepReport {
    Remarks remarks;
    SegmentReport::Seconds seconds;

    void add(const StepReport& later);
};

/// Adds the wall-clock time of its lifetime to `seconds`.
class Timed {
public:
    explicit Timed(double& seconds) : seconds_(seconds), begin_(std::chrono::steady_clock::now()) {}
    ~Timed() { seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count(); }
    Timed(const Timed&) = delete;
    Timed& operator=(const Timed&) = delete;

private:
    double& seconds_;
    std::chrono::steady_clock::time_point begin_;
};

}  // namespace covol::pipeline
