"""3-vectors as tuples: LLVM keeps them in registers, and a formula stays one line."""

# Kernels carry no type hints: numba infers them, and a vector here is (float, float, float).

from iapb.compiled import kernel


@kernel
def load(rows, i):
    """Row i of an (n, 3) array."""
    return (rows[i, 0], rows[i, 1], rows[i, 2])


@kernel
def store(rows, i, a):
    """Write a into row i of an (n, 3) array; the address of the row is computed once."""
    row = rows[i]
    row[0] = a[0]
    row[1] = a[1]
    row[2] = a[2]


@kernel
def accumulate(rows, i, a):
    """Add a to row i of an (n, 3) array."""
    store(rows, i, add(load(rows, i), a))


@kernel
def add(a, b):
    """a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@kernel
def subtract(a, b):
    """a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@kernel
def scale(s, a):
    """s a."""
    return (s * a[0], s * a[1], s * a[2])


@kernel
def dot(a, b):
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def cross(a, b):
    """a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@kernel
def transform(frames, i, a):
    """frames[i] a: transform a from the axes of frame i to the axes in which the frame is given."""
    return (
        frames[i, 0, 0] * a[0] + frames[i, 0, 1] * a[1] + frames[i, 0, 2] * a[2],
        frames[i, 1, 0] * a[0] + frames[i, 1, 1] * a[1] + frames[i, 1, 2] * a[2],
        frames[i, 2, 0] * a[0] + frames[i, 2, 1] * a[1] + frames[i, 2, 2] * a[2],
    )


@kernel
def transform_back(frames, i, a):
    """frames[i]^T a."""
    return (
        frames[i, 0, 0] * a[0] + frames[i, 1, 0] * a[1] + frames[i, 2, 0] * a[2],
        frames[i, 0, 1] * a[0] + frames[i, 1, 1] * a[1] + frames[i, 2, 1] * a[2],
        frames[i, 0, 2] * a[0] + frames[i, 1, 2] * a[1] + frames[i, 2, 2] * a[2],
    )


@kernel
def column(frames, i, k):
    """Column k of frames[i]: its k-th axis."""
    return (frames[i, 0, k], frames[i, 1, k], frames[i, 2, k])


@kernel
def store_columns(frames, i, x, y, z):
    """frames[i] <- [x y z]."""
    frame = frames[i]
    store(frame, 0, (x[0], y[0], z[0]))
    store(frame, 1, (x[1], y[1], z[1]))
    store(frame, 2, (x[2], y[2], z[2]))


@kernel
def turn_frame(frames, i, x, y, z):
    """frames[i] <- frames[i] [x y z], where x, y, z are the columns of a rotation."""
    store_columns(frames, i, transform(frames, i, x), transform(frames, i, y), transform(frames, i, z))
