#pragma once
// Zarr stores for tests: Zarr 2 with any codec, and Zarr 3 with shards.
#include <blosc.h>
#include <lz4.h>
#include <zlib.h>
#include <zstd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "io/chunked/zarr_codecs.h"

namespace zarr_stores {

inline std::string put(std::uint64_t value, int bytes) {
    std::string text;
    for (int n = 0; n < bytes; ++n) text += static_cast<char>(value >> (8 * n));
    return text;
}

inline std::string pack(const std::string& codec, const std::string& bytes) {
    std::string out(2 * bytes.size() + 1000, '\0');
    std::size_t size = 0;
    if (codec == "zstd") {
        size = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 3);
    } else if (codec == "zlib") {
        uLongf length = out.size();
        compress(reinterpret_cast<Bytef*>(out.data()), &length, reinterpret_cast<const Bytef*>(bytes.data()),
                 bytes.size());
        size = length;
    } else if (codec == "lz4") {
        size = 4 + static_cast<std::size_t>(
                       LZ4_compress_default(bytes.data(), out.data() + 4, int(bytes.size()), int(out.size()) - 4));
        out.replace(0, 4, put(bytes.size(), 4));
    } else if (codec.starts_with("blosc-")) {
        size = static_cast<std::size_t>(blosc_compress_ctx(5, 1, 2, bytes.size(), bytes.data(), out.data(), out.size(),
                                                           codec.substr(6).c_str(), 0, 1));
    } else {
        return bytes;
    }
    return out.substr(0, size);
}

inline void write(const std::string& path, const std::string& bytes) {
    std::filesystem::create_directories(std::filesystem::path(path).parent_path());
    std::ofstream(path, std::ios::binary) << bytes;
}

/// Random bytes in which only 6 bits vary, so that codecs can compress them.
inline std::string random_bytes(std::size_t count, unsigned seed) {
    std::mt19937 random(seed);
    std::string bytes(count, '\0');
    for (char& c : bytes) c = static_cast<char>(random() % 64);
    return bytes;
}

/// The metadata of an array of Zarr 2 with n^3 elements in chunks of c^3.
inline std::string metadata_2(int n, int c, const std::string& dtype, const std::string& codec,
                              const std::string& fill = "0") {
    const auto cube = [](int side) {
        const std::string s = std::to_string(side);
        return "[" + s + "," + s + "," + s + "]";
    };
    const std::string id = codec.substr(0, codec.find('-'));
    return R"({"zarr_format":2,"shape":)" + cube(n) + R"(,"chunks":)" + cube(c) + R"(,"dtype":")" + dtype +
           R"(","compressor":)" + (codec.empty() ? "null" : R"({"id":")" + id + R"("})") + R"(,"fill_value":)" + fill +
           R"(,"order":"C","filters":null,"dimension_separator":"."})";
}

/// 16^3 elements of 16 bits in 8 chunks, below a group with OME metadata. @returns the group
inline std::string write_2(const std::string& folder, const std::string& codec) {
    write(folder + "/0/.zarray", metadata_2(16, 8, "<u2", codec));
    write(folder + "/.zgroup", R"({"zarr_format":2})");
    write(folder + "/.zattrs", R"({"multiscales":[{"version":"0.4","axes":[
        {"name":"z","type":"space","unit":"micrometer"},{"name":"y","type":"space","unit":"micrometer"},
        {"name":"x","type":"space","unit":"micrometer"}],"datasets":[{"path":"0","coordinateTransformations":[
        {"type":"scale","scale":[2,0.5,0.5]},{"type":"translation","translation":[1,2,3]}]}]}]})");
    for (int n = 0; n < 8; ++n)
        write(folder + "/0/" + std::to_string(n / 4) + "." + std::to_string(n / 2 % 2) + "." + std::to_string(n % 2),
              pack(codec, random_bytes(1024, unsigned(n))));
    return folder;
}

/// 16^3 elements of 16 bits in one shard of 8 chunks, packed by zstd, one of them missing.
inline std::string write_3(const std::string& folder) {
    write(folder + "/zarr.json", R"({"zarr_format":3,"node_type":"array","shape":[16,16,16],"data_type":"uint16",
        "chunk_grid":{"name":"regular","configuration":{"chunk_shape":[16,16,16]}},
        "chunk_key_encoding":{"name":"default","configuration":{"separator":"/"}},"fill_value":7,
        "codecs":[{"name":"sharding_indexed","configuration":{"chunk_shape":[8,8,8],
        "codecs":[{"name":"bytes","configuration":{"endian":"little"}},{"name":"zstd"},{"name":"crc32c"}],
        "index_codecs":[{"name":"bytes","configuration":{"endian":"little"}},{"name":"crc32c"}],
        "index_location":"end"}}],"attributes":{}})");
    std::string body, index;
    for (int n = 0; n < 8; ++n) {
        if (n == 5) {
            index += std::string(16, '\xff');
            continue;
        }
        std::string chunk = pack("zstd", random_bytes(1024, unsigned(n)));
        chunk += put(covol::detail::crc32c(chunk.data(), chunk.size()), 4);
        index += put(body.size(), 8) + put(chunk.size(), 8);
        body += chunk;
    }
    index += put(covol::detail::crc32c(index.data(), index.size()), 4);
    write(folder + "/c/0/0/0", body + index);
    return folder;
}

}  // namespace zarr_stores
