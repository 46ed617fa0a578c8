"""Ordinary scenes with their truths: what somebody tries on the first day, only friction and
restitution set.

Every scene runs at 1 kHz; most are in scenes.yaml. A case has a scene, a quantity of the motion, and its true value: a
closed form where there is one, else an ordinary differential equation solved by DOP853 to 1e-11 or
better, else a value that two independent computations converge to.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import pairwise, product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from ruamel.yaml import YAML
from scipy.integrate import solve_ivp

from iapb.scene.mechanism import mechanism_of, start_of
from iapb.scene.model import scene_kind
from reference.rigid_body import model_of

Floats = NDArray[np.float64]
Values = dict[str, Any]  # a scene, a body or a wall as it stands in a scene file

G = 9.81
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

    truth, scale : values, or functions that compute them; scale : what the error is divided by, in
        the unit of the quantity
    tolerance : largest relative error that is right
    """

    name: str
    scene: Values
    quantity: Quantity
    truth: Any
    scale: Any
    tolerance: float
    says: str

    def error(self, motion: Motion) -> float:
        """Return the largest difference of the quantity from its truth by the scale; inf for a
        broken run."""
        if not all(np.isfinite(part).all() for part in motion):
            return math.inf
        off = np.abs(np.asarray(self.quantity(motion)) - _computed(self.truth))
        return float(np.max(off)) / float(_computed(self.scale))


def _computed(value: Any) -> Any:
    return value() if callable(value) else value


CASES: dict[str, Case] = {}
FAMILIES: dict[str, str] = {}  # family of each case, as the report lists them


@cache
def _written() -> dict[str, Values]:
    """Return the scenes of scenes.yaml by name."""
    found: dict[str, Values] = YAML(typ="safe").load(Path(__file__).with_name("scenes.yaml"))
    return found


def add(
    name: str,
    quantity: Quantity,
    truth: Any,
    scale: Any,
    says: str,
    tolerance: float = 0.01,
    scene: Values | None = None,
) -> None:
    """Add a case with a scene, by default that of its name in scenes.yaml."""
    values = {"name": name, "rate": 1000} | (scene or _written()[name])
    CASES[name] = Case(name, values, quantity, truth, scale, tolerance, says)


def close_family(name: str) -> None:
    """Name the family of the cases added since the last one."""
    FAMILIES.update((case, name) for case in CASES if case not in FAMILIES)


def scene(
    duration: float, bodies: list[Values], wall: Values, friction: float, **more: Any
) -> Values:
    """Return the values of a scene on a floor; it is in space if the floor is."""
    space = wall == GROUND
    return {
        **({"dimensions": 3} if space else {}),
        "duration": duration,
        "gravity": [0.0, 0.0, -G] if space else [0.0, -G],
        "bodies": bodies,
        "walls": [wall],
        "contact": {"friction": friction},
        **more,
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


# Quantities


def moved(axis: int = 0, body: int = 0) -> Quantity:
    """How far a body has moved along an axis at the end [m]."""
    return lambda motion: motion.place[-1, body, axis] - motion.place[0, body, axis]


def at_end(axis: int, body: int | slice = slice(None)) -> Quantity:
    """The coordinate of a body, or of all bodies, along an axis at the end [m]."""
    return lambda motion: motion.place[-1, body, axis]


def moved_along(direction: list[float]) -> Quantity:
    """How far the first body has moved along a direction at the end [m]."""
    return lambda motion: (motion.place[-1, 0] - motion.place[0, 0]) @ direction


def highest(body: int, above: float, start: int = 0) -> Quantity:
    """How far a body rises above a height from a step on [m]."""
    return lambda motion: float(motion.place[start:, body, 1].max()) - above


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


@cache
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


def add_free(name: str, arm: float, tolerance: float = 0.01, axes: slice = slice(None)) -> None:
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
        measured,
        lambda: measured(free_motion(name)),
        way,
        f"DOP853; points at {arm:g} m of all bodies; scale: their longest way",
        tolerance,
    )


