#include "report/encoding.h"

#include <zlib.h>

#include <new>

namespace covol::detail {

std::string to_base64(const std::uint8_t* data, std::size_t count) {
    static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((count + 2) / 3 * 4);
    for (std::size_t n = 0; n < count; n += 3) {
        const std::size_t left = count - n;
        const std::uint32_t bits = std::uint32_t(data[n]) << 16U | (left > 1 ? std::uint32_t(data[n + 1]) << 8U : 0U) |
                                   (left > 2 ? std::uint32_t(data[n + 2]) : 0U);
        text += kDigits[bits >> 18U];
        text += kDigits[bits >> 12U & 63U];
        text += left > 1 ? kDigits[bits >> 6U & 63U] : '=';
        text += left > 2 ? kDigits[bits & 63U] : '=';
    }
    return text;
}

std::string deflated(const std::vector<std::uint8_t>& bytes, int level) {
    uLongf size = compressBound(bytes.size());
    std::string packed(size, '\0');
    if (compress2(reinterpret_cast<Bytef*>(packed.data()), &size, bytes.data(), bytes.size(), level) != Z_OK)
        throw std::bad_alloc();
    packed.resize(size);
    return packed;
}

std::string pack(const std::vector<std::uint8_t>& bytes) {
    constexpr int kLevel = 6;
    const std::string packed = deflated(bytes, kLevel);
    return to_base64(reinterpret_cast<const std::uint8_t*>(packed.data()), packed.size());
}

std::string safe_in_script(std::string_view json) {
    std::string text;
    text.reserve(json.size());
    for (const char c : json) switch (c) {  // JSON contains these only in strings, where they may be escaped
            case '<': text += "\\u003c"; break;
            case '>': text += "\\u003e"; break;
            case '&': text += "\\u0026"; break;
            default: text += c;
        }
    return text;
}

std::string escape_html(std::string_view text) {
    std::string safe;
    for (const char c : text) switch (c) {
            case '<': safe += "&lt;"; break;
            case '>': safe += "&gt;"; break;
            case '&': safe += "&amp;"; break;
            case '"': safe += "&quot;"; break;
            case '\'': safe += "&#39;"; break;
            default: safe += c;
        }
    return safe;
}

}  // namespace covol::detail
