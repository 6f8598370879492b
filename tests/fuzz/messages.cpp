// Messages of a page and lines of a journal: any text is either an action or an error, and an action that was read is
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
