"""One planted fault for each law of `engine_laws` (a faulty subject) and for each trajectory law (a faulty run)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.run import Run
from iapb.system import System
from verification.impacts import Floats
from verification.laws.engine_laws.device_limits import saturated
from verification.laws.engine_laws.hand_port import Wall
from verification.laws.resolver import sound_resolver
from verification.laws.scenes import SceneCase
from verification.stability.device_loop import DeviceLoop, actuator_forces


def not_orthogonal(M: Floats, J: Floats, v: Floats, e: float, budget: int) -> Floats:
    """Uses the first rows without orthogonalization, each with the impulse that it would need alone.

    The result is exact for one row only.
    """
    lower = np.linalg.cholesky(M)
    rows, u = np.linalg.solve(lower, J[:budget].T).T, lower.T @ v
    length = np.linalg.norm(rows, axis=1, keepdims=True)
    rows = np.divide(rows, length, out=np.zeros_like(rows), where=length > 0.0)
    return v - (1.0 + e) * np.linalg.solve(lower.T, rows.T @ (rows @ u))


def makes_late_wall() -> Wall:
    """Returns a wall whose spring uses the previous reading of the depth."""
    before = [0.0]

    def late_wall(depth: float, rate: float, K: float, B: float) -> float:
        late, before[0] = before[0], depth
        return max(0.0, K * late + B * rate) if depth > 0.0 else 0.0

    return late_wall


def one_factor_for_all(case: SceneCase) -> Run:
    """Multiplies the velocities of all bodies by 0.999 for each impact, at the end of its step."""
    run = case.simulate()
    factor = np.ones(len(run.time))
    np.multiply.at(factor, run.impacts.step + 1, 0.999)
    return replace(run, v=run.v * factor[:, None])


def stiffer_coupler(loop: DeviceLoop, positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Uses a coupler whose stiffness is 5 % above the stated one."""
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


# One fault for each trajectory law: a run that was simulated or recorded wrongly.
#
# A fault function takes a scene and returns such a run, or None if the fault has no effect in the scene.

Fault = Callable[[SceneCase], Run | None]


def not_a_number(case: SceneCase) -> Run:
    """Sets one velocity of the last state to NaN."""
    run = case.simulate()
    v = run.v.copy()
    v[-1, 0] = np.nan
    return replace(run, v=v)


def energised_impact(case: SceneCase) -> Run | None:
    """Makes the last impact return 1 + 1e-6 times the velocity before it."""
    run = case.simulate()
    if not len(run.impacts.step):
        return None
    v_plus = run.impacts.v_plus.copy()
    v_plus[-1] = -(1.0 + 1e-6) * run.impacts.v_minus[-1]
    return replace(run, impacts=replace(run.impacts, v_plus=v_plus))


def doubled_impulse(case: SceneCase) -> Run | None:
    """Records the impulses of the impacts with twice their value."""
    run = case.simulate()
    if not np.any(run.impulse):
        return None
    return replace(run, impacts=replace(run.impacts, impulse=2.0 * run.impacts.impulse))


def lost_gravity(case: SceneCase) -> Run | None:
    """Simulates a scene with gravity as if it had none."""
    if not case.values.get("gravity"):
        return None
    weightless = replace(case, values={key: value for key, value in case.values.items() if key != "gravity"})
    return replace(weightless.simulate(), scene_source=case.scene().source_text)


def moved_by_the_old_velocity(case: SceneCase) -> Run:
    """Combines positions of explicit Euler with velocities of semi-implicit Euler."""
    run, mechanism = case.simulate(), System(case.scene()).mechanism
    q = [run.q[0]]
    for v in run.v[:-1]:
        q.append(mechanism.integrate(q[-1], v, run.dt))
    return replace(run, q=np.array(q))


def missing_half(case: SceneCase) -> Run | None:
    """Erratum 1: records the impact losses without their factor ½."""
    run = case.simulate()
    if run.energy["impact_loss"][-1] < 1e-3 * np.max(run.energy["kinetic"]):
        return None
    return replace(run, energy=dict(run.energy) | {"impact_loss": 2.0 * run.energy["impact_loss"]})


def unclamped_penalty(case: SceneCase) -> Run | None:
    """Lets contacts pull, as in the printed equation, although the scene forbids it."""
    if case.values["contact"].get("penalty") == "printed" or not case.values["contact"]["damping"]:
        return None
    printed = replace(case, values=case.values | {"contact": case.values["contact"] | {"penalty": "printed"}})
    run = printed.simulate()
    pulls = bool(np.any(run.contacts.normal_force < 0.0))
    return replace(run, scene_resolved=case.scene().resolved()) if pulls else None


def unclamped_friction(case: SceneCase) -> Run | None:
    """Records 1.5 times the friction force, which exceeds the bound of Coulomb's law."""
    run = case.simulate()
    contacts, mu = run.contacts, run.scene_resolved["contact"]["friction"]
    length = np.linalg.norm(contacts.friction_force, axis=1)
    if not np.any((length > 0.0) & (length > 0.9 * mu * contacts.normal_force)):  # nothing slides
        return None
    return replace(run, contacts=replace(run.contacts, friction_force=1.5 * run.contacts.friction_force))


def explicit_friction(case: SceneCase) -> Run | None:
    """Simulates (6) instead of the scene's Coulomb law, with a threshold velocity too small for the step.

    The friction then accelerates bodies.
    """
    contact = case.values["contact"]
    if not contact.get("friction") or contact.get("friction_law") == "regularised":
        return None
    sharp = contact | {"friction_law": "regularised", "friction_velocity": 1e-6}
    run = replace(case, values=case.values | {"contact": sharp}).simulate()
    drives = bool(np.any(np.diff(run.energy["friction_work"]) > 0.0))
    return replace(run, scene_resolved=case.scene().resolved()) if drives else None


def device_beyond_its_limits(case: SceneCase) -> Run | None:
    """Gives the device the full force although the record states that it was limited."""
    limit = (case.values.get("device") or {}).get("force_limit")
    if limit is None or case.rendering == "full":
        return None
    run = replace(case, rendering="full").simulate()
    beyond = bool(np.any(np.abs(run.device_force) > np.array(limit)))
    return replace(run, law_settings=run.law_settings | {"rendering": case.rendering}) if beyond else None


# law -> the fault that it must detect
PLANTED_TRAJECTORY_FAULTS: dict[str, Fault] = {
    "finite": not_a_number,
    "impact_energy": energised_impact,
    "impulse_momentum": doubled_impulse,
    "motion": lost_gravity,
    "kinematics": moved_by_the_old_velocity,
    "ledger": missing_half,
    "penalty": unclamped_penalty,
    "friction": unclamped_friction,
    "friction_work": explicit_friction,
    "device_limits": device_beyond_its_limits,
}


def first_occasion(law: str, scenes: list[SceneCase]) -> Run | None:
    """Return the run with the law's fault in the first scene in which the fault has an effect, or None."""
    return next((run for case in scenes if (run := PLANTED_TRAJECTORY_FAULTS[law](case)) is not None), None)
