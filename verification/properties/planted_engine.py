"""One fault for each law of `engine_laws`: a subject that the law must catch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.run import Run
from verification.properties.case import Floats
from verification.properties.engine_laws import ENGINE_LAWS, EngineLaw, judge_engine_law
from verification.properties.engine_laws.device_limits import saturated
from verification.properties.engine_laws.hand_port import Wall
from verification.properties.scenes import SceneCase
from verification.properties.sound import sound_resolver
from verification.stability.device_loop import DeviceLoop, actuator_forces

__all__ = ["ENGINE_LAWS", "PLANTED_ENGINE_FAULTS", "EngineLaw", "judge_engine_law"]


def not_orthogonal(M: Floats, J: Floats, v: Floats, e: float, budget: int) -> Floats:
    """The first rows as they are, each with the impulse it would need alone: exact for one row, not for more."""
    lower = np.linalg.cholesky(M)
    rows, u = np.linalg.solve(lower, J[:budget].T).T, lower.T @ v
    length = np.linalg.norm(rows, axis=1, keepdims=True)
    rows = np.divide(rows, length, out=np.zeros_like(rows), where=length > 0.0)
    return v - (1.0 + e) * np.linalg.solve(lower.T, rows.T @ (rows @ u))


def makes_late_wall() -> Wall:
    """Pushes by the reading before the last one."""
    before = [0.0]

    def late_wall(depth: float, rate: float, K: float, B: float) -> float:
        late, before[0] = before[0], depth
        return max(0.0, K * late + B * rate) if depth > 0.0 else 0.0

    return late_wall


def one_factor_for_all(case: SceneCase) -> Run:
    """Each impact, whoever it strikes, takes a thousandth of everybody's velocity at the end of its step."""
    run = case.simulate()
    factor = np.ones(len(run.time))
    np.multiply.at(factor, run.impacts.step + 1, 0.999)
    return replace(run, v=run.v * factor[:, None])


def stiffer_coupler(loop: DeviceLoop, positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """A coupler a twentieth stiffer than it is said to be."""
    return actuator_forces(replace(loop, stiffness=1.05 * loop.stiffness), positions)


# law -> (name of the fault, how to make its subject)
PLANTED_ENGINE_FAULTS: dict[str, tuple[str, Callable[[], Callable[..., Any]]]] = {
    "truncation": ("rows not made orthogonal", lambda: not_orthogonal),
    "device_limits": ("saturation, component by component", lambda: saturated),
    "group_splitting": ("one factor for all groups", lambda: one_factor_for_all),
    "hand_port": ("a wall one reading late", makes_late_wall),
    "device_port": ("a coupler stiffer than it says", lambda: stiffer_coupler),
    "extremes": ("plain numpy without checks", lambda: sound_resolver),
}
