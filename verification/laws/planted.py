"""One planted fault for each law: a faulty resolver, a faulty subject of `engine`, or a faulty run.
Each law must detect its fault; other laws may detect it, too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from iapb.run import Run
from iapb.system import System
from verification.impacts import Floats, ImpactCase
from verification.laws.bounds import LawResidual
from verification.laws.resolver import Resolver
from verification.laws.scenes import SceneCase
from verification.laws.trajectories import TRAJECTORY_LAWS, Trajectory
from verification.methods import RANK_CUT, projecting, row_space, sound_resolver, whitened


class Fault(NamedTuple):
    """A fault: its name, and its resolver or subject, or what makes one with a memory of its
    own."""

    name: str
    subject: Callable[..., Any]
    remembers: bool = False

    def make(self) -> Callable[..., Any]:
        """Return the resolver or subject, with an empty memory."""
        subject: Callable[..., Any] = self.subject() if self.remembers else self.subject
        return subject


# Faulty resolvers, made from the parts of the correct one.
def wrong_sign(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    return projecting(M, J, v, -(1.0 + e))


def transposed_factor(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Uses L instead of Lᵀ."""
    case = ImpactCase(M, J, v)
    Q = row_space(case.unit_rows)
    u = case.lower @ v
    return np.linalg.solve(case.lower, u - (1.0 + e) * (Q.T @ (Q @ u)))


