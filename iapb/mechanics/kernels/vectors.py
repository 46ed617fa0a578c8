"""3-vectors as tuples: LLVM keeps them in registers, and a formula stays one line."""

# Kernels carry no type hints: numba infers them, and a vector here is (float, float, float).

from numba import njit


@njit(cache=True, fastmath=False)
def load(rows, i):
    """Row i of an (n, 3) array."""
    return (rows[i, 0], rows[i, 1], rows[i, 2])


@njit(cache=True, fastmath=False)
def store(rows, i, a):
    """Write a into row i of an (n, 3) array."""
    rows[i, 0] = a[0]
    rows[i, 1] = a[1]
    rows[i, 2] = a[2]


@njit(cache=True, fastmath=False)
def accumulate(rows, i, a):
    """Add a to row i of an (n, 3) array."""
    rows[i, 0] += a[0]
    rows[i, 1] += a[1]
    rows[i, 2] += a[2]


@njit(cache=True, fastmath=False)
def add(a, b):
    """a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@njit(cache=True, fastmath=False)
def subtract(a, b):
    """a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@njit(cache=True, fastmath=False)
def scale(s, a):
    """s a."""
    return (s * a[0], s * a[1], s * a[2])


@njit(cache=True, fastmath=False)
def dot(a, b):
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, fastmath=False)
def cross(a, b):
    """a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@njit(cache=True, fastmath=False)
def transform(frames, i, a):
    """frames[i] a: from the axes of frame i to those it is given in."""
    f = frames[i]
    return (
        f[0, 0] * a[0] + f[0, 1] * a[1] + f[0, 2] * a[2],
        f[1, 0] * a[0] + f[1, 1] * a[1] + f[1, 2] * a[2],
        f[2, 0] * a[0] + f[2, 1] * a[1] + f[2, 2] * a[2],
    )


@njit(cache=True, fastmath=False)
def transform_back(frames, i, a):
    """frames[i]^T a."""
    f = frames[i]
    return (
        f[0, 0] * a[0] + f[1, 0] * a[1] + f[2, 0] * a[2],
        f[0, 1] * a[0] + f[1, 1] * a[1] + f[2, 1] * a[2],
        f[0, 2] * a[0] + f[1, 2] * a[1] + f[2, 2] * a[2],
    )


@njit(cache=True, fastmath=False)
def columns_times(frames, i, x, y, z):
    """frames[i] <- frames[i] [x y z], where x, y, z are the columns of a rotation."""
    x, y, z = transform(frames, i, x), transform(frames, i, y), transform(frames, i, z)
    for r in range(3):
        frames[i, r, 0] = x[r]
        frames[i, r, 1] = y[r]
        frames[i, r, 2] = z[r]