add_free("spin_sphere_1", 0.1)
add_free("spin_sphere_100", 0.1, tolerance=1e-3)
add_free("spin_box_1", 0.1)
add_free("spin_box_10", 0.1)
add_free("spin_box_100", 0.1, tolerance=1e-3)
add_free("spin_plate_10", 0.1)
add_free("spin_rod_10", 0.2)
add_free("spin_off_centre_30", 0.1)
add_free("projectile_with_spin", 0.1)
add_free("spin_top_free_100", 0.05, tolerance=1e-3)
add_free("heavy_top", 0.1, axes=slice(2, 3))
add_free("spherical_pendulum", 0.1, axes=slice(2, 3))
add_free("double_pendulum", 0.5)
add_free("spinning_arm", 0.5)
add_free("floating_robot", 0.3)
add_free("cart_and_pendulum", 0.5)

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
TILT = math.radians(20.0)
ALONG = (math.cos(TILT), -math.sin(TILT))  # down the slope
add("ball_rolls", moved(), 4.0, 4.0, "rolls 4 m")
add(
    "ball_starts_to_roll",
    moved(),
    rolled(2, 0, 0.2, 1.5),
    3.0,
    "slides, then rolls at 5/7 of 2 m/s",
)
add("ball_with_backspin", moved(), rolled(1, -4, 0.2, 1.5), 1.0, "returns")
add(
    "ball_down_slope",
    moved_along([ALONG[0], 0, ALONG[1]]),
    5 / 14 * G * math.sin(TILT),
    1.0,
    "5/7 g sin 20°",
)
add("disc_rolls", moved(), 4.0, 4.0, "rolls 4 m")
add("disc_beside_falling_crate", moved(body=1), 2.0, 2.0, "rolls 2 m")
add(
    "disc_starts_to_roll",
    moved(),
    rolled(3, 0, 0.3, 1.5, 0.5),
    3.0,
    "slides, then rolls at 2/3 of 3 m/s",
)


def add_bounces(name: str, e: float, axis: int, bounces: int) -> None:
    """Add a ball that falls from 0.3 m: its heights after each bounce [m]."""
    fall = math.sqrt(2 * 0.3 / G)
    touches = [fall * (1 + 2 * sum(e**k for k in range(1, n + 1))) for n in range(bounces + 1)]

    def heights(motion: Motion) -> list[float]:
        height = motion.place[:, 0, axis] - R
        flights = pairwise(np.searchsorted(motion.time, touches))
        return [float(height[start:end].max()) for start, end in flights]

    truth = [0.3 * e ** (2 * n) for n in range(1, bounces + 1)]
    add(name, heights, truth, 0.3, f"heights after {bounces} bounces, e² each", 0.02)


