#pragma once
#include <chrono>
#include <map>
#include <string>

namespace covol::tool {

/// Progress on stderr: a bar with percentage and remaining time on a terminal, plain lines otherwise.
class Progress {
public:
    explicit Progress(bool quiet);
    ~Progress() { clear(); }
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    /// Called through RunContext::progress.
    void update(const std::string& stage, double fraction);
    /// Erases the bar, then prints a line.
    void line(const std::string& text);
    /// Erases the bar.
    void clear();

private:
    using Clock = std::chrono::steady_clock;
    void draw(double fraction, double elapsed);

    bool quiet_;
    bool terminal_;
    bool drawn_ = false;
    bool announced_ = false;
    std::string stage_, shown_stage_;
    double fraction_ = 0;                ///< completed fraction of the current stage, 0 to 1
    std::map<std::string, int> passes_;  ///< how often each stage began
    Clock::time_point begin_;
    Clock::time_point shown_;
};

}  // namespace covol::tool
