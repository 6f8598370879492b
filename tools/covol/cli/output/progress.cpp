#include "cli/output/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <string>

namespace covol::tool {
namespace {

constexpr double kRedrawSeconds = 0.1;
constexpr double kLineSeconds = 5.0;  // interval between lines of a stage if stderr is not a terminal
constexpr int kBarWidth = 30;

double seconds_since(std::chrono::steady_clock::time_point begin) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

std::string percentage_and_time_left(double fraction, double elapsed) {
    char text[64];
    const double left = fraction > 0 ? elapsed * (1 - fraction) / fraction : 0;
    if (fraction > 0.02 && elapsed > 0.5)
        std::snprintf(text, sizeof text, "%3.0f %%, %.0f s left", 100 * fraction, left);
    else
        std::snprintf(text, sizeof text, "%3.0f %%", 100 * fraction);
    return text;
}

}  // namespace

Progress::Progress(bool quiet) : quiet_(quiet), terminal_(::isatty(STDERR_FILENO) == 1) {}

void Progress::update(const std::string& stage, double fraction) {
    if (quiet_) return;
    fraction = std::clamp(fraction, 0.0, 1.0);
    // A stage that begins again, for another structure or a finer level, gets another line. Within a stage, the
    // displayed fraction never decreases.
    const bool again = stage == stage_ && fraction_ >= 1 && fraction < 1;
    if (stage != stage_ || again) {
        clear();
        stage_ = stage;
        fraction_ = 0;
        const int pass = ++passes_[stage];
        shown_stage_ = stage + (pass > 1 ? " (" + std::to_string(pass) + ")" : "");
        begin_ = shown_ = Clock::now();
        announced_ = false;
    }
    fraction = fraction_ = std::max(fraction, fraction_);
    const double elapsed = seconds_since(begin_);
    if (terminal_) {
        if (fraction >= 1) {
            clear();
        } else if (!drawn_ || seconds_since(shown_) > kRedrawSeconds) {
            draw(fraction, elapsed);
            shown_ = Clock::now();
        }
    } else if (seconds_since(shown_) > kLineSeconds || (announced_ && fraction >= 1)) {
        std::fprintf(stderr, "covol: %s: %s\n", shown_stage_.c_str(),
                     percentage_and_time_left(fraction, elapsed).c_str());
        shown_ = Clock::now();
        announced_ = fraction < 1;
    }
}

void Progress::draw(double fraction, double elapsed) {
    const int filled = static_cast<int>(fraction * kBarWidth);
    const std::string bar = std::string(filled, '#') + std::string(kBarWidth - filled, '.');
    std::fprintf(stderr, "\r\033[Kcovol: %-9s [%s] %s", shown_stage_.c_str(), bar.c_str(),
                 percentage_and_time_left(fraction, elapsed).c_str());
    std::fflush(stderr);
    drawn_ = true;
}

void Progress::line(const std::string& text) {
    clear();
    std::fprintf(stderr, "%s\n", text.c_str());
}

void Progress::clear() {
    if (drawn_) std::fputs("\r\033[K", stderr);
    drawn_ = false;
}

}  // namespace covol::tool
