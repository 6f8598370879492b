/// A reading program for io/child_test.cpp. What it does with a piece of work is determined by the text of the piece.
#include <fcntl.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <cstring>
#include <new>
#include <stdexcept>
#include <string>

#include "io/child.h"

using namespace covol;

namespace {

void do_piece(const detail::PieceAtWork& piece) {
    const auto is = [&](const char* word) { return piece.path == word; };
    if (is("abort")) std::abort();
    if (is("segv")) raise(SIGSEGV);
    if (is("leave")) _exit(3);
    if (is("hang")) pause();
    if (is("refuse")) throw Error(Errc::Unsupported, piece.detail);
    if (is("fail")) throw std::runtime_error("a failure");
    if (is("no memory")) throw std::bad_alloc();
    if (is("variable")) std::strncpy(piece.answer.data(), std::getenv(piece.detail.c_str()) != nullptr ? "set" : "", 4);
    if (is("open")) std::strncpy(piece.answer.data(), fcntl(std::stoi(piece.detail), F_GETFD) >= 0 ? "open" : "", 5);
    for (volatile bool for_ever = is("compute"); for_ever;) continue;
    if (!piece.result.empty()) std::memcpy(piece.result.data(), &piece.task, sizeof piece.task);
}

}  // namespace

int main(int count, char** arguments) { return detail::serve_pieces(count, arguments, do_piece); }
