#pragma once
#include "inference/lattice.h"

namespace covol::inference {

/// Minimises sum weight |grad u| + cost u over 0 <= u <= 1 on the lattice: the convex relaxation of the body of minimum
/// weighted surface and cost (Chan, Esedoglu and Nikolova, SIAM J. Appl. Math. 66(5), 2006), by the primal-dual
/// algorithm of Chambolle and Pock (J. Math. Imaging Vis. 40, 2011). The unit of length is the shortest edge of
/// a cell. Stops when less than one of 20000 nodes has changed its side of 1/2 in 25 iterations.
/// @param weight  of the surface, >= 0
/// @param cost    of including a node in the body; may be negative
/// @param iterations  maximum number
/// @param u       the initial value, and the result
void minimize_surface(const Lattice& lattice, const Field& weight, const Field& cost, int iterations, Field& u,
                      const RunContext& run);

}  // namespace covol::inference
