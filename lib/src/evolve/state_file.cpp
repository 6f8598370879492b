#include "evolve/state_file.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "covol/error.h"

namespace covol::detail {
namespace {

constexpr std::uint64_t kMagic = 0x31304554415453ULL << 8 | 'c';  // the bytes "cSTATE01", with the format's version

std::uint32_t add_to(std::uint32_t checksum, const void* data, std::size_t count) {
    return std::uint32_t(::crc32_z(checksum, static_cast<const Bytef*>(data), count));
}

}  // namespace

StateFile::StateFile(const std::string& path, Mode mode)
    : path_(path),
      mode_(mode),
      file_(path, std::ios::binary | (mode == Mode::Read ? std::ios::in : std::ios::out | std::ios::trunc)) {
    if (!file_) throw Error(Errc::Io, path + ": cannot be opened");
    if (reads()) {
        // The whole file is checked before any of it is used.
        std::error_code status;
        const std::uint64_t size = std::filesystem::file_size(path, status);
        if (status || size < sizeof checksum_) fail();
        left_ = size - sizeof checksum_;
        std::vector<char> piece(std::size_t(std::min<std::uint64_t>(left_, 1 << 20)));
        std::uint32_t found = 0, expected = 0;
        for (std::uint64_t at = 0; at < left_; at += piece.size()) {
            const auto count = std::size_t(std::min<std::uint64_t>(piece.size(), left_ - at));
            file_.read(piece.data(), std::streamsize(count));
            found = add_to(found, piece.data(), count);
        }
        file_.read(reinterpret_cast<char*>(&expected), sizeof expected);
        if (!file_ || found != expected) fail();
        file_.seekg(0);
    }
    same(kMagic);
}

void StateFile::same(std::uint64_t number) {
    std::uint64_t found = number;
    value(found);
    if (found != number) fail();
}

void StateFile::finish() {
    if (reads()) {
        if (left_ != 0) fail();
        return;
    }
    const std::uint32_t checksum = checksum_;
    file_.write(reinterpret_cast<const char*>(&checksum), sizeof checksum);
    file_.close();
    if (!file_) throw Error(Errc::Io, path_ + ": cannot be written");
}

void StateFile::bytes(void* data, std::size_t count) {
    if (count == 0) return;
    if (reads()) {
        expect(count, count);
        file_.read(static_cast<char*>(data), std::streamsize(count));
        left_ -= count;
    } else {
        file_.write(static_cast<const char*>(data), std::streamsize(count));
        checksum_ = add_to(checksum_, data, count);
    }
    if (!file_) reads() ? fail() : throw Error(Errc::Io, path_ + ": cannot be written");
}

void StateFile::expect(std::uint64_t bytes, std::uint64_t count) const {
    if (bytes > left_ || count > left_) fail();
}

void StateFile::fail() const {
    throw Error(Errc::InvalidInput, path_ + ": expected a checkpoint of this version of covol; the file is damaged");
}

}  // namespace covol::detail
