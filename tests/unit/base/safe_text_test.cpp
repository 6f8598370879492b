#include "covol/safe_text.h"

#include <catch2/catch.hpp>

using covol::safe_lines;
using covol::safe_text;

TEST_CASE("safe_text: text without control characters is unchanged") {
    for (const char* text :
         {"", "two words", "Grüße 漢字 🧪", "50 µm \\ \"quoted\" 'so' $(no) `shell`", "a\xC2\xA0z"})
        CHECK(safe_text(text) == text);
}

TEST_CASE("safe_text: control characters, line separators and direction marks are escaped") {
    CHECK(safe_text("\x1b[31mred") == "\\u001b[31mred");
    CHECK(safe_text("a\nb\rc\td") == "a\\u000ab\\u000dc\\u0009d");
    CHECK(safe_text(std::string("nul\0end", 7)) == "nul\\u0000end");
    CHECK(safe_text("del\x7f") == "del\\u007f");
    // U+009B, the control sequence introducer (CSI) of terminals as one character.
    CHECK(safe_text("C1 \xC2\x9B"
                    "31m") == "C1 \\u009b31m");
    CHECK(safe_text("vdb.\xE2\x80\xAE"
                    "exe") == "vdb.\\u202eexe");  // U+202E reverses the direction of the text after it
    CHECK(safe_text("\xE2\x81\xA6\xE2\x80\x8F") == "\\u2066\\u200f");
    CHECK(safe_text("line\xE2\x80\xA8separator") == "line\\u2028separator");
}

TEST_CASE("safe_text: bytes that are not valid UTF-8 are escaped") {
    CHECK(safe_text("latin\xE9") == "latin\\xe9");
    // The byte 0x9B, which is the control sequence introducer (CSI) of 8-bit terminals.
    CHECK(safe_text("\x9b"
                    "31m") == "\\x9b31m");
    CHECK(safe_text("\xC1\x9B") == "\\xc1\\x9b");  // an overlong form of a character that needs one byte
    CHECK(safe_text("\xE0\x82\x9B") == "\\xe0\\x82\\x9b");
    CHECK(safe_text("\xED\xA0\x80") == "\\xed\\xa0\\x80");           // half of a surrogate pair
    CHECK(safe_text("\xF4\x90\x80\x80") == "\\xf4\\x90\\x80\\x80");  // beyond the last code point
    CHECK(safe_text("cut \xE2\x80") == "cut \\xe2\\x80");
}

TEST_CASE("safe_lines: line feeds are kept, and other control characters are escaped") {
    CHECK(safe_lines("one\ntwo\x1b\r\n") == "one\ntwo\\u001b\\u000d\n");
}
