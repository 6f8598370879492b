#pragma once
#include <tiffio.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <string>

#include "covol/error.h"

namespace covol::detail {

/// A libtiff handle that keeps the first error message instead of printing it.
class Tiff {
public:
    /// @param largest_allocation  maximum size in bytes of one block of memory that libtiff allocates; 0: no limit
    Tiff(const std::string& path, const char* mode, std::uint64_t largest_allocation) {
        TIFFOpenOptions* options = TIFFOpenOptionsAlloc();
        TIFFOpenOptionsSetErrorHandlerExtR(options, &Tiff::keep_message, this);
        TIFFOpenOptionsSetWarningHandlerExtR(options, &Tiff::drop_message, this);
        if (largest_allocation > 0)
            TIFFOpenOptionsSetMaxSingleMemAlloc(options, static_cast<tmsize_t>(largest_allocation));
        handle_ = TIFFOpenExt(path.c_str(), mode, options);
        TIFFOpenOptionsFree(options);
    }
    ~Tiff() { close(); }
    Tiff(const Tiff&) = delete;
    Tiff& operator=(const Tiff&) = delete;

    void close() {
        if (handle_ != nullptr) TIFFClose(handle_);
        handle_ = nullptr;
    }
    [[nodiscard]] TIFF* get() const { return handle_; }
    [[nodiscard]] const std::string& message() const { return message_; }
    [[nodiscard]] Error error(Errc code, const std::string& what) const {
        return {code, what + (message_.empty() ? "" : " (" + message_ + ")")};
    }
    template <typename T>
    [[nodiscard]] T tag(ttag_t name, T fallback) const {
        T value = fallback;
        return TIFFGetFieldDefaulted(handle_, name, &value) == 1 ? value : fallback;
    }
    [[nodiscard]] std::string text(ttag_t name) const {
        const char* value = nullptr;
        return TIFFGetField(handle_, name, &value) == 1 && value != nullptr ? value : "";
    }

private:
    static int keep_message(TIFF*, void* self, const char*, const char* format, va_list arguments) {
        auto* tiff = static_cast<Tiff*>(self);
        std::array<char, 512> line{};
        std::vsnprintf(line.data(), line.size(), format, arguments);
        if (tiff->message_.empty()) tiff->message_ = line.data();
        return 1;
    }
    static int drop_message(TIFF*, void*, const char*, const char*, va_list) { return 1; }

    std::string message_;
    TIFF* handle_ = nullptr;
};

}  // namespace covol::detail
