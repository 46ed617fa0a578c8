"""A peg wedged in its hole: six contacts close at once, at speeds that differ fiftyfold, with rows of rank three."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from iapb.run import Run
from iapb.scene import find_scene, load_scene
from verification.hard_cases.case import HardCase, Measured, TrajectoryCase
from verification.hard_cases.energy import largest_gain

_SOURCE = "paper section VII: at most six collisions at once, in a tight hole; numbers ours"
_STIFFNESS, _FORCE, _DRAFT = 1000.0, 0.4, 0.01  # of scenes/peg_hole.yaml: wall [N/m], hand [N], slope of the sides
_END = 0.0105  # y [m] of the peg's centre when its front meets the hole's end
_STOPPED = 1e-9  # speed [m/s] of a body at rest: ten decades below that of the blow
# The springs' rest position is met to a ten-thousandth: the coupling's own settling leaves 1e-8 after a second.
_SETTLED = 1e-4
_NO_GAIN = 1e-12  # rounding of the ledger's sums over the run's steps


def wedged_peg() -> HardCase:
    """The six rows of a peg whose sides have the slope 200 : 9999 (a triangle of whole numbers), pushed in askew."""
    n, t = Fraction(200, 10001), Fraction(9999, 10001)
    half, reach = Fraction(1, 200), Fraction(21, 2000)
    points = [(x, -reach, Fraction(0), Fraction(1)) for x in (-half, half)]
    for y in (-reach, reach):
        points += [(-half, y, t, n), (half, y, -t, n)]
    exact = np.array([[nx, ny, x * ny - y * nx] for x, y, nx, ny in points], dtype=object)
    return HardCase(
        "A peg wedged in its hole",
        _SOURCE,
        "six rows of rank three, a fiftieth of whose approach is along the peg: the sides pull where they should push",
        "stopped in all three coordinates at once",
        np.diag([2.0, 2.0, 0.005]),
        exact.astype(float),
        np.array([1e-4, -0.04, 1e-3]),
        0.0,
        exact_jacobian=exact,
        methods=("factored", "gram_pinv", "damped", "svd"),
    )


def wedged_peg_motion() -> TrajectoryCase:
    """The shipped scene: the hand pushes the peg to the end of its hole and keeps pushing."""
    return TrajectoryCase(
        "A peg wedged in its hole, its motion",
        _SOURCE,
        "six gaps close in the same step; then a spring system of six contacts carries the hand's force",
        "at rest at the end of the hole, no deeper than six springs allow",
        "statics: 2 K δ + 4 K s² δ = F, s the sine of the draft; a rigid wall has δ = 0",
        load_scene(find_scene("peg_hole")),
        _measure,
    )


def _measure(run: Run) -> Measured:
    """Distance from where the peg must rest, in units of the springs' static depth; one more where it moves still."""
    sine = _DRAFT / math.hypot(1.0, _DRAFT)
    depth = _FORCE / (2.0 * _STIFFNESS + 4.0 * _STIFFNESS * sine**2)
    place = _END if run.law == "rigid constraints" else _END - depth
    off = float(np.abs(run.q[-1] - [0.0, place, 0.0]).max()) / depth
    moving = float(np.abs(run.v[-1]).max() > _STOPPED)
    return Measured(largest_gain(run), _NO_GAIN, off + moving, _SETTLED)
