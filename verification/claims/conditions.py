"""The conditions of the peg in the corner that the paper leaves open, as ranges (paper Fig. 4, section VI).

A trial starts from a tilt, a clearance to the wall and a travel to the floor: how far the peg's nearest corners
are from the two when the hand begins to push. Then come friction, stiffness and damping of the walls.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from iapb.scene import Scene
from verification.finding import Column, Region
from verification.scenes.trace import HALF_SIZE

F_LIMIT = (15.0, 15.0, 1.0)  # [N, N, N m]

# What the worlds do not see: one run of theirs serves all values.
_RIGID_IGNORES = ("friction", "stiffness", "damping", "approach_velocity", "force_limit")
IGNORED = {"ideal": _RIGID_IGNORES, "CBuc": _RIGID_IGNORES, "PB": ("approach_velocity", "force_limit"), "IAPB": ()}


@dataclass(frozen=True)
class Condition:
    """One variation of the peg scene; friction, stiffness and damping are those of the walls.

    tilt [rad]; clearance to the wall and travel to the floor [m]; stiffness [N/m]; damping [N s/m];
    approach_velocity from which on a contact collides [m/s]; force_limit of the device, multiple of the paper's
    """

    tilt: float = 0.015
    clearance: float = 0.010
    travel: float = 0.008
    friction: float = 0.0
    stiffness: float = 1000.0
    damping: float = 50.0
    approach_velocity: float = 1e-6
    force_limit: float = 1.0

    def __str__(self) -> str:
        """What differs from the paper's start."""
        default = Condition()
        changed = (f"{name} {value:g}" for name, value in asdict(self).items() if value != getattr(default, name))
        return ", ".join(changed) or "the paper's start"

    def seen_by(self, world: str, rendering: str) -> Condition:
        """The same trial as a world sees it: what it ignores takes its default."""
        default, ignored = Condition(), IGNORED[world]
        if rendering == "full":
            ignored = (*ignored, "force_limit")
        return replace(self, **{name: getattr(default, name) for name in ignored})

    def record(self) -> dict[str, float]:
        """The condition by column name."""
        return asdict(self)

    def place(self, scene: Scene) -> Scene:
        """The scene under this condition."""
        half = np.array(HALF_SIZE)
        c, s = abs(np.cos(self.tilt)), abs(np.sin(self.tilt))
        x = self.clearance + half[0] * c + half[1] * s
        y = -(self.travel + half[0] * s + half[1] * c)
        return scene.with_values({
            "bodies.peg.position": [float(x), float(y), self.tilt],
            "contact.friction": self.friction,
            "contact.stiffness": self.stiffness,
            "contact.damping": self.damping,
            "contact.approach_velocity": self.approach_velocity,
            "device.force_limit": [self.force_limit * limit for limit in F_LIMIT],
        })  # fmt: skip


TILTS = {
    "quick": (0.0, 0.005, 0.015, 0.03, 0.1, 0.3),
    "full": (0.0, 0.005, 0.01, 0.015, 0.02, 0.03, 0.05, 0.075, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35),
}
CLEARANCES = {"quick": (0.003, 0.010, 0.020), "full": (0.002, 0.005, 0.010, 0.015, 0.020, 0.030)}
TRAVELS = {"quick": (0.002, 0.020), "full": (0.001, 0.002, 0.004, 0.016, 0.020, 0.030)}
# A subset for what depends on the grid: the full tilts that lie at even distances; those above crowd at small ones.
EVEN_TILTS = tuple(n / 20 for n in range(8))
FRICTIONS = (0.1, 0.3)
# 1e-6 takes every contact that approaches at all, as the paper does. An old contact that creeps into its wall under
# the hand approaches too, by up to F_h / B = 0.5 N / 50 N s/m = 10 mm/s: the last value leaves such contacts out.
APPROACH_VELOCITIES = (1e-3, 1e-2)
TIGHT = 0.3  # of the paper's limits: below the penalty forces of a hard landing
STIFFNESSES = (250.0, 500.0, 1000.0, 2000.0, 4000.0)
DAMPINGS = (0.0, 12.5, 25.0, 50.0, 100.0)


