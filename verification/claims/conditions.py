"""The conditions of the peg in the corner that the paper leaves open, as ranges (paper Fig. 4,
section VI).

A trial starts from a tilt, a clearance and a travel. The clearance is the distance from the wall to
the peg's nearest corner when the hand begins to push; the travel is the same distance from the
floor. The other conditions are friction, stiffness and damping of the walls, the collision
threshold (see `Condition`), and the device's force limit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from iapb.scene import Scene
from verification.region import Region
from verification.scenes.measures import HALF_SIZE

UNITS = {
    "tilt": "rad",
    "clearance": "m",
    "travel": "m",
    "friction": "",
    "stiffness": "N/m",
    "damping": "N s/m",
    "collision_threshold": "m/s",
    "force_limit": "times the paper's",
}
# conditions that most claims vary
START = ("tilt", "clearance", "travel", "friction", "collision_threshold")
F_LIMIT = (15.0, 15.0, 1.0)  # [N, N, N m]

# The conditions that each world ignores: one run of a world serves all values of these conditions.
# The device's limits act on PB, and on IAPB unless it renders in full.
_RIGID_IGNORES = ("friction", "stiffness", "damping", "collision_threshold", "force_limit")
IGNORED = {
    "ideal": _RIGID_IGNORES,
    "CBuc": _RIGID_IGNORES,
    "PB": ("collision_threshold",),
    "IAPB": (),
    "IAPB-push": (),
}


@dataclass(frozen=True)
class Condition:
    """One variation of the peg scene, with the units of UNITS; friction, stiffness and damping are
    those of the walls.

    A contact collides above `collision_threshold`; `force_limit` of the device is a multiple of the
    paper's limit.
    """

    tilt: float = 0.015
    clearance: float = 0.010
    travel: float = 0.008
    friction: float = 0.0
    stiffness: float = 1000.0
    damping: float = 50.0
    collision_threshold: float = 1e-6
    force_limit: float = 1.0

    def __str__(self) -> str:
        """Return the values that differ from the paper's start, as text."""
        default = Condition()
        changed = (
            f"{name} {value:g}"
            for name, value in asdict(self).items()
            if value != getattr(default, name)
        )
        return ", ".join(changed) or "the paper's start"

    def seen_by(self, world: str, rendering: str) -> Condition:
        """Return the condition with the default for every value that the world ignores."""
        ignored = (
            *IGNORED[world],
            *(["force_limit"] if (world, rendering) == ("IAPB", "full") else []),
        )
        return replace(self, **{name: getattr(Condition(), name) for name in ignored})

    def row(self, *names: str) -> dict[str, float]:
        """Return these values of the condition as cells of a row, by default those of START."""
        return {
            f"{name} [{UNITS[name]}]" if UNITS[name] else name: getattr(self, name)
            for name in names or START
        }

    def place(self, scene: Scene) -> Scene:
        """Return the scene with the values of this condition."""
        c = abs(np.cos(self.tilt))
        s = abs(np.sin(self.tilt))
        x = self.clearance + HALF_SIZE[0] * c + HALF_SIZE[1] * s
        y = -(self.travel + HALF_SIZE[0] * s + HALF_SIZE[1] * c)
        return scene.with_values(
            {
                "bodies.peg.position": [float(x), float(y), self.tilt],
                "contact.friction": self.friction,
                "contact.stiffness": self.stiffness,
                "contact.damping": self.damping,
                "contact.approach_velocity": self.collision_threshold,
                "device.force_limit": [self.force_limit * limit for limit in F_LIMIT],
            }
        )


TILTS = {
    "quick": (0.0, 0.005, 0.015, 0.03, 0.1, 0.3),
    "full": (0.0, 0.005, 0.01, 0.015, 0.02, 0.03, 0.05, 0.075, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35),
}
CLEARANCES = {"quick": (0.003, 0.010, 0.020), "full": (0.002, 0.005, 0.010, 0.015, 0.020, 0.030)}
TRAVELS = {"quick": (0.002, 0.020), "full": (0.001, 0.002, 0.004, 0.016, 0.020, 0.030)}
FRICTIONS = (0.1, 0.3)
# With 1e-6 every approaching contact collides, as in the paper. An existing contact that the hand
# pushes slowly into its wall also approaches, at up to F_h / B = 0.5 N / 50 N s/m = 10 mm/s: the
# last value excludes such contacts.
COLLISION_THRESHOLDS = (1e-3, 1e-2)
TIGHT = 0.3  # times the paper's limits: below the penalty forces of a hard landing
STIFFNESSES = (250.0, 500.0, 1000.0, 2000.0, 4000.0)
DAMPINGS = (0.0, 12.5, 25.0, 50.0, 100.0)