add_bounces("bounce_50_percent", 0.5, 1, 2)
add_bounces("bounce_100_percent", 1.0, 1, 3)
add_bounces("bounce_in_space_80_percent", 0.8, 2, 2)
add(
    "ball_hits_ball",
    at_end(0),
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


def lands(motion: Motion) -> list[float]:
    """Height of the centre at the end, and how far the body still moves in the last tenth of a
    second [m]."""
    last = motion.place[motion.time > motion.time[-1] - 0.1, 0]
    return [motion.place[-1, 0, 2], float(np.ptp(last, axis=0).max())]


add("box_slides_and_stops", moved(), 4 / (0.6 * G), 4 / (0.6 * G), "v²/2μg")
add(
    "box_slides_in_space",
    lambda motion: motion.place[-1, 0, :2],
    np.array([0.6, 0.8]) * 4 / (0.6 * G),
    4 / (0.6 * G),
    "v²/2μg",
)
add("box_stays_on_slope", farthest(0.05), 0.0, 0.1, "stays: tan 20° < 0.5")
SLID = G / 2 * (math.sin(TILT) - 0.2 * math.cos(TILT))
add(
    "box_slides_down_slope",
    moved_along([*ALONG, 0]),
    SLID,
    SLID,
    "g (sin − μ cos)",
)
add("thrown_box_lands", lands, [0.05, 0.0], 0.1, "rests on a face")
add(
    "box_tips_over_edge",
    lambda motion: -motion.angle()[-1],
    lambda: tipped(0.04, 0.1, 5.0, 0.25),
    1.0,
    "turns about its edge, DOP853; an error grows ninefold while it passes the upright pose",
    0.02,
)

add("pushed_box_stays", farthest(0.2), 0.0, 0.1, "stays: 3.5 N < μ m g")
add(
    "pushed_box_carries",
    at_end(0),
    [(6 - 0.4 * G) / 8] * 2,
    (6 - 0.4 * G) / 8,
    "both move: a = F/2m − μg < μg",
)
add(
    "pushed_box_slips_away",
    at_end(0),
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
    bodies = list[Values]()
    for i, mass in enumerate(masses):
        x = (i % 2) * shift
        y = 0.05 + 0.1 * i
        inertia = mass * 0.1**2 / 6.0
        bodies.append(
            {
                "name": f"box_{i}",
                "joint": "free_flyer" if space else "planar",
                "mass": mass,
                "inertia": [inertia] * 3 if space else inertia,
                "shapes": [{"kind": "box", "size": [0.1] * (2 + space)}],
                "position": [x, x, y, 0.0, 0.0, 0.0, 1.0] if space else [x, y, 0.0],
            }
        )
    return scene(duration, bodies, GROUND if space else FLOOR, 0.5)


def add_standing(
    name: str, size: float = 0.05, most: float = 1e-3, scene: Values | None = None
) -> None:
    """Add a case that stands: no point at `size` from a body's origin moves by more than `most`
    [m]."""
    says = f"stands: moves less than {1e3 * most:g} mm; scale 0.1 m"
    add(name, farthest(size), 0.0, 0.1, says, most / 0.1, scene)


for count, shift in product((5, 10, 20), (1e-6, 1e-3)):
    add_standing(f"tower_{count}" + "_shifted" * (shift > 1e-6), scene=stack([1.0] * count, shift))
add_standing("tower_8_long", scene=stack([1.0] * 8, 1e-6, duration=5.0))
add_standing("tower_of_10_g", scene=stack([0.01] * 5))
add_standing("tower_of_100_g", scene=stack([0.1] * 5))
add_standing("tower_5_in_space", scene=stack([1.0] * 5, 1e-6, space=True))
add_standing("tower_10_in_space_shifted", scene=stack([1.0] * 10, 1e-3, duration=1.0, space=True))
# A box on one of 1 g that is lighter by a factor.
add_standing("ratio_1e3", scene=stack([1e-3, 1e-3 * 1e3], duration=1.0))
add_standing("ratio_1e6", scene=stack([1e-3, 1e-3 * 1e6], duration=1.0))
add_standing("ratio_1e6_in_space", scene=stack([1e-3, 1e-3 * 1e6], duration=1.0, space=True))
add_standing("coin_under_book", 0.0125, 2e-4)
add_standing("balls_under_slab", 0.01)
add_standing("hand_holds_box")
add_standing("hand_holds_arm", 0.5)
add_standing("ball_in_groove", 0.01)

close_family("towers and loads")

# Statics with friction: grooves, wedges, an arch, pegs, ladders, dominoes; impacts on what rests or
# touches

# N₁ − N₂ = μ (N₁ + N₂) holds the disc in place, (N₁ + N₂)(1 + μ²)/√2 = m g, and μ r (N₁ + N₂)
# brakes it.
BRAKE = 0.3 * math.sqrt(2) * G / (1 + 0.3**2) / (0.5 * 0.05)
add(
    "disc_brakes_in_groove",
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
        FLOOR,
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


add_standing("wedge_holds", scene=wedge(0.5, 2.0, 1.0))
add(
    "wedge_drives_blocks",
    moved(1),
    lambda: -driven(0.2, 1.0) * 0.1**2 / 2,
    0.04,
    "(load − blocks' friction) over the moving mass; scale 0.04 m",
    0.02,
    scene=wedge(0.2, 1.0, 0.1),
)


def voussoir(i: int) -> Values:
    """Return one of the seven stones of a half ring with radii of 0.4 and 0.6 m that stands on y =
    0."""
    corners = [(r, math.pi * k / 7) for r, k in ((0.4, i), (0.6, i), (0.6, i + 1), (0.4, i + 1))]
    return stone(
        f"stone_{i}", [(r * math.cos(t), round(r * math.sin(t), 15)) for r, t in corners], 1.0
    )


add_standing("arch", 0.1, scene=scene(2.0, [voussoir(i) for i in range(7)], FLOOR, 0.6))


add_standing("peg_jams", 0.03)
add(
    "peg_goes_home",
    at_end(1, body=0),
    -0.01,
    0.032,
    "9 mm < 8 mm/2μ: reaches the end",
)
# of a ladder: the length of its rod, the radius of its ends [m]
LENGTH = 1.0
TIP = 0.005


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
add_standing("ladder_stands", LENGTH / 2)
FELL = math.radians(50) - slipped(0.3, math.radians(50), 0.5)
add(
    "ladder_slips",
    lambda motion: motion.angle()[-1] - motion.angle()[0],
    FELL,
    FELL,
    "slips at both ends, DOP853",
)
for name in ("ball_on_book_of_5_g", "ball_on_book_of_300_g", "ball_on_book_of_10000_g"):
    add(
        name,
        highest(1, above=0.05, start=300),
        0.64 * 0.3,
        0.3,
        "rises to e² of its height",
        0.02,
    )
add(
    "row_that_touches",
    lambda motion: (motion.place[-1, :, 0] - motion.place[-101, :, 0]) * 10.0,
    [0, 0, 0, 1],
    1.0,
    "the last one leaves",
)
add(
    "plastic_drop",
    highest(0, above=0.03, start=500),
    0.0,
    1.0,
    "stays down",
    1e-3,
)
add(
    "pushed_by_a_function",
    lambda motion: float(motion.place[:, 0, 1].min()) - 0.05,
    0.0,
    0.1,
    "sags below a thousandth of its height",
    1e-3,
)
add(
    "pushed_to_and_fro",
    lambda motion: float(motion.place[:, 0, 0].max()),
    0.5 / np.pi**2,
    0.05,
    "swings on ice, does not drift",
    1e-3,
)


def beyond(start: float) -> Quantity:
    """How far the first body has gone on from where it touches the plate [m]."""
    return lambda motion: max(0.0, float(motion.place[:, 0, 0].max()) - start)


add(
    "dominoes",
    lambda motion: float(motion.time[np.argmax(motion.angle(4) < -0.3)]),
    0.56,
    0.56,
    "when the last one has turned 0.3 rad: 0.558 s in MuJoCo with hard contacts at 10 µs, 0.561 s "
    "in ideal-friction "
    "at 0.1 ms",
    0.02,
)
add("fast_box_and_plate", beyond(-0.01), 0.0, 0.01, "stops before the middle of the plate", 0.5)
add("fast_ball_and_plate", beyond(-0.015), 0.0, 0.01, "stops before the middle of the plate", 0.5)

close_family("friction that holds, and blows on what rests")

# Seams of flush walls, heavy loads, gaps that bend

add("disc_over_tiles", moved(), 1.5, 1.5, "rolls over 15 seams")
for name in ("box_over_tiles_0_percent", "box_over_tiles_50_percent"):
    add(name, moved(), 1.0 - 0.1 * G * 0.125, 1.0, "slides over 8 seams")
add(
    "box_over_tiles_in_space",
    moved(),
    0.6 - 0.1 * G * 0.08 * 1.5 / math.hypot(1.5, 0.1),
    0.6,
    "slides over 5 seams",
)
add(
    "heavy_box_rests",
    at_end(1, body=0),
    0.5,
    0.01,
    "1000 t sink by less than 0.1 mm",
)
add(
    "slider_on_a_turning_arm",
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
    lambda motion: [
        motion.angle()[-1] - motion.angle()[20],
        (motion.place[-1, 0, 0] - motion.place[20, 0, 0]) / 0.02,
    ],
    [0.02 * FAST / 0.05 * (1 - 2 / 3 * (1 + math.sin(LEAN))), 0.6 * FAST * math.cos(LEAN)],
    0.02 * FAST / 0.05,
    "sticks to the wall and climbs it: Δω = 2/3 (v + v sin 0.2) / r; the slope lets go",
    0.02,
)
add(
    "box_meets_a_seam_exactly",
    moved(),
    0.4,
    0.4,
    "its front is on the seam at a step: the next wall's side is as near as its top",
)
add("box_pushed_over_a_seam", moved(), 0.027, 0.027, "the push equals the friction that tilts it")

close_family("seams, heavy loads, joint stops")

# Impacts of many contacts at once, and of one after another, without gravity; the truth is the
# velocity at the end


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
    leaving,
    np.array([[0.0, 0.0, 0.0]] * 4 + [[1.0, 0.0, 0.0]]),
    1.0,
    "the last ball leaves with the first one's velocity",
)
add(
    "bernoulli",
    leaving,
    np.array(
        [[-0.2, 0.0, 0.0], [0.6, 0.2 * math.sqrt(3.0), 0.0], [0.6, -0.2 * math.sqrt(3.0), 0.0]]
    ),
    1.0,
    "the striker returns with 1/5 of its speed (Bernoulli 1742)",
)
add(
    "balls_and_wall",
    lambda motion: leaving(motion)[:, 0],
    np.array(against_a_wall(100.0)),
    1.0,
    "31 elastic collisions (Galperin 2003)",
)
for name in ("box_lands_on_four_corners", "box_lands_on_four_feet"):
    add(name, leaving, np.array([[0.0, 0.0, 0.5]]), 1.0, "leaves flat at half its speed")
add(
    "cube_in_groove",
    leaving,
    np.array([[0.0, 0.0, 1.0]]),
    1.0,
    "eight corners at once: it leaves with its speed",
)
close_family("many contacts at once, or one after another")
