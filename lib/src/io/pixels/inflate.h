#pragma once
#include <zlib.h>

#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "covol/run.h"

// Decompression of gzip and zlib streams; a file may contain several streams one after another, which are read as one.
namespace covol::detail {

/// Decompresses a stream in a file sequentially.
class Inflater {
public:
    explicit Inflater(std::ifstream& file);
    ~Inflater() { inflateEnd(&stream_); }
    Inflater(const Inflater&) = delete;
    Inflater& operator=(const Inflater&) = delete;

    /// Reads `count` unpacked bytes; returns false if the stream has fewer, or is damaged.
    bool read(char* out, std::uint64_t count);
    /// Returns false if the checksum after the last byte that was read is wrong; true if it is correct or missing.
    bool checksum_fits();

private:
    void step();

    std::ifstream& file_;
    std::vector<char> buffer_ = std::vector<char>(std::size_t(1) << 18);
    z_stream stream_{};
    bool good_ = true;
    bool damaged_ = false;
};

/// Positions in a stream at which decompression can begin. Each is stored with the preceding 32 KiB of unpacked bytes,
/// to which the following data may refer, as in zran.c by M. Adler, an example of zlib. The positions are at least 8
/// MiB of unpacked bytes apart; there are at most about 4096.
class InflateIndex {
public:
    struct Place {
        std::uint64_t unpacked = 0;  ///< number of unpacked bytes before this position
        std::uint64_t packed = 0;    ///< offset in the file of the first byte that belongs wholly to the following data
        int bits = 0;                ///< number of bits of the preceding byte that belong to the following data
        /// Whether this is the beginning of the stream, where its header precedes the data.
        bool at_header = false;
        std::vector<unsigned char> window;
    };

    /// Decompresses the first `unpacked` bytes of the stream at `offset` once, and verifies the checksum after these
    /// bytes if `to_the_end` is set. Reports the progress as "image". @throws Error InvalidInput (damaged, truncated),
    /// Io, Cancelled.
    InflateIndex(std::string path, std::uint64_t offset, std::uint64_t unpacked, bool to_the_end,
                 const RunContext& run);

    [[nodiscard]] const std::string& path() const { return path_; }
    /// The last position at or before the unpacked byte with this index.
    [[nodiscard]] const Place& before(std::uint64_t unpacked) const;
    [[nodiscard]] std::size_t size() const { return places_.size(); }
    /// Size of a stream's trailer with the checksum, after which another stream may begin: 8 bytes for gzip, 4 for
    /// zlib.
    [[nodiscard]] std::uint64_t trailer_bytes() const { return trailer_; }

private:
    std::string path_;
    std::uint64_t trailer_ = 8;
    std::vector<Place> places_;
};

/// Decompresses a stream from the unpacked byte with the index `begin` on.
class IndexedInflater {
public:
    IndexedInflater(const InflateIndex& index, std::uint64_t begin);
    ~IndexedInflater() { inflateEnd(&stream_); }
    IndexedInflater(const IndexedInflater&) = delete;
    IndexedInflater& operator=(const IndexedInflater&) = delete;

    /// Returns false if the stream is damaged, or ends before `count` bytes.
    bool read(char* out, std::uint64_t count);
    bool skip(std::uint64_t count);

private:
    bool refill();
    bool drop_trailer();

    const InflateIndex& index_;
    std::ifstream file_;
    std::vector<char> buffer_ = std::vector<char>(std::size_t(1) << 18);
    std::vector<char> skipped_;
    z_stream stream_{};
    /// Whether decompression began within the stream, without its header. zlib then does not skip the checksum at the
    /// end of the stream, so drop_trailer() has to.
    bool raw_ = false;
    bool good_ = true;
};

}  // namespace covol::detail
