"""Stability maps: which walls a sampled loop can hold, over stiffness and damping, by penalties and by impulses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from verification.finding import Failure, of_each
from verification.stability.sampled_wall import LAWS, Contact, Floats, Loop, touch_walls

SETTLES, BOUNCES_ON, GROWS = "settles", "bounces on", "grows"

# Resolution of the emulated encoder, 1 µm, and one sample late each way: what the report's device runs assume too.
LATE = (1, 1e-6)  # delay [samples], resolution [m]
GRIDS = {"quick": (17, 14), "full": (49, 40)}  # stiffnesses, dampings


@dataclass(frozen=True)
class StabilityMap:
    """One map: walls on a grid under one loop and law.

    stiffness : (k,) [N/m]; damping : (m,) [N s/m], 0 first
    contact : outcomes, each array (m k,), damping outermost
    """

    loop: Loop
    law: str
    stiffness: Floats
    damping: Floats
    contact: Contact

    @property
    def outcomes(self) -> tuple[str, ...]:
        """SETTLES, BOUNCES_ON or GROWS for each wall."""
        return tuple(GROWS if grown else SETTLES if settled else BOUNCES_ON
                     for settled, grown in zip(self.contact.settled, self.contact.grown, strict=True))

    @property
    def settled_share(self) -> float:
        """Share of the walls that the loop holds."""
        return float(np.mean(self.contact.settled))

    @property
    def passive(self) -> np.ndarray:
        """Which walls (m k,) the condition b >= KT/2 + |B| allows."""
        K, B = walls(self.stiffness, self.damping)
        return np.asarray(self.loop.passive_damping(K) >= B)

    def settling(self, damping: float) -> Floats:
        """Settling times (k,) at one of the dampings [s]."""
        row = int(np.flatnonzero(self.damping == damping)[0])
        size = len(self.stiffness)
        times = np.where(self.contact.settled, self.contact.settling_time, np.inf)
        return np.asarray(times[row * size : (row + 1) * size])


def walls(stiffness: Floats, damping: Floats) -> tuple[Floats, Floats]:
    """All pairs, each (m k,), damping outermost."""
    B, K = np.meshgrid(damping, stiffness, indexing="ij")
    return K.ravel(), B.ravel()


def loops() -> tuple[Loop, ...]:
    """The loops: 512 Hz and 1 kHz, ideal and late sensors, without physical damping (the paper's device) and with."""
    kinds = [(rate, late, b) for rate in (512.0, 1000.0) for late in (False, True) for b in (0.0, 5.0)]
    return tuple(Loop(rate=rate, device_damping=b, delay=LATE[0] if late else 0, resolution=LATE[1] if late else 0.0)
                 for rate, late, b in kinds)  # fmt: skip


def grid(depth: str) -> tuple[Floats, Floats]:
    """Stiffnesses of 0.1 to 1000 kN/m, and dampings of 0 and of 1 to 3000 N s/m, the paper's 50 among them."""
    stiffnesses, dampings = GRIDS[depth]
    damping = np.concatenate([[0.0], np.geomspace(1.0, 3e3, dampings - 2), [PAPER_DAMPING]])
    return np.geomspace(1e2, 1e6, stiffnesses), np.sort(damping)


PAPER_DAMPING = 50.0  # B of the paper's walls [N s/m]


def stability_maps(depth: str = "quick", failures: list[Failure] | None = None) -> tuple[StabilityMap, ...]:
    """Every loop under both laws, in turn, on the same walls; a loop that raises under one is left out."""
    stiffness, damping = grid(depth)
    K, B = walls(stiffness, damping)

    def both(loop: Loop) -> list[StabilityMap]:
        return [StabilityMap(loop, law, stiffness, damping, touch_walls(loop, K, B, law)) for law in LAWS]

    def name(loop: Loop) -> str:
        return f"walls at {loop.rate:g} Hz, delay {loop.delay}, device damping {loop.device_damping:g} N s/m"

    return tuple(of_each(loops(), both, failures, name))
