"""One fault for each law of `engine_laws`, a subject; and one for each law of a trajectory, a run that went wrong."""

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


# One fault for each law of a trajectory: a run in which something was done wrong, or written down wrong.
#
# A fault takes a scene and returns such a run, or None where the scene gives it no occasion.

Fault = Callable[[SceneCase], Run | None]


def not_a_number(case: SceneCase) -> Run:
    """A speed that is no number, in the last state only."""
    run = case.simulate()
    v = run.v.copy()
    v[-1, 0] = np.nan
    return replace(run, v=v)


def energised_impact(case: SceneCase) -> Run | None:
    """The last impact comes out a millionth too fast for an elastic one."""
    run = case.simulate()
    if not len(run.impacts.step):
        return None
    v_plus = run.impacts.v_plus.copy()
    v_plus[-1] = -(1.0 + 1e-6) * run.impacts.v_minus[-1]
    return replace(run, impacts=replace(run.impacts, v_plus=v_plus))


def doubled_impulse(case: SceneCase) -> Run | None:
    """An impulse that is counted twice."""
    run = case.simulate()
    if not np.any(run.impulse):
        return None
    return replace(run, impacts=replace(run.impacts, impulse=2.0 * run.impacts.impulse))


def lost_gravity(case: SceneCase) -> Run | None:
    """The scene says gravity, the simulation has none."""
    if not case.values.get("gravity"):
        return None
    weightless = replace(case, values={key: value for key, value in case.values.items() if key != "gravity"})
    return replace(weightless.simulate(), scene_source=case.scene().source_text)


def moved_by_the_old_velocity(case: SceneCase) -> Run:
    """Positions of explicit Euler beside velocities of semi-implicit Euler."""
    run, mechanism = case.simulate(), System(case.scene()).mechanism
    q = [run.q[0]]
    for v in run.v[:-1]:
        q.append(mechanism.integrate(q[-1], v, run.dt))
    return replace(run, q=np.array(q))


def missing_half(case: SceneCase) -> Run | None:
    """Erratum 1: impact losses without their ½."""
    run = case.simulate()
    if run.energy["impact_loss"][-1] < 1e-3 * np.max(run.energy["kinetic"]):
        return None
    return replace(run, energy=dict(run.energy) | {"impact_loss": 2.0 * run.energy["impact_loss"]})


def unclamped_penalty(case: SceneCase) -> Run | None:
    """The scene says that contacts never pull; the simulation lets them, as printed."""
    if case.values["contact"].get("penalty") == "printed" or not case.values["contact"]["damping"]:
        return None
    printed = replace(case, values=case.values | {"contact": case.values["contact"] | {"penalty": "printed"}})
    run = printed.simulate()
    pulls = bool(np.any(run.contacts.normal_force < 0.0))
    return replace(run, scene_resolved=case.scene().resolved()) if pulls else None


def unclamped_friction(case: SceneCase) -> Run | None:
    """Friction proportional to speed, without the bound of Coulomb's law."""
    run = case.simulate()
    contacts, mu = run.contacts, run.scene_resolved["contact"]["friction"]
    length = np.linalg.norm(contacts.friction_force, axis=1)
    if not np.any((length > 0.0) & (length > 0.9 * mu * contacts.normal_force)):  # nothing slides
        return None
    return replace(run, contacts=replace(run.contacts, friction_force=1.5 * run.contacts.friction_force))


def explicit_friction(case: SceneCase) -> Run | None:
    """The scene says Coulomb's law; the simulation does (6), too sharp for its step, and drives bodies."""
    contact = case.values["contact"]
    if not contact.get("friction") or contact.get("friction_law") == "regularised":
        return None
    sharp = contact | {"friction_law": "regularised", "friction_velocity": 1e-6}
    run = replace(case, values=case.values | {"contact": sharp}).simulate()
    drives = bool(np.any(np.diff(run.energy["friction_work"]) > 0.0))
    return replace(run, scene_resolved=case.scene().resolved()) if drives else None


def device_beyond_its_limits(case: SceneCase) -> Run | None:
    """The device gets what is asked for; the record says that it was cut to the limits."""
    limit = (case.values.get("device") or {}).get("force_limit")
    if limit is None or case.rendering == "full":
        return None
    run = replace(case, rendering="full").simulate()
    beyond = bool(np.any(np.abs(run.device_force) > np.array(limit)))
    return replace(run, law_settings=run.law_settings | {"rendering": case.rendering}) if beyond else None


# law -> the fault that it must catch
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
    """The law's fault in the first of the scenes that gives it an occasion."""
    return next((run for case in scenes if (run := PLANTED_TRAJECTORY_FAULTS[law](case)) is not None), None)