def per_body_rows(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """(13)-(14): reverses the two bodies of a self-collision separately (here: positive and
    negative entries)."""
    return sound_resolver(M, np.vstack([np.maximum(J, 0.0), np.minimum(J, 0.0)]), v, e)


@whitened
def one_after_the_other(A: Floats, u: Floats, e: float) -> Floats:
    """Resolves each contact once, in order, so later contacts undo earlier ones."""
    for row in A:
        u = u - (1.0 + e) * (row @ u) * row
    return u


@whitened
def double_counted(A: Floats, u: Floats, e: float) -> Floats:
    """Adds the impulses that each contact would need alone."""
    return u - (1.0 + e) * (A.T @ (A @ u))


@whitened
def one_gradient_step(A: Floats, u: Floats, e: float) -> Floats:
    """Stops an iteration after its first step, which depends on how often a row is repeated."""
    return u - (1.0 + e) / (np.linalg.norm(A, 2) ** 2 if A.any() else 1.0) * (A.T @ (A @ u))


def unscaled_rows(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Decides the rank without scaling the rows, so short rows are lost."""
    case = ImpactCase(M, J, v)
    _, values, right = np.linalg.svd(case.rows, full_matrices=False)
    Q = right[values > 1e-6 * np.max(values, initial=0.0)]
    u = case.u
    return np.linalg.solve(case.lower.T, u - (1.0 + e) * (Q.T @ (Q @ u)))


@whitened
def three_rows_at_most(A: Floats, u: Floats, e: float) -> Floats:
    """Uses at most three rows for all groups together."""
    Q = row_space(A)[:3]
    return u - (1.0 + e) * (Q.T @ (Q @ u))


def makes_warm_start() -> Resolver:
    """Returns a resolver whose answer depends on the previous call."""
    left = [0.0]

    def warm_start(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
        v_plus = sound_resolver(M, J, v, e) * (1.0 + left[0])
        left[0] = 1e-15 * float(np.max(np.abs(v)))
        return v_plus

    return warm_start


def makes_stale_answers() -> Resolver:
    """Returns a resolver that knows an impact by J, v and e, so a new M changes nothing."""
    known: dict[tuple[bytes, bytes, float], Floats] = {}

    def stale_answers(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
        key = J.tobytes(), v.tobytes(), e
        if key not in known:
            known[key] = sound_resolver(M, J, v, e)
        return known[key]

    return stale_answers


def writes_on_its_arguments(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    v[:] = sound_resolver(M, J, v, e)
    return v


@whitened
def each_contact_its_own_restitution(A: Floats, u: Floats, e: Floats) -> Floats:
    """Newton's law as equalities with a restitution per row: every row meets it, but it can create
    energy."""
    if np.ndim(e) == 0:
        Q = row_space(A)
        return u - (1.0 + e) * (Q.T @ (Q @ u))
    return u - np.linalg.pinv(A, rcond=RANK_CUT) @ ((1.0 + np.asarray(e)) * (A @ u))


PLANTED_BUGS: dict[str, Fault] = {
    "kinetic_energy": Fault("wrong_sign", wrong_sign),
    "restitution": Fault(
        "squared_restitution", lambda M, J, v, e: projecting(M, J, v, 1.0 + e * e)
    ),
    "free_motion": Fault(
        "too_tight_rank", lambda M, J, v, e: projecting(M, J, v, 1.0 + e, cut=1e-18)
    ),
    "impulse_range": Fault("transposed_factor", transposed_factor),
    # ignores the coupling between coordinates in M
    "coordinates": Fault(
        "diagonal_mass", lambda M, J, v, e: projecting(np.diag(np.diag(M)), J, v, 1.0 + e)
    ),
    "row_order": Fault("one_after_the_other", one_after_the_other),
    "duplicated_rows": Fault("double_counted", double_counted),
    "momentum": Fault("per_body_rows", per_body_rows),
    "row_scaling": Fault("unscaled_rows", unscaled_rows),
    "no_impulse": Fault(
        "absolute_restitution", lambda M, J, v, e: projecting(M, J, v, 1.0 + abs(e))
    ),
    # 1e-4 less of the impulse than e requires
    "elastic": Fault(
        "nearly_elastic", lambda M, J, v, e: projecting(M, J, v, (1.0 + e) * (1.0 - 1e-4))
    ),
    "redundancy": Fault("one_gradient_step", one_gradient_step),
    # a fixed length depends on the units
    "units": Fault(
        "short_rows_dropped",
        lambda M, J, v, e: sound_resolver(M, J[np.linalg.norm(J, axis=1) > 0.2], v, e),
    ),
    "groups": Fault("three_rows_at_most", three_rows_at_most),
    "repeatability": Fault("warm_start", makes_warm_start, remembers=True),
    "arguments": Fault("writes_on_its_arguments", writes_on_its_arguments),
    "new_mass": Fault("stale_answers", makes_stale_answers, remembers=True),
}


# Faulty subjects of the laws of `engine`.
def not_orthogonal(M: Floats, J: Floats, v: Floats, e: float, budget: int) -> Floats:
    """Uses the first rows, each with the impulse that it would need alone; exact for one row
    only."""
    return double_counted(M, J[:budget], v, e)


def one_factor_for_all(case: SceneCase) -> Run:
    """Multiplies the velocities of all bodies by 0.999 for each impact, at the end of its step."""
    run = case.simulate()
    factor = np.ones(len(run.time))
    np.multiply.at(factor, run.impacts.step + 1, 0.999)
    return replace(run, v=run.v * factor[:, None])


PLANTED_ENGINE_FAULTS: dict[str, Fault] = {
    "truncation": Fault("rows not made orthogonal", not_orthogonal),
    "group_splitting": Fault("one factor for all groups", one_factor_for_all),
}


# Runs that were simulated or recorded wrongly: a fault takes a scene and returns such a run, or
# None if it has no effect in the scene.
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
    doubled = replace(run.impacts, impulse=2.0 * run.impacts.impulse)
    return replace(run, impacts=doubled) if np.any(run.impulse) else None


def lost_gravity(case: SceneCase) -> Run | None:
    """Simulates a scene with gravity as if it had none."""
    if not case.values.get("gravity"):
        return None
    weightless = replace(
        case, values={key: value for key, value in case.values.items() if key != "gravity"}
    )
    return replace(weightless.simulate(), scene_source=case.scene().source_text)


def moved_by_the_old_velocity(case: SceneCase) -> Run:
    """Combines positions of explicit Euler with velocities of semi-implicit Euler."""
    run = case.simulate()
    mechanism = System(case.scene()).mechanism
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


def _simulated_as(case: SceneCase, **contact: Any) -> Run:
    """Return the run with other contact constants, recorded as one of the scene."""
    values = case.values | {"contact": case.values["contact"] | contact}
    return replace(replace(case, values=values).simulate(), scene_resolved=case.scene().resolved())


def unclamped_penalty(case: SceneCase) -> Run | None:
    """Lets contacts pull, as in the printed equation, although the scene forbids it."""
    if case.values["contact"].get("penalty") == "printed" or not case.values["contact"]["damping"]:
        return None
    run = _simulated_as(case, penalty="printed")
    return run if np.any(run.contacts.normal_force < 0.0) else None


def unclamped_friction(case: SceneCase) -> Run | None:
    """Records 1.5 times the friction force, which exceeds the bound of Coulomb's law."""
    run = case.simulate()
    contacts = run.contacts
    mu = run.scene_resolved["contact"]["friction"]
    length = np.linalg.norm(contacts.friction_force, axis=1)
    slides = np.any((length > 0.0) & (length > 0.9 * mu * contacts.normal_force))
    return (
        replace(run, contacts=replace(contacts, friction_force=1.5 * contacts.friction_force))
        if slides
        else None
    )


def driving_friction(case: SceneCase) -> Run | None:
    """Records friction along the slip, which drives bodies, instead of against it."""
    if not case.values["contact"].get("friction") or case.values["contact"]["forces"] == "paper":
        return None
    run = case.simulate()
    work = np.diff(run.energy["friction_work"], prepend=0.0)
    way = np.linalg.norm(np.diff(run.q, axis=0), axis=1)
    slides = work.min() < -0.01 * np.max(np.linalg.norm(run.friction_force, axis=1) * way)
    return replace(run, friction_force=-run.friction_force) if slides else None


def device_beyond_its_limits(case: SceneCase) -> Run | None:
    """Gives the device the full force although the record states that it was limited."""
    limit = (case.values.get("device") or {}).get("force_limit")
    if limit is None or case.rendering == "full":
        return None
    run = replace(case, rendering="full").simulate()
    beyond = bool(np.any(np.abs(run.device_force) > np.array(limit)))
    return (
        replace(run, law_settings=run.law_settings | {"rendering": case.rendering})
        if beyond
        else None
    )


PLANTED_TRAJECTORY_FAULTS: dict[str, Callable[[SceneCase], Run | None]] = {
    "finite": not_a_number,
    "impact_energy": energised_impact,
    "impulse_momentum": doubled_impulse,
    "motion": lost_gravity,
    "kinematics": moved_by_the_old_velocity,
    "ledger": missing_half,
    "penalty": unclamped_penalty,
    "friction": unclamped_friction,
    "friction_work": driving_friction,
    "device_limits": device_beyond_its_limits,
}


def residual_with_fault(law: str, scenes: list[SceneCase]) -> LawResidual | None:
    """Return the residual of a law with its fault, in the first scene to which the law applies and
    in which the fault makes a difference; None if there is no such scene."""
    for case in scenes:
        run = PLANTED_TRAJECTORY_FAULTS[law](case)
        residual = None if run is None else TRAJECTORY_LAWS[law].check(Trajectory(run))
        if residual is not None:
            return residual
    return None
