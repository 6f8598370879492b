#pragma once
// Bytes compressed by zlib, for files that tests write themselves.
#include <zlib.h>

#include <catch2/catch.hpp>
#include <string>

namespace covol::test {

/// @param window  of deflateInit2(): -MAX_WBITS for raw deflate, MAX_WBITS for zlib, 16 + MAX_WBITS for gzip
inline std::string deflated(const std::string& bytes, int window, int level = 9) {
    z_stream stream{};
    REQUIRE(deflateInit2(&stream, level, Z_DEFLATED, window, 8, Z_DEFAULT_STRATEGY) == Z_OK);
    std::string packed(deflateBound(&stream, bytes.size()), '\0');
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream.avail_in = uInt(bytes.size());
    stream.next_out = reinterpret_cast<Bytef*>(packed.data());
    stream.avail_out = uInt(packed.size());
    REQUIRE(deflate(&stream, Z_FINISH) == Z_STREAM_END);
    packed.resize(stream.total_out);
    deflateEnd(&stream);
    return packed;
}

}  // namespace covol::test
