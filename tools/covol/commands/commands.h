#pragma once
#include "cli/session.h"

// One function for each subcommand: declares its options and its body.
namespace covol::tool {

void add_segment(Session& session);
void add_reconstruct(Session& session);
void add_distance(Session& session);
void add_band(Session& session);
void add_edge(Session& session);
void add_evolve(Session& session);
void add_surface(Session& session);
void add_mark(Session& session);
void add_mesh(Session& session);
void add_mask(Session& session);
void add_compare(Session& session);
void add_info(Session& session);
void add_check(Session& session);
void add_convert(Session& session);
void add_render(Session& session);
void add_report(Session& session);
void add_phantom(Session& session);
void add_plan(Session& session);
void add_brick(Session& session);
void add_rerun(Session& session);
void add_demo(Session& session);
void add_doctor(Session& session);

}  // namespace covol::tool
