#include "segment/step.h"

namespace covol::pipeline {

void Remarks::choose(const std::string& what, const std::string& value, const std::string& reason,
                     const RunContext& run) {
    const std::string line = value + (reason.empty() ? "" : " (" + reason + ")");
    automatic_[what] = line;
    run.info(what + ": " + line);
}

void Remarks::warn(const std::string& line, const RunContext& run) {
    warnings_.push_back(line);
    run.warn(line);
}

void Remarks::add(const Remarks& later) {
    for (const auto& [what, line] : later.automatic_) automatic_[what] = line;
    warnings_.insert(warnings_.end(), later.warnings_.begin(), later.warnings_.end());
}

void Remarks::move_to(SegmentReport& report) && {
    report.automatic = std::move(automatic_);
    report.warnings = std::move(warnings_);
}

void StepReport::add(const StepReport& later) {
    remarks.add(later.remarks);
    using Seconds = SegmentReport::Seconds;
    for (double Seconds::*const part : {&Seconds::read, &Seconds::distance, &Seconds::tag, &Seconds::coarse,
                                        &Seconds::edge, &Seconds::solve, &Seconds::surface, &Seconds::write})
        seconds.*part += later.seconds.*part;
}

}  // namespace covol::pipeline
