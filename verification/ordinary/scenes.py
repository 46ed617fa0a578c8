"""Ordinary scenes with their truths: what somebody tries on the first day, only friction and
restitution set.

Every scene runs at 1 kHz. A case has a scene, a quantity of the motion, and its true value: a
closed form where there is one, else an ordinary differential equation solved by DOP853 to 1e-11 or
better, else a value that two independent computations converge to.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from iapb.scene.mechanism import mechanism_of, start_of
from iapb.scene.model import scene_kind
from reference.rigid_body import model_of

Floats = NDArray[np.float64]
Numbers = tuple[float, ...]
Values = dict[str, Any]  # a scene, a body or a wall as it stands in a scene file

G = 9.81
NO_TURN = (0.0, 0.0, 0.0, 1.0)
FLOOR = {"name": "floor", "kind": "half_plane", "point": [0, 0], "normal": [0, 1]}
GROUND = {"name": "floor", "kind": "half_space", "point": [0, 0, 0], "normal": [0, 0, 1]}


class Motion(NamedTuple):
    """The motion of B bodies at n + 1 instants, in space (planar bodies lie in z = 0)."""

    time: Floats  # (n + 1,) [s]
    place: Floats  # (n + 1, B, 3) origins of the body frames [m], world axes
    turn: Floats  # (n + 1, B, 3, 3) rotations of the body frames

    def angle(self, body: int = 0) -> Floats:
        """Return the angle about z of a planar body over time [rad], without jumps."""
        return np.unwrap(np.arctan2(self.turn[:, body, 1, 0], self.turn[:, body, 0, 0]))


Quantity = Callable[[Motion], Any]


@dataclass(frozen=True)
class Case:
    """A scene with its truth.

    scale : what the error is divided by, in the unit of the quantity; tolerance : largest relative
        error that is right
    """

    name: str
    scene: Values
    quantity: Quantity
    truth: Callable[[], Any]
    scale: Callable[[], float]
    tolerance: float
    says: str

    def error(self, motion: Motion) -> float:
        """Return the largest difference of the quantity from its truth by the scale; inf for a
        broken run."""
        if not all(np.isfinite(part).all() for part in motion):
            return math.inf
        return (
            float(np.max(np.abs(np.asarray(self.quantity(motion)) - self.truth()))) / self.scale()
        )


CASES: dict[str, Case] = {}
FAMILIES: dict[str, str] = {}  # family of each case, as the report lists them


def add(
    name: str,
    scene: Values,
    quantity: Quantity,
    truth: Any,
    scale: Any,
    says: str,
    tolerance: float = 0.01,
) -> None:
    """Add a case; `truth` and `scale` are values or functions that compute them."""
    true, size = (each if callable(each) else partial(_given, each) for each in (truth, scale))
    CASES[name] = Case(name, {"name": name} | scene, quantity, true, size, tolerance, says)


def _given(value: Any) -> Any:
    return value


def close_family(name: str) -> None:
    """Name the family of the cases added since the last one."""
    FAMILIES.update((case, name) for case in CASES if case not in FAMILIES)


def scene(
    duration: float,
    bodies: list[Values],
    walls: list[Values] | None = None,
    friction: float = 0.0,
    restitution: float = 0.0,
    gravity: float = G,
    **more: Any,
) -> Values:
    """Return the values of a scene; it is in space if its first body is."""
    space = (
        bodies[0]["joint"] in ("free_flyer", "spherical") or len(bodies[0].get("origin", ())) == 3
    )
    down = [0.0, 0.0, -gravity] if space else [0.0, -gravity]
    contact = {
        name: value
        for name, value in (("friction", friction), ("restitution", restitution))
        if value
    }
    return (
        {"rate": 1000, "duration": duration, "bodies": bodies}
        | ({"dimensions": 3} if space else {})
        | ({"gravity": down} if gravity else {})
        | ({"walls": walls} if walls else {})
        | ({"contact": contact} if contact else {})
        | more
    )


# Bodies. Planar: x, y, angle and velocities of the centre. In space: velocities in world axes at
# the unturned start.


def box(
    name: str, size: Numbers, mass: float, at: Numbers, velocity: Numbers | None = None
) -> Values:
    """Return a homogeneous box, planar or in space as its size says."""
    squares = [mass * length**2 / 12 for length in size]
    shape = {"name": name, "mass": mass, "shapes": [{"kind": "box", "size": list(size)}]}
    if len(size) == 2:
        return shape | {
            "joint": "planar",
            "inertia": mass * sum(length * length for length in size) / 12,
            "position": list(at),
            "velocity": list(velocity or (0, 0, 0)),
        }
    a, b, c = squares
    return shape | {
        "joint": "free_flyer",
        "inertia": [b + c, a + c, a + b],
        "position": [*at, *NO_TURN],
        "velocity": list(velocity or (0,) * 6),
    }


def disc(name: str, r: float, mass: float, at: Numbers, velocity: Numbers = (0, 0, 0)) -> Values:
    """Return a homogeneous planar disc."""
    return {
        "name": name,
        "joint": "planar",
        "mass": mass,
        "inertia": mass * r * r / 2,
        "shapes": [{"kind": "circle", "radius": r}],
        "position": list(at),
        "velocity": list(velocity),
    }


def stone(name: str, corners: list[tuple[float, float]], mass: float) -> Values:
    """Return a homogeneous planar polygon, its corners in world axes; its origin is the mean of the
    corners."""
    x, y = (sum(corner[i] for corner in corners) / len(corners) for i in (0, 1))
    turned = zip(corners, corners[1:] + corners[:1], strict=True)
    area = 0.5 * sum(a[0] * b[1] - a[1] * b[0] for a, b in turned)
    return {
        "name": name,
        "joint": "planar",
        "density": mass / abs(area),
        "position": [x, y, 0.0],
        "shapes": [{"kind": "polygon", "vertices": [[a - x, b - y] for a, b in corners]}],
    }


def ball(name: str, r: float, mass: float, at: Numbers, velocity: Numbers = (0,) * 6) -> Values:
    """Return a homogeneous sphere."""
    return {
        "name": name,
        "joint": "free_flyer",
        "mass": mass,
        "inertia": [0.4 * mass * r * r] * 3,
        "shapes": [{"kind": "sphere", "radius": r}],
        "position": [*at, *NO_TURN],
        "velocity": list(velocity),
    }


def link(
    name: str,
    length: float,
    mass: float,
    parent: str = "world",
    origin: Numbers = (0.0, 0.0),
    angle: float = 0.0,
    speed: float = 0.0,
    **more: Any,
) -> Values:
    """Return a homogeneous rod without shape that turns about its end; its length lies along x."""
    space = len(origin) == 3
    thin = mass * length**2 / 12
    return {
        "name": name,
        "parent": parent,
        "joint": "revolute",
        "origin": list(origin),
        "mass": mass,
        "center_of_mass": [length / 2, 0.0, *([0.0] if space else [])],
        "position": [angle],
        "velocity": [speed],
        "inertia": [1e-2 * thin, thin, thin] if space else thin,
    } | more


# Quantities


def moved(axis: int = 0, body: int = 0) -> Quantity:
    """How far a body has moved along an axis at the end [m]."""
    return lambda motion: motion.place[-1, body, axis] - motion.place[0, body, axis]


def farthest(size: float) -> Quantity:
    """The largest displacement of a body's origin, or of points at `size` from it, at any time
    [m]."""

    def measured(motion: Motion) -> float:
        slid = np.linalg.norm(motion.place - motion.place[:1], axis=-1)
        turned = np.linalg.norm(motion.turn - motion.turn[:1], axis=(-2, -1)) / math.sqrt(2.0)
        return float((slid + size * turned).max())

    return measured


def points(motion: Motion, arm: float, axes: slice = slice(None)) -> Floats:
    """Return the origin of each body and the points at `arm` along its axes, over time [m]."""
    ends = motion.place[..., None, :] + arm * np.swapaxes(motion.turn, -1, -2)
    return np.concatenate([motion.place[..., None, :], ends[..., axes, :]], axis=-2)


# Truth of what touches nothing: Pinocchio's forward dynamics, integrated by DOP853


@lru_cache(maxsize=64)
def free_motion(name: str) -> Motion:
    """Return the true motion of a case without contact, at a hundred instants."""
    checked = scene_kind(CASES[name].scene).model_validate(CASES[name].scene)
    mechanics = model_of(mechanism_of(checked))
    pin = mechanics.pin
    model = mechanics.model
    state = mechanics.data
    nq = mechanics.nq
    model.gravity.linear = np.array([*(checked.gravity or ()), 0.0, 0.0, 0.0][:3])

    def rates(_: float, y: Floats) -> Floats:
        q = mechanics.normalize(y[:nq])
        v = y[nq:]
        return np.concatenate(
            [mechanics.rate(q, v), pin.aba(model, state, q, v, np.zeros(mechanics.nv))]
        )

    times = np.linspace(0.0, checked.duration, 101)
    found = solve_ivp(
        rates,
        (0.0, times[-1]),
        np.concatenate(start_of(checked)),
        "DOP853",
        times,
        rtol=1e-12,
        atol=1e-12,
    ).y.T
    turn, place = (
        np.array(part)[:, :-1]
        for part in zip(
            *(mechanics.bodies(mechanics.normalize(y[:nq]))[:2] for y in found), strict=True
        )
    )
    return Motion(times, place, turn)


def add_free(
    name: str, values: Values, arm: float, tolerance: float = 0.01, axes: slice = slice(None)
) -> None:
    """Add a case without contact: points of all bodies at five instants, beside the longest way of
    a point.

    The way is that in the axes of the first body's origin, so that the drift of a free body does
    not count.
    """

    def measured(motion: Motion) -> Floats:
        return points(motion, arm, axes)[
            np.round(np.linspace(0, len(motion.time) - 1, 6)[1:]).astype(int)
        ]

    def way() -> float:
        ends = points(free_motion(name), arm, axes)
        return float(
            np.linalg.norm(np.diff(ends - ends[:, :1, :1], axis=0), axis=-1).sum(axis=0).max()
        )

    add(
        name,
        values,
        measured,
        lambda: measured(free_motion(name)),
        way,
        f"DOP853; points at {arm:g} m of all bodies; scale: their longest way",
        tolerance,
    )


def spinning(
    size: Numbers,
    speed: float,
    drift: float = 0.0,
    center: Numbers = (0, 0, 0),
    duration: float = 1.0,
    gravity: float = 0.0,
    axis: Numbers = (0.6, 0.64, 0.48),
) -> Values:
    """Return a free box or a ball (one size) of 1 kg that spins about no principal axis, and moves
    along x."""
    velocity = (drift, 0.0, 0.0, *(speed * x for x in axis))
    made = (
        ball("body", size[0], 1.0, (0, 0, 0), velocity)
        if len(size) == 1
        else box("body", size, 1.0, (0, 0, 0), velocity)
    )
    return scene(
        duration,
        [made | ({"center_of_mass": list(center)} if any(center) else {})],
        gravity=gravity,
    )


BRICK = (0.1, 0.16, 0.24)
PLATE = (0.2, 0.3, 0.002)
ROD = (0.4, 0.01, 0.02)
add_free("spin_sphere_1", spinning((0.1,), 1.0), 0.1)
add_free("spin_sphere_100", spinning((0.1,), 100.0, drift=3.0), 0.1, tolerance=1e-3)
add_free("spin_box_1", spinning(BRICK, 1.0, duration=3.0), 0.1)
add_free("spin_box_10", spinning(BRICK, 10.0, drift=3.0), 0.1)
add_free("spin_box_100", spinning(BRICK, 100.0, drift=3.0), 0.1, tolerance=1e-3)
add_free("spin_plate_10", spinning(PLATE, 10.0, drift=3.0), 0.1)
add_free("spin_rod_10", spinning(ROD, 10.0), 0.2)
add_free("spin_off_centre_30", spinning(BRICK, 30.0, drift=3.0, center=(0.03, 0.02, -0.01)), 0.1)
add_free("projectile_with_spin", spinning(BRICK, 20.0, drift=5.0, gravity=G), 0.1)
add_free(
    "spin_top_free_100",
    spinning((0.1, 0.1, 0.02), 100.0, axis=(0.2, 0.0, 0.98)),
    0.05,
    tolerance=1e-3,
)


def top(spin: Numbers, moments: list[float], lean: float, duration: float) -> Values:
    """Return a body on a ball joint, its centre 0.1 m above the joint in its own axes, leaning
    about x."""
    return scene(
        duration,
        [
            {
                "name": "top",
                "joint": "spherical",
                "mass": 0.5,
                "inertia": moments,
                "center_of_mass": [0, 0, 0.1],
                "position": [math.sin(lean / 2), 0, 0, math.cos(lean / 2)],
                "velocity": list(spin),
            }
        ],
    )


ARM = [link("upper", 0.5, 1.0, angle=0.3), link("lower", 0.5, 1.0, "upper", (0.5, 0.0), angle=-0.6)]
SPINNING_ARM = [
    link("upper", 0.5, 1.0, speed=20.0),
    link("lower", 0.5, 1.0, "upper", (0.5, 0.0), angle=0.8),
]
CART = {
    "name": "cart",
    "joint": "prismatic",
    "axis": [1, 0],
    "mass": 1.0,
    "position": [0.0],
    "velocity": [0.5],
}
ROBOT = [
    box("base", (0.3, 0.2, 0.1), 4.0, (0, 0, 0), (0.5, 0.2, 0, 1.0, 0.5, 2.0)) | {"shapes": []},
    link("thigh", 0.3, 1.0, "base", (0.15, 0.0, 0.0), 0.4, 3.0, axis=[0, 1, 0]),
    link("shin", 0.3, 0.5, "thigh", (0.3, 0.0, 0.0), -0.8, -4.0, axis=[0, 1, 0]),
]
add_free("heavy_top", top((0, 0, 100), [1e-3, 1e-3, 1.5e-3], 0.4, 2.0), 0.1, axes=slice(2, 3))
add_free(
    "spherical_pendulum", top((0.0, 2.5, 0.5), [1e-4, 1e-4, 1e-4], 2.0, 2.0), 0.1, axes=slice(2, 3)
)
add_free("double_pendulum", scene(2.0, ARM), 0.5)
add_free("spinning_arm", scene(1.0, SPINNING_ARM, gravity=0.0), 0.5)
add_free("floating_robot", scene(2.0, ROBOT, gravity=0.0), 0.3)
add_free("cart_and_pendulum", scene(2.0, [CART, link("rod", 0.5, 0.5, "cart", angle=0.2)]), 0.5)

close_family("spins, tops and linkages")

# Balls. A ball that slides gains spin until it rolls.


def rolled(v: float, w: float, mu: float, time: float, share: float = 0.4) -> float:
    """Return the way of a ball that starts with velocity v and surface velocity w, its inertia
    share·m·r² [m]."""
    slip = v - w
    sliding = abs(slip) / (mu * G * (1.0 + 1.0 / share))
    end = (v + share * w) / (1.0 + share)
    return (v + end) / 2.0 * sliding + end * (time - sliding)


R = 0.03
CRATE = box("crate", (0.4, 0.4), 40.0, (-1.0, 1.2, 0))
TILT = math.radians(20.0)
# down the slope, out of it
ALONG = (math.cos(TILT), -math.sin(TILT))
OUT = (math.sin(TILT), math.cos(TILT))
SLOPE = {"name": "slope", "kind": "half_plane", "point": [0, 0], "normal": list(OUT)}
SLOPE_3D = {
    "name": "slope",
    "kind": "half_space",
    "point": [0, 0, 0],
    "normal": [OUT[0], 0, OUT[1]],
}
BALL_AT = (0, 0, R)
add(
    "ball_rolls",
    scene(2.0, [ball("ball", R, 0.17, BALL_AT, (2, 0, 0, 0, 2 / R, 0))], [GROUND], 0.5),
    moved(),
    4.0,
    4.0,
    "rolls 4 m",
)
add(
    "ball_starts_to_roll",
    scene(1.5, [ball("ball", R, 0.17, BALL_AT, (2, 0, 0, 0, 0, 0))], [GROUND], 0.2),
    moved(),
    rolled(2, 0, 0.2, 1.5),
    3.0,
    "slides, then rolls at 5/7 of 2 m/s",
)
add(
    "ball_with_backspin",
    scene(1.5, [ball("ball", R, 0.17, BALL_AT, (1, 0, 0, 0, -4 / R, 0))], [GROUND], 0.2),
    moved(),
    rolled(1, -4, 0.2, 1.5),
    1.0,
    "returns",
)
add(
    "ball_down_slope",
    scene(1.0, [ball("ball", R, 0.17, (OUT[0] * R, 0, OUT[1] * R))], [SLOPE_3D], 0.5),
    lambda motion: (motion.place[-1, 0] - motion.place[0, 0]) @ [ALONG[0], 0, ALONG[1]],
    5 / 14 * G * math.sin(TILT),
    1.0,
    "5/7 g sin 20°",
)
add(
    "disc_rolls",
    scene(2.0, [disc("disc", 0.05, 1.0, (0, 0.05, 0), (2, 0, -40))], [FLOOR], 0.5),
    moved(),
    4.0,
    4.0,
    "rolls 4 m",
)
add(
    "disc_beside_falling_crate",
    scene(1.0, [CRATE, disc("disc", 0.03, 0.05, (0, 0.03, 0), (2, 0, -2 / 0.03))], [FLOOR], 0.5),
    moved(body=1),
    2.0,
    2.0,
    "rolls 2 m",
)
add(
    "disc_starts_to_roll",
    scene(1.5, [disc("disc", 0.05, 1.0, (0, 0.05, 0), (3, 0, 0))], [FLOOR], 0.3),
    moved(),
    rolled(3, 0, 0.3, 1.5, 0.5),
    3.0,
    "slides, then rolls at 2/3 of 3 m/s",
)


def bouncing(e: float, axis: int, bounces: int) -> tuple[float, Quantity, list[float]]:
    """Return the duration of so many bounces from 0.3 m, the heights after each as a quantity, and
    their truth [m]."""
    fall = math.sqrt(2 * 0.3 / G)
    edges = [fall * (1 + 2 * sum(e**k for k in range(1, n + 1))) for n in range(bounces + 1)]

    def heights(motion: Motion) -> list[float]:
        height = motion.place[:, 0, axis] - R
        windows = (
            (motion.time > a) & (motion.time < b) for a, b in zip(edges, edges[1:], strict=False)
        )
        return [float(height[window].max()) for window in windows]

    return edges[-1], heights, [0.3 * e ** (2 * n) for n in range(1, bounces + 1)]


for e, count, axis in ((0.5, 2, 1), (1.0, 3, 1), (0.8, 2, 2)):
    lasts, heights, truth = bouncing(e, axis, count)
    dropped = (
        disc("ball", R, 0.1, (0, 0.3 + R, 0))
        if axis == 1
        else ball("ball", R, 0.1, (0, 0, 0.3 + R))
    )
    add(
        f"bounce_{'in_space_' * (axis == 2)}{100 * e:.0f}_percent",
        scene(lasts, [dropped], [FLOOR if axis == 1 else GROUND], restitution=e),
        heights,
        truth,
        0.3,
        f"heights after {count} bounces, e² each",
        tolerance=0.02,
    )
BALLS = [ball("one", R, 0.1, (-0.3, 0, 0), (1, 0, 0, 0, 0, 0)), ball("two", R, 0.1, (0, 0, 0))]
add(
    "ball_hits_ball",
    scene(1.0, BALLS, restitution=1.0, gravity=0.0),
    lambda motion: motion.place[-1, :, 0],
    [-2 * R, 1 - 0.3 + 2 * R],
    1.0,
    "they swap velocities",
)

close_family("balls that roll and bounce")

# Boxes that slide, tip and land


def tipped(w: float, h: float, speed: float, time: float) -> float:
    """Return the angle of a box that turns about its lower edge without sliding [rad]."""
    half = math.hypot(w, h) / 2
    lean = math.atan2(w, h)
    about = (w * w + h * h) / 3
    found = solve_ivp(
        lambda _, y: [y[1], G * half * math.sin(y[0] - lean) / about],
        (0, time),
        [0.0, speed],
        "DOP853",
        rtol=1e-11,
        atol=1e-12,
    )
    return float(found.y[0, -1])


def on_slope(mu: float) -> Values:
    """Return a box that starts at rest with its face on a slope of 20 degrees."""
    return scene(
        1.0, [box("box", (0.1, 0.1), 1.0, (0.05 * OUT[0], 0.05 * OUT[1], -TILT))], [SLOPE], mu
    )


def lands(motion: Motion) -> list[float]:
    """Height of the centre at the end, and how far the body still moves in the last tenth of a
    second [m]."""
    last = motion.place[motion.time > motion.time[-1] - 0.1, 0]
    return [motion.place[-1, 0, 2], float(np.ptp(last, axis=0).max())]


add(
    "box_slides_and_stops",
    scene(1.5, [box("box", (0.1, 0.1), 1.0, (0, 0.05, 0), (2, 0, 0))], [FLOOR], 0.3),
    moved(),
    4 / (0.6 * G),
    4 / (0.6 * G),
    "v²/2μg",
)
add(
    "box_slides_in_space",
    scene(
        1.5, [box("box", (0.1, 0.1, 0.1), 1.0, (0, 0, 0.05), (1.2, 1.6, 0, 0, 0, 0))], [GROUND], 0.3
    ),
    lambda motion: motion.place[-1, 0, :2],
    np.array([0.6, 0.8]) * 4 / (0.6 * G),
    4 / (0.6 * G),
    "v²/2μg",
)
add("box_stays_on_slope", on_slope(0.5), farthest(0.05), 0.0, 0.1, "stays: tan 20° < 0.5")
SLID = G / 2 * (math.sin(TILT) - 0.2 * math.cos(TILT))
add(
    "box_slides_down_slope",
    on_slope(0.2),
    lambda motion: (motion.place[-1, 0] - motion.place[0, 0]) @ [*ALONG, 0],
    SLID,
    SLID,
    "g (sin − μ cos)",
)
add(
    "thrown_box_lands",
    scene(
        3.0, [box("box", (0.1, 0.1, 0.1), 1.0, (0, 0, 0.5), (1, 0.5, 1, 5, -7, 3))], [GROUND], 0.6
    ),
    lands,
    [0.05, 0.0],
    0.1,
    "rests on a face",
)
add(
    "box_tips_over_edge",
    scene(0.25, [box("box", (0.04, 0.1), 1.0, (0, 0.05, 0), (0.25, 0.1, -5.0))], [FLOOR], 1.0),
    lambda motion: -motion.angle()[-1],
    lambda: tipped(0.04, 0.1, 5.0, 0.25),
    1.0,
    "turns about its edge, DOP853; an error grows ninefold while it passes the upright pose",
    0.02,
)

PAIR = [box("lower", (0.4, 0.1), 1.0, (0, 0.05, 0)), box("upper", (0.1, 0.1), 1.0, (0, 0.15, 0))]
add(
    "pushed_box_stays",
    scene(1.0, PAIR[:1], [FLOOR], 0.4, hand={"body": "lower", "force": [3.5, 0, 0]}),
    farthest(0.2),
    0.0,
    0.1,
    "stays: 3.5 N < μ m g",
)
add(
    "pushed_box_carries",
    scene(0.5, PAIR, [FLOOR], 0.4, hand={"body": "lower", "force": [12.0, 0, 0]}),
    lambda motion: motion.place[-1, :, 0],
    [(6 - 0.4 * G) / 8] * 2,
    (6 - 0.4 * G) / 8,
    "both move: a = F/2m − μg < μg",
)
add(
    "pushed_box_slips_away",
    scene(0.2, PAIR, [FLOOR], 0.2, hand={"body": "lower", "force": [14.0, 0, 0]}),
    lambda motion: motion.place[-1, :, 0],
    [(14 - 0.6 * G) / 50, 0.2 * G / 50],
    (14 - 0.6 * G) / 50,
    "the upper one follows with μg, the lower one with F/m − 3μg",
)

close_family("boxes that slide, tip and land")

# Towers and loads. What stands moves by less than 1 mm, or a tenth of its thinnest body.


def stack(
    masses: list[float], shift: float = 0.0, duration: float = 2.0, space: bool = False
) -> Values:
    """Return boxes of 0.1 m on each other, every second one shifted."""
    at = [((i % 2) * shift, 0.05 + 0.1 * i) for i in range(len(masses))]
    boxes = [
        box(f"box_{i}", (0.1,) * (2 + space), mass, (x, x, y) if space else (x, y, 0))
        for i, ((x, y), mass) in enumerate(zip(at, masses, strict=True))
    ]
    return scene(duration, boxes, [GROUND if space else FLOOR], 0.5)


def add_standing(name: str, values: Values, size: float = 0.05, most: float = 1e-3) -> None:
    """Add a case that stands: no point at `size` from a body's origin moves by more than `most`
    [m]."""
    add(
        name,
        values,
        farthest(size),
        0.0,
        0.1,
        f"stands: moves less than {1e3 * most:g} mm; scale 0.1 m",
        most / 0.1,
    )


for count, shift in itertools.product((5, 10, 20), (1e-6, 1e-3)):
    add_standing(f"tower_{count}" + "_shifted" * (shift > 1e-6), stack([1.0] * count, shift))
add_standing("tower_8_long", stack([1.0] * 8, 1e-6, duration=5.0))
add_standing("tower_of_10_g", stack([0.01] * 5))
add_standing("tower_of_100_g", stack([0.1] * 5))
add_standing("tower_5_in_space", stack([1.0] * 5, 1e-6, space=True))
add_standing("tower_10_in_space_shifted", stack([1.0] * 10, 1e-3, duration=1.0, space=True))
# A box on one of 1 g that is lighter by a factor.
add_standing("ratio_1e3", stack([1e-3, 1e-3 * 1e3], duration=1.0))
add_standing("ratio_1e6", stack([1e-3, 1e-3 * 1e6], duration=1.0))
add_standing("ratio_1e6_in_space", stack([1e-3, 1e-3 * 1e6], duration=1.0, space=True))
add_standing(
    "coin_under_book",
    scene(
        1.0,
        [
            box("coin", (0.025, 0.002), 0.005, (0, 0.001, 0)),
            box("book", (0.2, 0.03), 1.0, (0, 0.017, 0)),
        ],
        [FLOOR],
        0.5,
    ),
    0.0125,
    2e-4,
)
add_standing(
    "balls_under_slab",
    scene(
        1.0,
        [disc(f"ball_{i}", 0.01, 0.002, (0.1 * i - 0.1, 0.01, 0)) for i in range(3)]
        + [box("slab", (0.3, 0.02), 5.0, (0, 0.03, 0))],
        [FLOOR],
        0.5,
    ),
    0.01,
)
# The hand carries the weight: nothing moves.
add_standing(
    "hand_holds_box",
    scene(
        1.0,
        [box("box", (0.1, 0.1), 1.0, (0, 0.2, 0))],
        [FLOOR],
        hand={"body": "box", "force": [0, G, 0]},
    ),
)
add_standing(
    "hand_holds_arm",
    scene(
        1.0,
        [link("upper", 0.5, 1.0), link("lower", 0.5, 1.0, "upper", (0.5, 0.0))],
        hand={"body": "lower", "point": [1 / 6, 0.0], "force": [0, 1.5 * G, 0]},
    ),
    0.5,
)
SIN = math.sin(math.radians(5))
COS = math.cos(math.radians(5))
NARROW = [
    {"name": f"side_{i}", "kind": "half_plane", "point": [0, 0], "normal": [side * COS, SIN]}
    for i, side in enumerate((1, -1))
]
add_standing(
    "ball_in_groove", scene(1.0, [disc("ball", 0.01, 0.05, (0, 0.01 / SIN, 0))], NARROW), 0.01
)

close_family("towers and loads")

# Statics with friction: grooves, wedges, an arch, pegs, ladders, dominoes; impacts on what rests or
# touches

GROOVE = [
    {"name": f"side_{i}", "kind": "half_plane", "point": [0, 0], "normal": [side, 1.0]}
    for i, side in enumerate((1, -1))
]
# N₁ − N₂ = μ (N₁ + N₂) holds the disc in place, (N₁ + N₂)(1 + μ²)/√2 = m g, and μ r (N₁ + N₂)
# brakes it.
BRAKE = 0.3 * math.sqrt(2) * G / (1 + 0.3**2) / (0.5 * 0.05)
add(
    "disc_brakes_in_groove",
    scene(0.6, [disc("disc", 0.05, 1.0, (0, 0.05 * math.sqrt(2), 0), (0, 0, 50))], GROOVE, 0.3),
    lambda motion: [motion.angle()[-1], 100 * moved()(motion), 100 * moved(1)(motion)],
    [50**2 / 2 / BRAKE, 0, 0],
    50**2 / 2 / BRAKE,
    "turns by ω²/2α, stays in place",
)
SHARP = math.tan(math.radians(15.0))


def wedge(mu: float, mass: float, duration: float) -> Values:
    """Return a wedge of 1 kg with a half angle of 15 degrees between two blocks on a floor; 5 N
    push it down."""
    corners = [(0.03 - 0.05 * SHARP, 0.0), (0.25, 0.0), (0.25, 0.1), (0.03 + 0.05 * SHARP, 0.1)]
    upper = 0.03 + 0.1 * SHARP
    return scene(
        duration,
        [
            stone("wedge", [(-0.03, 0.05), (0.03, 0.05), (upper, 0.15), (-upper, 0.15)], 1.0),
            stone("right", corners, mass),
            stone("left", [(-x, y) for x, y in corners[::-1]], mass),
        ],
        [FLOOR],
        mu,
        hand={"body": "wedge", "force": [0, -5, 0]},
    )


def driven(mu: float, mass: float) -> float:
    """Return the acceleration of the wedge [m/s²] where all its faces and the blocks slide."""
    s = math.sin(math.radians(15.0))
    c = math.cos(math.radians(15.0))
    down = 2 * (s + mu * c)
    out = c - mu * s - mu * (s + mu * c)
    # 1 kg · a = load − down N,  mass a tan 15° = out N − μ mass g
    return float(np.linalg.solve([[1.0, down], [mass * SHARP, -out]], [G + 5.0, -mu * mass * G])[0])


add_standing("wedge_holds", wedge(0.5, 2.0, 1.0))
add(
    "wedge_drives_blocks",
    wedge(0.2, 1.0, 0.1),
    moved(1),
    lambda: -driven(0.2, 1.0) * 0.1**2 / 2,
    0.04,
    "(load − blocks' friction) over the moving mass; scale 0.04 m",
    0.02,
)


def voussoir(i: int) -> Values:
    """Return one of the seven stones of a half ring with radii of 0.4 and 0.6 m that stands on y =
    0."""
    corners = [(r, math.pi * k / 7) for r, k in ((0.4, i), (0.6, i), (0.6, i + 1), (0.4, i + 1))]
    return stone(
        f"stone_{i}", [(r * math.cos(t), round(r * math.sin(t), 15)) for r, t in corners], 1.0
    )


add_standing("arch", scene(2.0, [voussoir(i) for i in range(7)], [FLOOR], 0.6), 0.1)


def peg(mu: float) -> Values:
    """Return a peg tilted in a hole at two contacts 8 mm apart, pushed 9 mm off its axis: it jams
    where 9 > 8/2μ.

    The peg is 20 mm wide and 60 mm long, the hole 20.2 mm wide and 40 mm deep, its mouth at y = 0.
    """
    w = 0.02
    hole = 0.0202
    deep = 0.008
    # The lower left corner touches the left side, the right flank the edge of the mouth: hole cos t
    # − deep sin t = w
    t = 2 * math.atan2(math.sqrt(deep**2 + hole**2 - w**2) - deep, w + hole)
    x = w / 2 * math.cos(t) + 0.03 * math.sin(t)
    y = -w / 2 * math.sin(t) + 0.03 * math.cos(t)
    sides = [
        {
            "name": name,
            "kind": "box",
            "size": [0.04, 0.04],
            "center": [side * (hole / 2 + 0.02), -0.02],
        }
        for name, side in (("left", -1), ("right", 1))
    ]
    end = {"name": "end", "kind": "box", "size": [0.2, 0.02], "center": [0, -0.05]}
    return scene(
        0.5,
        [box("peg", (w, 0.06), 0.1, (x - hole / 2, y - deep, -t))],
        [*sides, end],
        mu,
        gravity=0.0,
        hand={"body": "peg", "point": [0.009, 0.03], "force": [0, -5, 0]},
    )


add_standing("peg_jams", peg(0.7), 0.03)
add(
    "peg_goes_home",
    peg(0.05),
    lambda motion: motion.place[-1, 0, 1],
    -0.01,
    0.032,
    "9 mm < 8 mm/2μ: reaches the end",
)
# a ladder: a rod with round ends
LENGTH = 1.0
TIP = 0.005


def ladder(mu: float, lean: float, duration: float) -> Values:
    """Return a ladder that leans on a wall at an angle from the floor [rad]; its foot is at
    positive x."""
    x = TIP + LENGTH / 2 * math.cos(lean)
    y = TIP + LENGTH / 2 * math.sin(lean)
    ends = [{"kind": "circle", "radius": TIP, "center": [end * LENGTH / 2, 0.0]} for end in (-1, 1)]
    rod = {
        "name": "ladder",
        "joint": "planar",
        "mass": 2.0,
        "inertia": 2.0 * LENGTH**2 / 12,
        "shapes": ends,
        "position": [x, y, math.pi - lean],
    }
    wall = {"name": "wall", "kind": "half_plane", "point": [0, 0], "normal": [1, 0]}
    return scene(duration, [rod], [FLOOR, wall], mu)


def slipped(mu: float, lean: float, time: float) -> float:
    """Return the angle from the floor of a ladder that slips at both ends [rad], by DOP853."""

    def rates(_: float, y: Floats) -> list[float]:
        c = math.cos(y[0])
        s = math.sin(y[0])
        half = LENGTH / 2
        # unknown: angular acceleration, force of the floor, force of the wall, each by mass;
        # inertia = half²/3
        rows = [
            [-half * s, mu, -1.0],
            [half * c, -1.0, -mu],
            [-(half**2) / 3, mu * (half * s + TIP) - half * c, mu * (half * c + TIP) + half * s],
        ]
        return [
            y[1],
            float(np.linalg.solve(rows, [half * c * y[1] ** 2, half * s * y[1] ** 2 - G, 0.0])[0]),
        ]

    return float(
        solve_ivp(rates, (0, time), [lean, 0.0], "DOP853", rtol=1e-11, atol=1e-12).y[0, -1]
    )


# It stands where tan(lean) > (1 − μ²)/2μ: 57 degrees for 0.3.
add_standing("ladder_stands", ladder(0.3, math.radians(60), 1.0), LENGTH / 2)
FELL = math.radians(50) - slipped(0.3, math.radians(50), 0.5)
add(
    "ladder_slips",
    ladder(0.3, math.radians(50), 0.5),
    lambda motion: motion.angle()[-1] - motion.angle()[0],
    FELL,
    FELL,
    "slips at both ends, DOP853",
)
for mass in (0.005, 0.3, 10.0):
    add(
        f"ball_on_book_of_{1000 * mass:g}_g",
        scene(
            0.5,
            [box("book", (0.2, 0.02), mass, (0, 0.01, 0)), disc("ball", 0.03, 0.3, (0, 0.35, 0))],
            [FLOOR],
            restitution=0.8,
        ),
        lambda motion: float(motion.place[300:, 1, 1].max()) - 0.05,
        0.64 * 0.3,
        0.3,
        "rises to e² of its height",
        0.02,
    )
add(
    "row_that_touches",
    scene(
        0.4,
        [
            disc(
                f"disc_{i}",
                0.03,
                0.1,
                (0.06 * i - (0.2 if i == 0 else 0.06), 0, 0),
                (1.0 if i == 0 else 0, 0, 0),
            )
            for i in range(4)
        ],
        restitution=1.0,
        gravity=0.0,
    ),
    lambda motion: (motion.place[-1, :, 0] - motion.place[-101, :, 0]) * 10.0,
    [0, 0, 0, 1],
    1.0,
    "the last one leaves",
)
add(
    "plastic_drop",
    scene(0.8, [disc("disc", 0.03, 0.1, (0, 1.03, 0))], [FLOOR]),
    lambda motion: float(motion.place[500:, 0, 1].max()) - 0.03,
    0.0,
    1.0,
    "stays down",
    1e-3,
)
add(
    "pushed_by_a_function",
    scene(
        0.5,
        [box("box", (0.1, 0.1), 0.1, (0, 0.05, 0))],
        [FLOOR],
        hand={"body": "box", "force_function": ["0", "-1000*sin(t)", "0"]},
    ),
    lambda motion: float(motion.place[:, 0, 1].min()) - 0.05,
    0.0,
    0.1,
    "sags below a thousandth of its height",
    1e-3,
)
add(
    "pushed_to_and_fro",
    scene(
        10.0,
        [box("box", (0.1, 0.1), 1.0, (0, 0.05, 0))],
        [FLOOR],
        hand={"body": "box", "force_function": ["cos(2*pi*t)", "0", "0"]},
    ),
    lambda motion: float(motion.place[:, 0, 0].max()),
    0.5 / np.pi**2,
    0.05,
    "swings on ice, does not drift",
    1e-3,
)
DOMINOES = [
    box(
        f"domino_{i}",
        (0.02, 0.1),
        0.05,
        (0.05 * i, 0.05, 0),
        (0.2, 0.04, -4) if i == 0 else (0, 0, 0),
    )
    for i in range(5)
]
PLATE_2D = {"name": "plate", "kind": "box", "size": [0.01, 0.2], "center": [0, 0]}
PLATE_3D = {"name": "plate", "kind": "box", "size": [0.01, 0.2, 0.2], "center": [0, 0, 0]}


def beyond(start: float) -> Quantity:
    """How far the first body has gone on from where it touches the plate [m]."""
    return lambda motion: max(0.0, float(motion.place[:, 0, 0].max()) - start)


add(
    "dominoes",
    scene(1.0, DOMINOES, [FLOOR], 0.6),
    lambda motion: float(motion.time[np.argmax(motion.angle(4) < -0.3)]),
    0.56,
    0.56,
    "when the last one has turned 0.3 rad: 0.558 s in MuJoCo with hard contacts at 10 µs, 0.561 s "
    "in ideal-friction "
    "at 0.1 ms",
    0.02,
)
add(
    "fast_box_and_plate",
    scene(
        0.1, [box("box", (0.01, 0.01), 0.05, (-0.497, 0, 0), (30, 0, 0))], [PLATE_2D], gravity=0.0
    ),
    beyond(-0.01),
    0.0,
    0.01,
    "stops before the middle of the plate",
    0.5,
)
add(
    "fast_ball_and_plate",
    scene(
        0.1,
        [ball("ball", 0.01, 0.05, (-0.497, 0, 0), (50, 0, 0, 0, 0, 0))],
        [PLATE_3D],
        gravity=0.0,
    ),
    beyond(-0.015),
    0.0,
    0.01,
    "stops before the middle of the plate",
    0.5,
)

close_family("friction that holds, and blows on what rests")

# Seams of flush walls, heavy loads, gaps that bend

TILES = [
    {"name": f"tile_{k}", "kind": "box", "center": [0.1 * k, -0.05], "size": [0.1, 0.1]}
    for k in range(-1, 18)
]
TILES_3D = [
    {
        "name": f"tile_{k}_{j}",
        "kind": "box",
        "center": [0.1 * k, 0.1 * j, -0.05],
        "size": [0.1, 0.1, 0.1],
    }
    for k in range(-1, 8)
    for j in range(3)
]
add(
    "disc_over_tiles",
    scene(1.0, [disc("disc", R, 0.2, (0, R, 0), (1.5, 0, -1.5 / R))], TILES, 0.3),
    moved(),
    1.5,
    1.5,
    "rolls over 15 seams",
)
for e in (0.0, 0.5):
    add(
        f"box_over_tiles_{100 * e:.0f}_percent",
        scene(0.5, [box("box", (0.08, 0.05), 0.2, (0, 0.025, 0), (2, 0, 0))], TILES, 0.1, e),
        moved(),
        1.0 - 0.1 * G * 0.125,
        1.0,
        "slides over 8 seams",
    )
add(
    "box_over_tiles_in_space",
    scene(
        0.4,
        [box("box", (0.13, 0.08, 0.04), 0.5, (0, 0.05, 0.02), (1.5, 0.1, 0, 0, 0, 0))],
        TILES_3D,
        0.1,
    ),
    moved(),
    0.6 - 0.1 * G * 0.08 * 1.5 / math.hypot(1.5, 0.1),
    0.6,
    "slides over 5 seams",
)
add(
    "heavy_box_rests",
    scene(1.0, [box("box", (1, 1), 1e6, (0, 0.5, 0))], [FLOOR], 0.5),
    lambda motion: motion.place[-1, 0, 1],
    0.5,
    0.01,
    "1000 t sink by less than 0.1 mm",
)
TURNING = {"name": "arm", "joint": "revolute", "mass": 10, "inertia": 1, "velocity": [10]}
SLIDER = {
    "name": "slider",
    "parent": "arm",
    "joint": "prismatic",
    "axis": [1, 0],
    "mass": 0.5,
    "inertia": 1e-3,
    "position": [0.2999],
    "joint_limits": [0, 0.3],
}
add(
    "slider_on_a_turning_arm",
    scene(0.5, [TURNING, SLIDER], gravity=0.0),
    lambda motion: np.linalg.norm(motion.place[-1, 1]),
    0.3,
    0.01,
    "its stop holds it at 0.3 m",
)


def spin_of_landing(w: float, h: float, mu: float, e: float, speed: float) -> float:
    """Return ω⁺ of a box that lands flat and slides on: its leading corner slips, the other opens
    [rad/s]."""
    # per unit of mass
    arm = w / 2 - mu * h / 2
    about = (w * w + h * h) / 12
    return (1 + e) * speed / (1 + w / 2 * arm / about) * arm / about


add(
    "tall_box_lands_sliding",
    scene(
        0.02,
        [box("box", (0.04, 0.16), 0.2, (0, 0.0805, 0), (3, -1, 0))],
        [FLOOR],
        0.5,
        0.5,
        gravity=0.0,
    ),
    lambda motion: motion.angle()[-1],
    0.0195 * spin_of_landing(0.04, 0.16, 0.5, 0.5, 1.0),  # it lands after 0.5 ms
    0.3,
    "tips",
    tolerance=0.02,
)
# speed after 0.02 m
LEAN = 0.2
FAST = math.sqrt(4 + 4 / 3 * G * math.sin(0.2) * 0.02)
add(
    "disc_rolls_into_wall",
    scene(
        0.04,
        [
            disc(
                "disc",
                0.05,
                1.0,
                (-0.05 * math.sin(LEAN), 0.05 * math.cos(LEAN), 0),
                (-2 * math.cos(LEAN), -2 * math.sin(LEAN), 40),
            )
        ],
        [
            FLOOR | {"normal": [-math.sin(LEAN), math.cos(LEAN)]},
            {
                "name": "wall",
                "kind": "half_plane",
                "normal": [1, 0],
                "point": [-0.05 - 0.05 * math.sin(LEAN) - 0.02 * math.cos(LEAN), 0],
            },
        ],
        0.5,
        0.6,
    ),
    lambda motion: [
        motion.angle()[-1] - motion.angle()[20],
        (motion.place[-1, 0, 0] - motion.place[20, 0, 0]) / 0.02,
    ],
    [0.02 * FAST / 0.05 * (1 - 2 / 3 * (1 + math.sin(LEAN))), 0.6 * FAST * math.cos(LEAN)],
    0.02 * FAST / 0.05,
    "sticks to the wall and climbs it: Δω = 2/3 (v + v sin 0.2) / r; the slope lets go",
    0.02,
)
PAIR = [
    {"name": f"wall_{k}", "kind": "box", "center": [x, -0.05], "size": [1, 0.1]}
    for k, x in enumerate((-0.5, 0.5))
]
add(
    "box_meets_a_seam_exactly",
    scene(0.2, [box("box", (0.08, 0.05), 0.2, (-0.1, 0.025, 0), (2, 0, 0))], PAIR),
    moved(),
    0.4,
    0.4,
    "its front is on the seam at a step: the next wall's side is as near as its top",
)
WIDE = [
    {"name": f"wall_{k}", "kind": "box", "center": [0.14 * k, -0.05], "size": [0.14, 0.1]}
    for k in (0, 1)
]
add(
    "box_pushed_over_a_seam",
    scene(
        0.9,
        [box("box", (0.08, 0.05), 0.2, (0.0047105, 0.025, 0), (0.03, 0, 0))],
        WIDE,
        0.3,
        hand={"body": "box", "force": [0.3 * 0.2 * G, 0, 0]},
    ),
    moved(),
    0.027,
    0.027,
    "the push equals the friction that tilts it",
)

close_family("seams, heavy loads, joint stops")

# Impacts of many contacts at once, and of one after another, without gravity; the truth is the
# velocity at the end

GROOVE_3D = [
    {"name": f"side_{i}", "kind": "half_space", "point": [0, 0, 0], "normal": [side, 0, 1]}
    for i, side in enumerate((1, -1))
]
FEET = [
    {"kind": "box", "size": [0.02] * 3, "center": [x, y, -0.04]}
    for x in (-0.04, 0.04)
    for y in (-0.04, 0.04)
]


def still(name: str, mass: float, x: float, y: float = 0.0, speed: float = 0.0) -> Values:
    """Return a ball of 10 cm in the plane z = 0, by default at rest."""
    return ball(name, 0.05, mass, (x, y, 0.0), (speed, 0, 0, 0, 0, 0))


def leaving(motion: Motion) -> Floats:
    """Return the mean velocity of each body over the last ten steps [m/s]."""
    return (motion.place[-1] - motion.place[-11]) / (motion.time[-1] - motion.time[-11])


def against_a_wall(ratio: float) -> tuple[float, float]:
    """Return the velocities of a heavy ball (1 m/s at the start) and of a light one between it and
    a wall at +x."""
    heavy = 1.0
    light = 0.0
    while heavy > light or light > 0.0:
        if heavy > light:
            common = (ratio * heavy + light) / (ratio + 1.0)
            heavy = 2.0 * common - heavy
            light = 2.0 * common - light
        else:
            light = -light
    return heavy, light


add(
    "cradle_with_gaps",
    scene(
        0.2,
        [
            still(f"ball_{k}", 1.0, 0.1041 * (k - 1) if k else -0.1203, speed=float(k == 0))
            for k in range(5)
        ],
        restitution=1.0,
        gravity=0.0,
    ),
    leaving,
    np.array([[0.0, 0.0, 0.0]] * 4 + [[1.0, 0.0, 0.0]]),
    1.0,
    "the last ball leaves with the first one's velocity",
)
add(
    "bernoulli",
    scene(
        0.1,
        [
            still("striker", 1.0, -0.05 * math.sqrt(3.0) - 0.0203, speed=1.0),
            still("upper", 1.0, 0.0, 0.05),
            still("lower", 1.0, 0.0, -0.05),
        ],
        restitution=1.0,
        gravity=0.0,
    ),
    leaving,
    np.array(
        [[-0.2, 0.0, 0.0], [0.6, 0.2 * math.sqrt(3.0), 0.0], [0.6, -0.2 * math.sqrt(3.0), 0.0]]
    ),
    1.0,
    "the striker returns with 1/5 of its speed (Bernoulli 1742)",
)
add(
    "balls_and_wall",
    scene(
        3.0,
        [still("heavy", 100.0, -1.1, speed=1.0), still("light", 1.0, -0.55)],
        [{"name": "wall", "kind": "half_space", "point": [0, 0, 0], "normal": [-1, 0, 0]}],
        restitution=1.0,
        gravity=0.0,
    ),
    lambda motion: leaving(motion)[:, 0],
    np.array(against_a_wall(100.0)),
    1.0,
    "31 elastic collisions (Galperin 2003)",
)
FALLING = box("box", (0.1,) * 3, 1.0, (0, 0, 0.0603), (0, 0, -1, 0, 0, 0))
for name, shapes in (
    ("box_lands_on_four_corners", FALLING["shapes"]),
    ("box_lands_on_four_feet", FEET),
):
    add(
        name,
        scene(0.05, [FALLING | {"shapes": shapes}], [GROUND], restitution=0.5, gravity=0.0),
        leaving,
        np.array([[0.0, 0.0, 0.5]]),
        1.0,
        "leaves flat at half its speed",
    )
TURNED = [0, math.sin(math.pi / 8), 0, math.cos(math.pi / 8)]  # by 45 degrees about y
SPEED = math.sqrt(0.5)  # along the axes of the turned cube
add(
    "cube_in_groove",
    scene(
        0.05,
        [
            box("cube", (0.1,) * 3, 1.0, (0, 0, 0), (SPEED, 0, -SPEED, 0, 0, 0))
            | {"position": [0, 0, math.sqrt(2.0) * 0.0603, *TURNED]}
        ],
        GROOVE_3D,
        restitution=1.0,
        gravity=0.0,
    ),
    leaving,
    np.array([[0.0, 0.0, 1.0]]),
    1.0,
    "eight corners at once: it leaves with its speed",
)
close_family("many contacts at once, or one after another")
