// Messages of a page and lines of a journal: whatever a text holds, it is an action or an error, and what was read is
// written as a text that reads as the same action.
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
