// Fuzzes the parser of actions, which are the messages of the page of `covol mark` and the lines of a journal. Any text
// must give an action or a covol::Error, and an action must not change if it is written as text and parsed again.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "covol/error.h"
#include "covol/study.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    try {
        const covol::KeyedAction action =
            covol::parse_study_action(std::string_view(reinterpret_cast<const char*>(data), size));
        const std::string text = covol::to_json(action);
        if (covol::to_json(covol::parse_study_action(text)) != text) std::abort();
    } catch (const covol::Error&) {
    }
    return 0;
}