def start_conditions(depth: str) -> tuple[Condition, ...]:
    """Every tilt, clearance and approach velocity, other travels at three tilts, other frictions at every tilt."""
    grid = [Condition(tilt, clearance) for tilt in TILTS[depth] for clearance in CLEARANCES[depth]]
    few = (0.0, 0.03, 0.1)
    travels = [Condition(tilt, travel=travel) for tilt in few for travel in TRAVELS[depth]]
    frictions = [Condition(tilt, friction=friction) for tilt in TILTS[depth] for friction in FRICTIONS]
    approaches = [replace(start, approach_velocity=speed) for start in grid for speed in APPROACH_VELOCITIES]
    return tuple(dict.fromkeys(grid + travels + frictions + approaches))


def full_grid() -> tuple[Condition, ...]:
    """Every tilt and clearance of the full depth, at the paper's approach threshold."""
    return tuple(Condition(tilt, clearance) for tilt in TILTS["full"] for clearance in CLEARANCES["full"])


def even_grid() -> tuple[Condition, ...]:
    """The starts of the full grid whose tilts lie at even distances."""
    return tuple(start for start in full_grid() if start.tilt in EVEN_TILTS)


def limited_conditions(depth: str) -> tuple[Condition, ...]:
    """The starting conditions with the paper's device limits, some also with tighter ones (C12 to C14, C16)."""
    default = Condition()
    starts = [start for start in start_conditions(depth) if start.approach_velocity == default.approach_velocity]
    plain = [start for start in starts if start == replace(default, tilt=start.tilt)]
    return tuple(starts + [replace(start, force_limit=TIGHT) for start in plain])


PATIENCE = 1000  # a region with a hundredth of all starts is missed so often once in 23,000 draws


def drawn(tested: Sequence[Condition], region: Region, seed: int, count: int) -> list[Condition]:
    """Return conditions drawn at random inside a region, each of them between the ends of what was tested.

    Tilt, clearance and travel come from one sequence for all claims, which no search has seen: the first `count` that
    lie inside. So regions that overlap share the runs of the rigid worlds, which see nothing else. The other
    conditions are drawn between the region's ends, the approach velocity by decades. All vary at once; four digits are
    kept, so that they repeat anywhere. A region so thin that the sequence misses it for `PATIENCE` starts running gets
    starts of its own.
    """
    rng, found = np.random.default_rng(seed), list[Condition]()
    ends = {name: region.ends(name, [getattr(condition, name) for condition in tested]) for name in UNITS}
    missed = 0
    while len(found) < count:
        shares = dict(zip(UNITS, rng.random(len(UNITS)), strict=True))
        start = {name: _between(*(START if missed < PATIENCE else ends)[name], shares[name]) for name in START}
        if not all(ends[name][0] <= start[name] <= ends[name][1] for name in START) and missed < PATIENCE:
            missed += 1
            continue
        missed = missed if missed >= PATIENCE else 0
        others = {name: _between(*ends[name], shares[name], by_decades=name in BY_DECADES)
                  for name in UNITS if name not in START}  # fmt: skip
        found.append(Condition(**start, **others))
    return found


def _between(low: float, high: float, share: float, by_decades: bool = False) -> float:
    return float(f"{low * (high / low) ** share if by_decades else low + share * (high - low):.4g}")


def wall_conditions() -> tuple[Condition, ...]:
    """Stiffness and damping of the walls, at two tilts (C17)."""
    return tuple(
        Condition(tilt, stiffness=stiffness, damping=damping)
        for tilt in (0.0, 0.1) for stiffness in STIFFNESSES for damping in DAMPINGS
    )  # fmt: skip


UNITS = {
    "tilt": "rad", "clearance": "m", "travel": "m", "friction": "", "stiffness": "N/m", "damping": "N s/m",
    "approach_velocity": "m/s", "force_limit": "F_limit",
}  # fmt: skip

# Where the peg starts, from the least to the largest value tested at any depth: all that a rigid world sees.
START = {name: (min(values["full"]), max(values["full"]))
         for name, values in (("tilt", TILTS), ("clearance", CLEARANCES), ("travel", TRAVELS))}  # fmt: skip
BY_DECADES = ("approach_velocity",)


def columns(*names: str) -> tuple[Column, ...]:
    """Return the condition columns of these names."""
    return tuple(Column(name, UNITS[name], condition=True) for name in names)


START_COLUMNS = columns("tilt", "clearance", "travel", "friction", "approach_velocity")