def start_conditions(depth: str) -> tuple[Condition, ...]:
    """Return all tilts x clearances x thresholds, more travels at three tilts, more frictions at
    all tilts."""
    grid = [Condition(tilt, clearance) for tilt in TILTS[depth] for clearance in CLEARANCES[depth]]
    travels = [
        Condition(tilt, travel=travel) for tilt in (0.0, 0.03, 0.1) for travel in TRAVELS[depth]
    ]
    frictions = [
        Condition(tilt, friction=friction) for tilt in TILTS[depth] for friction in FRICTIONS
    ]
    thresholds = [
        replace(start, collision_threshold=speed)
        for start in grid
        for speed in COLLISION_THRESHOLDS
    ]
    return tuple(dict.fromkeys(grid + travels + frictions + thresholds))


# Every tilt of the full depth, and every clearance where the verdict turns from hold to fail, at the
# paper's collision threshold.
TURNING = 0.03  # [rad]
WIDE_GRID = tuple(
    Condition(tilt, clearance)
    for tilt in TILTS["full"]
    for clearance in CLEARANCES["full" if tilt <= TURNING else "quick"]
)


def limited_conditions(depth: str) -> tuple[Condition, ...]:
    """Return the starting conditions with the paper's device limits, and some with tighter limits
    (C12 to C14, C16)."""
    default = Condition()
    starts = [
        start
        for start in start_conditions(depth)
        if start.collision_threshold == default.collision_threshold
    ]
    plain = [start for start in starts if start == replace(default, tilt=start.tilt)]
    return tuple(starts + [replace(start, force_limit=TIGHT) for start in plain])


# Range of the values tested for the start of the peg. A rigid world ignores all other conditions.
RANGES = {
    name: (min(values["full"]), max(values["full"]))
    for name, values in (("tilt", TILTS), ("clearance", CLEARANCES), ("travel", TRAVELS))
}
PATIENCE = (
    1000  # 1000 starts in a row miss a region with a hundredth of all starts once in 23,000 draws
)


def drawn(tested: Sequence[Condition], region: Region, seed: int, count: int) -> list[Condition]:
    """Return `count` conditions drawn at random inside a region and inside the range of the tested
    conditions.

    Tilt, clearance and travel come from one random sequence that all claims share: its first
    `count` starts inside the region. No region was chosen from these starts. Overlapping regions
    share the runs of the rigid worlds, which ignore all other conditions. The other conditions are
    drawn between the region's ends, the collision threshold uniformly in its logarithm. All
    conditions vary at once. Values are rounded to four digits, so that every machine gets the same
    ones. If `PATIENCE` starts in a row miss a thin region, further starts are drawn inside that
    region.
    """
    rng = np.random.default_rng(seed)
    found = list[Condition]()
    missed = 0
    ends = {
        name: region.ends(name, [getattr(condition, name) for condition in tested])
        for name in UNITS
    }
    while len(found) < count:
        shares = dict(zip(UNITS, rng.random(len(UNITS)), strict=True))
        patient = missed < PATIENCE
        start = {
            name: _between(*(RANGES if patient else ends)[name], shares[name]) for name in RANGES
        }
        if patient and not all(ends[name][0] <= start[name] <= ends[name][1] for name in RANGES):
            missed += 1
            continue
        missed = 0 if patient else missed
        others = {
            name: _between(*ends[name], shares[name], by_decades=name == "collision_threshold")
            for name in UNITS
            if name not in RANGES
        }
        found.append(Condition(**start, **others))
    return found


def _between(low: float, high: float, share: float, by_decades: bool = False) -> float:
    return float(f"{low * (high / low) ** share if by_decades else low + share * (high - low):.4g}")
