#include <cstdio>
#include <cstdlib>

#include "cli/system/thread_limit.h"
#include "commands/commands.h"

namespace covol::tool {
namespace {

int run(int argc, char** argv) {
    expect_temporary_files();
    Session session;
    add_mark(session);
    add_segment(session);
    add_reconstruct(session);
    add_distance(session);
    add_band(session);
    add_edge(session);
    add_evolve(session);
    add_surface(session);
    add_mesh(session);
    add_mask(session);
    add_compare(session);
    add_info(session);
    add_check(session);
    add_convert(session);
    add_render(session);
    add_report(session);
    add_phantom(session);
    add_plan(session);
    add_brick(session);
    add_rerun(session);
    add_demo(session);
    add_doctor(session);
    return session.main(argc, argv);
}

}  // namespace
}  // namespace covol::tool

int main(int argc, char** argv) {
    const int code = covol::tool::run(argc, argv);
    // Libraries are not finalised, because HDF5 would print errors about objects that a damaged file left invalid.
    std::fflush(nullptr);
    std::_Exit(code);
}
