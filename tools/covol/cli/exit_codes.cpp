#include "cli/exit_codes.h"

namespace covol::tool {

int exit_code_of(Errc code) {
    switch (code) {
        case Errc::InvalidOptions:
        case Errc::InvalidInput:
        case Errc::Unsupported: return kBadInput;
        case Errc::Io: return kIo;
        case Errc::Numerical: return kNumerical;
        case Errc::Cancelled: return kInterrupted;
    }
    return kDefect;
}

}  // namespace covol::tool
