#include "commands/commands.h"

int main(int argc, char** argv) {
    using namespace covol::tool;
    Session session;
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
    return session.main(argc, argv);
}
