"""One state, or many in one call, from q to the quantity: what Python calls most, without a stop in between.

The configurations come from outside, so these kernels check them; all others trust what they are given.
"""

from math import isfinite, sqrt

from iapb.compiled import kernel
from iapb.mechanics.kernels.arrays import CONTINUOUS, FREE_FLYER, PLANAR_SE2, SPHERICAL
from iapb.mechanics.kernels.dynamics import bias, mass_matrix
from iapb.mechanics.kernels.kinematics import forward_kinematics

# Length of a quaternion or (cos, sin) pair given at the public border: single precision input passes.
UNIT_TOLERANCE = 1e-6


@kernel
def all_finite(values):
    """No NaN and no infinity in a vector."""
    for k in range(values.shape[0]):  # noqa: SIM110 - a kernel has no generators
        if not isfinite(values[k]):
            return False
    return True


@kernel
def is_unit(q, first, count):
    """Entries first .. first + count of q have total length one."""
    square = 0.0
    for i in range(first, first + count):
        square += q[i] * q[i]
    return abs(sqrt(square) - 1.0) <= UNIT_TOLERANCE


@kernel
def misplaced_body(m, q):
    """Return the first body whose quaternion or (cos, sin) pair is not of length one, -1 if there is none."""
    for b in range(m.kind.shape[0]):
        kind, i = m.kind[b], m.q_start[b]
        if kind == CONTINUOUS and not is_unit(q, i, 2):
            return b
        if kind == PLANAR_SE2 and not is_unit(q, i + 2, 2):
            return b
        if kind == SPHERICAL and not is_unit(q, i, 4):
            return b
        if kind == FREE_FLYER and not is_unit(q, i + 3, 4):
            return b
    return -1


@kernel
def is_configuration(m, q):
    """Finite, and where it must be, of length one."""
    return all_finite(q) and misplaced_body(m, q) < 0


@kernel
def mass_matrix_at(at, q, out):
    """out (d, d) <- M(q); False if q is no configuration."""
    if not is_configuration(at.mechanism, q):
        return False
    forward_kinematics(at.mechanism, q, at.workspace)
    mass_matrix(at.mechanism, at.workspace, out)
    return True


@kernel
def bias_at(at, q, v, out):
    """out (d,) <- B(q, v); False if q is no configuration or v not finite."""
    if not (is_configuration(at.mechanism, q) and all_finite(v)):
        return False
    forward_kinematics(at.mechanism, q, at.workspace)
    bias(at.mechanism, at.workspace, v, out)
    return True


@kernel
def mass_matrices_at(at, q, out):
    """out (n, d, d) <- M at each row of q (n, nq); return the rows done: fewer than n if one is refused."""
    for k in range(q.shape[0]):
        if not mass_matrix_at(at, q[k], out[k]):
            return k
    return q.shape[0]


@kernel
def biases_at(at, q, v, out):
    """out (n, d) <- B at each row of q (n, nq) and v (n, d); return the rows done."""
    for k in range(q.shape[0]):
        if not bias_at(at, q[k], v[k], out[k]):
            return k
    return q.shape[0]
