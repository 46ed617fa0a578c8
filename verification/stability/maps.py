"""Stability maps: walls that are stable in a sampled loop, over stiffness and damping, with penalties and impulses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from verification.finding import Failure, of_each
from verification.stability.sampled_wall import LAWS, Contact, Floats, Loop, touch_walls

SETTLES, BOUNCES_ON, GROWS = "settles", "bounces on", "grows"

# Emulated encoder with a resolution of 1 µm, and a delay of one sample each way, as in the report's device runs.
LATE = (1, 1e-6)  # delay [samples], resolution [m]
GRIDS = {"quick": (17, 14), "full": (49, 40)}  # stiffnesses, dampings


@dataclass(frozen=True)
class StabilityMap:
    """One map: the outcomes of a grid of walls for one loop and one law.

    stiffness : (k,) [N/m]; damping : (m,) [N s/m], 0 first
    contact : outcomes; each array has shape (m k,), and the stiffness varies fastest
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
        """Share of the walls at which the mass settles."""
        return float(np.mean(self.contact.settled))

    @property
    def passive(self) -> np.ndarray:
        """Whether each wall (m k,) satisfies the condition b >= KT/2 + |B|."""
        K, B = walls(self.stiffness, self.damping)
        return np.asarray(self.loop.passive_damping(K) >= B)

    def settling(self, damping: float) -> Floats:
        """Settling times (k,) at one of the dampings [s]."""
        row = int(np.flatnonzero(self.damping == damping)[0])
        size = len(self.stiffness)
        times = np.where(self.contact.settled, self.contact.settling_time, np.inf)
        return np.asarray(times[row * size : (row + 1) * size])


def walls(stiffness: Floats, damping: Floats) -> tuple[Floats, Floats]:
    """Return stiffness and damping of all pairs, each (m k,); the stiffness varies fastest."""
    B, K = np.meshgrid(damping, stiffness, indexing="ij")
    return K.ravel(), B.ravel()


def loops() -> tuple[Loop, ...]:
    """Return the loops: 512 Hz and 1 kHz, ideal and delayed sensors, with and without physical damping.

    The paper's device has no physical damping.
    """
    kinds = [(rate, late, b) for rate in (512.0, 1000.0) for late in (False, True) for b in (0.0, 5.0)]
    return tuple(Loop(rate=rate, device_damping=b, delay=LATE[0] if late else 0, resolution=LATE[1] if late else 0.0)
                 for rate, late, b in kinds)  # fmt: skip


def grid(depth: str) -> tuple[Floats, Floats]:
    """Return stiffnesses of 0.1 to 1000 kN/m, and dampings of 0 and 1 to 3000 N s/m, including the paper's 50."""
    stiffnesses, dampings = GRIDS[depth]
    damping = np.concatenate([[0.0], np.geomspace(1.0, 3e3, dampings - 2), [PAPER_DAMPING]])
    return np.geomspace(1e2, 1e6, stiffnesses), np.sort(damping)


PAPER_DAMPING = 50.0  # B of the paper's walls [N s/m]


def stability_maps(depth: str = "quick", failures: list[Failure] | None = None) -> tuple[StabilityMap, ...]:
    """Return the maps of every loop under both laws, on the same walls; omit a loop if one of its maps raises an error.
    """
    stiffness, damping = grid(depth)
    K, B = walls(stiffness, damping)

    def both(loop: Loop) -> list[StabilityMap]:
        return [StabilityMap(loop, law, stiffness, damping, touch_walls(loop, K, B, law)) for law in LAWS]

    def name(loop: Loop) -> str:
        return f"walls at {loop.rate:g} Hz, delay {loop.delay}, device damping {loop.device_damping:g} N s/m"

    return tuple(of_each(loops(), both, failures, name))
