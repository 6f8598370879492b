"""The surface of minimum bending energy through few marks, without normals: Huang, Carr and Ju, "Variational implicit point set
surfaces", SIGGRAPH 2019. Dense linear algebra, for up to a few hundred marks.

f(x) = sum_j a_j |x-x_j|^3 + b_j . grad |x-x_j|^3 + c0 + c . x has the minimum energy J (of third derivatives) among all functions
with given values s_j and gradients g_j at the marks. J is a quadratic form in (s, g). The unknowns are unit vectors g, and values
s that may differ from zero because marks are imprecise: min J(s, g) + |s|^2 / lambda. f < 0 inside.
"""
import numpy as np
from scipy import linalg
from scipy.linalg import lapack
from scipy.optimize import minimize
from scipy.spatial.distance import cdist

LAMBDA = 0.03  # weight of smoothing against the distances at the marks, after scaling the marks to a unit ball


class Surface:
    def __init__(self, marks, smoothing=LAMBDA):
        """@param marks  at least 4 positions, not in one plane; world units"""
        marks = np.asarray(marks, float)
        self.centre = marks.mean(0)
        self.radius = np.linalg.norm(marks - self.centre, axis=1).max()
        self.x = (marks - self.centre) / self.radius
        n = len(marks)
        self._kernel, self._linear = self._system()
        energy = self._energy()
        values, mixed, gradients = energy[:n, :n], energy[:n, n:], energy[n:, n:]
        # For given gradients g at the marks, the values at the marks that minimise the energy are `follow @ g`. With
        # these, the energy is a quadratic form of g alone.
        follow = -linalg.solve(np.eye(n) + smoothing * values, smoothing * mixed, assume_a="pos")
        form = gradients + mixed.T @ follow
        normals = self._unit_vectors((form + form.T) / 2)
        self._weights(energy, np.r_[follow @ normals, normals])
        self._point_outwards()

    def _system(self):
        """The energy's kernel between values and gradients (4n x 4n), and the functions of zero energy (4n x 4)."""
        n = len(self.x)
        way = self.x[:, None] - self.x[None]
        r = np.linalg.norm(way, axis=2)
        with np.errstate(invalid="ignore", divide="ignore"):
            along = np.where(r > 0, 1 / r, 0)
        first = 3 * r[..., None] * way
        second = 3 * (r[..., None, None] * np.eye(3) + along[..., None, None] * way[..., :, None] * way[..., None, :])
        kernel = np.empty((4 * n, 4 * n))
        kernel[:n, :n] = r**3
        kernel[:n, n:] = -first.reshape(n, 3 * n)
        kernel[n:, :n] = kernel[:n, n:].T
        kernel[n:, n:] = -second.transpose(0, 2, 1, 3).reshape(3 * n, 3 * n)
        linear = np.zeros((4 * n, 4))
        linear[:n, 0], linear[:n, 1:] = 1, self.x
        linear[n:, 1:] = np.tile(np.eye(3), (n, 1))
        return kernel, linear

    def _energy(self):
        """J as a matrix: the kernel's inverse on the orthogonal complement of the linear functions."""
        free = linalg.qr(self._linear, mode="economic")[0]

        def project(m):
            """Projects onto the orthogonal complement of the linear functions."""
            return m - free @ (free.T @ m)

        inner = project(project(self._kernel).T)
        scale = np.trace(inner) / len(inner)
        inner += scale * free @ free.T
        inner[np.diag_indices_from(inner)] += 1e-12 * scale  # marks at equal positions would make it singular
        factor, failed = lapack.dpotrf(inner, lower=1, overwrite_a=1)
        if failed:
            raise linalg.LinAlgError("the energy is not positive")
        inverse = np.tril(lapack.dpotri(factor, lower=1)[0])
        inverse += np.tril(inverse, -1).T
        return project(project(inverse).T)

    def _unit_vectors(self, form):
        """n unit vectors in one array, with the minimum energy that descent finds from several starts."""
        n = len(self.x)

        def energy(free):
            free = free.reshape(n, 3)
            length = np.linalg.norm(free, axis=1, keepdims=True)
            unit = free / length
            pull = (form @ unit.ravel()).reshape(n, 3)
            slope = 2 * (pull - (pull * unit).sum(1, keepdims=True) * unit) / length
            return float((unit * pull).sum()), slope.ravel()

        lowest = linalg.eigh(form, subset_by_index=[0, 2])[1].T.reshape(3, n, 3)
        best = None
        for start in (self.x, *lowest):
            length = np.linalg.norm(start, axis=1, keepdims=True)
            found = minimize(energy, (start / np.maximum(length, 1e-9)).ravel(), jac=True, method="L-BFGS-B", options={"maxiter": 600})
            best = found if best is None or found.fun < best.fun else best
        unit = best.x.reshape(n, 3)
        return (unit / np.linalg.norm(unit, axis=1, keepdims=True)).ravel()

    def _weights(self, energy, wanted):
        n = len(self.x)
        weights = energy @ wanted
        self.polynomial = linalg.lstsq(self._linear, wanted - self._kernel @ weights)[0]
        self.a, self.b = weights[:n], weights[n:].reshape(n, 3)

    def _point_outwards(self):
        corners = np.stack(np.meshgrid(*[(-2, 2)] * 3), -1).reshape(-1, 3)
        if self(self.centre + self.radius * corners).mean() < 0:
            self.a, self.b, self.polynomial = -self.a, -self.b, -self.polynomial

    def __call__(self, positions):
        """f, in world units: its slope is about 1 at the marks."""
        q = (np.asarray(positions, float) - self.centre) / self.radius
        own = (self.x * self.b).sum(1)
        value = np.empty(len(q))
        step = max(1, 4_000_000 // len(self.x))
        for at in range(0, len(q), step):
            part = q[at:at + step]
            r = cdist(part, self.x)
            value[at:at + step] = (r**3) @ self.a - 3 * (r * (part @ self.b.T - own)).sum(1)
        return self.radius * (value + self.polynomial[0] + q @ self.polynomial[1:])
