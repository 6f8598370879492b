#pragma once
#include <zlib.h>

#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "covol/run.h"

// Streams that gzip or zlib packed, one or several behind each other.
namespace covol::detail {

/// An unpacked view of a stream in a file, forwards.
class Inflater {
public:
    explicit Inflater(std::ifstream& file);
    ~Inflater() { inflateEnd(&stream_); }
    Inflater(const Inflater&) = delete;
    Inflater& operator=(const Inflater&) = delete;

    /// Fills `out`; false when the stream ends before, or is damaged.
    bool read(char* out, std::uint64_t count);
    /// True unless the checksum behind the last byte that was read is there and wrong.
    bool checksum_fits();

private:
    void step();

    std::ifstream& file_;
    std::vector<char> buffer_ = std::vector<char>(std::size_t(1) << 18);
    z_stream stream_{};
    bool good_ = true;
    bool damaged_ = false;
};

/// Places where a packed stream can be entered in its middle, each with the 32 KiB before it that the packed bytes
/// refer to: M. Adler's zran.c, among the examples of zlib. One for every 8 MiB of unpacked bytes, 4096 at most.
class InflateIndex {
public:
    struct Place {
        std::uint64_t unpacked = 0;  ///< bytes before it
        std::uint64_t packed = 0;    ///< offset in the file of the first whole byte
        int bits = 0;                ///< of the byte before that one, which belong to what follows
        bool at_header = false;      ///< the stream's begin
        std::vector<unsigned char> window;
    };

    /// Unpacks once the first `unpacked` bytes of the stream at `offset`, and looks at the checksum behind them where
    /// `to_the_end`. Reports "image". @throws Error InvalidInput (damaged, truncated), Io, Cancelled.
    InflateIndex(std::string path, std::uint64_t offset, std::uint64_t unpacked, bool to_the_end,
                 const RunContext& run);

    [[nodiscard]] const std::string& path() const { return path_; }
    /// The last place at or before an unpacked byte.
    [[nodiscard]] const Place& before(std::uint64_t unpacked) const;
    [[nodiscard]] std::size_t size() const { return places_.size(); }
    /// Behind the checksum of a stream another one may begin: 8 bytes of gzip, 4 of zlib.
    [[nodiscard]] std::uint64_t trailer_bytes() const { return trailer_; }

private:
    std::string path_;
    std::uint64_t trailer_ = 8;
    std::vector<Place> places_;
};

/// An unpacked view that begins anywhere.
class IndexedInflater {
public:
    IndexedInflater(const InflateIndex& index, std::uint64_t begin);
    ~IndexedInflater() { inflateEnd(&stream_); }
    IndexedInflater(const IndexedInflater&) = delete;
    IndexedInflater& operator=(const IndexedInflater&) = delete;

    /// False when the stream ends before, or is damaged.
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
    bool raw_ = false;  ///< between a header and its checksum, neither of which zlib sees
    bool good_ = true;
};

}  // namespace covol::detail
