#pragma once
#include "inference/lattice.h"

namespace covol::inference {

/// Minimises sum weight |grad u| + cost u over 0 <= u <= 1 on the lattice: the convex relaxation of the body whose
/// weighted surface and cost are least (Chan, Esedoglu and Nikolova, SIAM J. Appl. Math. 66(5), 2006), by the
/// primal-dual algorithm of Chambolle and Pock (J. Math. Imaging Vis. 40, 2011). Lengths are in the finest cells.
/// Ends where hardly a node (one of 20000) has changed its side of 1/2 in 25 iterations.
/// @param weight  of the surface, >= 0
/// @param cost    of a node inside
/// @param iterations  at most
/// @param u       the first guess, and the result
void minimize_surface(const Lattice& lattice, const Field& weight, const Field& cost, int iterations, Field& u,
                      const RunContext& run);

}  // namespace covol::inference
