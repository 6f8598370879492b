#include "io/pixels/inflate.h"

#include <algorithm>

#include "io/pixels/raw_image.h"

namespace covol::detail {
namespace {

// [zlib windowBits] The maximum window (15); adding 32 accepts headers of gzip and zlib.
constexpr int kAnyHeader = 15 + 32;
constexpr int kNoHeader = -15;
constexpr std::size_t kWindow = 32768;
constexpr std::uint64_t kMinGap = std::uint64_t(8) << 20;
constexpr std::uint64_t kMaxPlaces = 4096;

}  // namespace

Inflater::Inflater(std::ifstream& file) : file_(file) { good_ = inflateInit2(&stream_, kAnyHeader) == Z_OK; }

bool Inflater::read(char* out, std::uint64_t count) {
    while (good_ && count > 0) {
        const std::uint64_t piece = std::min<std::uint64_t>(count, 1U << 30);
        stream_.next_out = reinterpret_cast<Bytef*>(out);
        stream_.avail_out = static_cast<uInt>(piece);
        step();
        const std::uint64_t done = piece - stream_.avail_out;
        out += done;
        count -= done;
    }
    return count == 0;
}

bool Inflater::checksum_fits() {
    char more = 0;
    stream_.next_out = reinterpret_cast<Bytef*>(&more);
    stream_.avail_out = 1;
    if (good_) step();
    return !damaged_;
}

void Inflater::step() {
    if (stream_.avail_in == 0) {
        file_.read(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
        stream_.next_in = reinterpret_cast<Bytef*>(buffer_.data());
        stream_.avail_in = static_cast<uInt>(file_.gcount());
        if (stream_.avail_in == 0) good_ = false;
    }
    const int status = good_ ? inflate(&stream_, Z_NO_FLUSH) : Z_OK;
    // A file may contain several gzip streams, one after another; the next stream begins here.
    if (status == Z_STREAM_END)
        good_ = inflateReset(&stream_) == Z_OK;
    else if (status != Z_OK && status != Z_BUF_ERROR) {
        good_ = false;
        damaged_ = true;
    }
}

InflateIndex::InflateIndex(std::string path, std::uint64_t offset, std::uint64_t unpacked, bool to_the_end,
                           const RunContext& run)
    : path_(std::move(path)) {
    const std::uint64_t gap = std::max(kMinGap, unpacked / kMaxPlaces);
    const auto damaged = [&] { return read_error(Errc::InvalidInput, path_, "damaged or truncated"); };
    std::ifstream file(path_, std::ios::binary);
    file.seekg(static_cast<std::streamoff>(offset));
    if (!file) throw read_error(Errc::Io, path_, "cannot be opened");
    std::vector<char> in(std::size_t(1) << 18), out(std::size_t(1) << 18);
    z_stream stream{};
    if (inflateInit2(&stream, kAnyHeader) != Z_OK) throw damaged();
    const struct End {
        z_stream& stream;
        ~End() { inflateEnd(&stream); }
    } end{stream};
    Place begin;
    begin.packed = offset;
    begin.at_header = true;
    places_.push_back(std::move(begin));
    std::uint64_t packed = 0, done = 0, reported = 0;
    bool first = true, ended = false;
    // If `to_the_end` is set, decompression continues after the last requested byte to the end of the stream, where
    // zlib verifies the checksum. A file that ends before the checksum is accepted.
    while (done < unpacked || (to_the_end && !ended)) {
        if (stream.avail_in == 0) {
            run.check();
            file.read(in.data(), static_cast<std::streamsize>(in.size()));
            stream.next_in = reinterpret_cast<Bytef*>(in.data());
            stream.avail_in = static_cast<uInt>(file.gcount());
            if (stream.avail_in == 0 && done < unpacked) throw damaged();
            if (stream.avail_in == 0) return;
            if (first && static_cast<unsigned char>(in[0]) != 0x1F) trailer_ = 4;
            first = false;
        }
        const auto before_in = stream.avail_in;
        const auto room = uInt(std::min<std::uint64_t>(out.size(), std::max<std::uint64_t>(unpacked - done, 1)));
        const bool all_there = done == unpacked;
        stream.next_out = reinterpret_cast<Bytef*>(out.data());
        stream.avail_out = room;
        const int status = inflate(&stream, Z_BLOCK);
        packed += before_in - stream.avail_in;
        done += room - stream.avail_out;
        if (status == Z_STREAM_END) {
            ended = done >= unpacked;
            if (inflateReset(&stream) != Z_OK) throw damaged();
        } else if (status != Z_OK && status != Z_BUF_ERROR) {
            throw damaged();
        }
        // The stream has more bytes than were requested, so its checksum does not follow the requested bytes.
        if (all_there && done > unpacked) return;
        const bool at_block = (stream.data_type & 128) != 0 && (stream.data_type & 64) == 0 && status == Z_OK;
        if (at_block && done >= places_.back().unpacked + gap) {
            Place place;
            place.unpacked = done;
            place.packed = offset + packed;
            place.bits = stream.data_type & 7;
            place.window.resize(kWindow);
            uInt length = 0;
            inflateGetDictionary(&stream, place.window.data(), &length);
            place.window.resize(length);
            place.window.shrink_to_fit();
            places_.push_back(std::move(place));
        }
        constexpr std::uint64_t kReportEvery = std::uint64_t(64) << 20;
        if (done >= reported + kReportEvery) {
            reported = done;
            run.report("image", double(done) / double(unpacked));
        }
    }
}

const InflateIndex::Place& InflateIndex::before(std::uint64_t unpacked) const {
    const auto after = std::upper_bound(places_.begin(), places_.end(), unpacked,
                                        [](std::uint64_t at, const Place& place) { return at < place.unpacked; });
    return *std::prev(after);
}

IndexedInflater::IndexedInflater(const InflateIndex& index, std::uint64_t begin)
    : index_(index), file_(index.path(), std::ios::binary) {
    const InflateIndex::Place& place = index.before(begin);
    raw_ = !place.at_header;
    good_ = inflateInit2(&stream_, raw_ ? kNoHeader : kAnyHeader) == Z_OK;
    file_.seekg(static_cast<std::streamoff>(place.packed - (place.bits > 0 ? 1 : 0)));
    good_ = good_ && file_;
    if (good_ && raw_) {
        if (place.bits > 0) good_ = inflatePrime(&stream_, place.bits, file_.get() >> (8 - place.bits)) == Z_OK;
        good_ = good_ && inflateSetDictionary(&stream_, place.window.data(), uInt(place.window.size())) == Z_OK;
    }
    good_ = good_ && skip(begin - place.unpacked);
}

bool IndexedInflater::refill() {
    if (stream_.avail_in > 0) return true;
    file_.read(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
    stream_.next_in = reinterpret_cast<Bytef*>(buffer_.data());
    stream_.avail_in = static_cast<uInt>(file_.gcount());
    return stream_.avail_in > 0;
}

bool IndexedInflater::drop_trailer() {
    for (std::uint64_t left = index_.trailer_bytes(); left > 0;) {
        if (!refill()) return false;
        const auto piece = uInt(std::min<std::uint64_t>(left, stream_.avail_in));
        stream_.next_in += piece;
        stream_.avail_in -= piece;
        left -= piece;
    }
    return true;
}

bool IndexedInflater::read(char* out, std::uint64_t count) {
    while (good_ && count > 0) {
        const std::uint64_t piece = std::min<std::uint64_t>(count, 1U << 30);
        stream_.next_out = reinterpret_cast<Bytef*>(out);
        stream_.avail_out = static_cast<uInt>(piece);
        good_ = refill();
        const int status = good_ ? inflate(&stream_, Z_NO_FLUSH) : Z_OK;
        if (status == Z_STREAM_END) {
            good_ = (!raw_ || drop_trailer()) && inflateReset2(&stream_, kAnyHeader) == Z_OK;
            raw_ = false;
        } else if (status != Z_OK && status != Z_BUF_ERROR) {
            good_ = false;
        }
        const std::uint64_t done = piece - stream_.avail_out;
        out += done;
        count -= done;
    }
    return count == 0;
}

bool IndexedInflater::skip(std::uint64_t count) {
    skipped_.resize(std::max<std::size_t>(skipped_.size(), std::min<std::uint64_t>(count, 1U << 16)));
    while (count > 0) {
        const std::uint64_t piece = std::min<std::uint64_t>(count, skipped_.size());
        if (!read(skipped_.data(), piece)) return false;
        count -= piece;
    }
    return good_;
}

}  // namespace covol::detail
