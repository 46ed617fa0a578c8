"""Laws of a whole trajectory. Each law uses only the arrays of a run, so it can also check a stored run.

A law returns a LawResidual, or None if it does not apply. To add a law, write the function here, add a line to
TRAJECTORY_LAWS, and add a fault to `planted_runs`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.contact.laws import ENGINE_LAWS
from iapb.errors import ArgumentError
from iapb.run import Run
from iapb.scene import scene_from_text
from iapb.system import System
from reference.exact import bulk_energy_gain, relative_energy_gain
from verification.laws.bounds import FACTORED, LawResidual

# A run is checked through its arrays and its scene text alone, so a stored run can be checked like a new one.

Floats = NDArray[np.float64]

EPS = float(np.finfo(float).eps)
BY_THE_ENGINE = ("impulse-augmented penalty", "penalty")


@dataclass(frozen=True)
class Trajectory:
    """A run, and quantities computed from it and its scene."""

    run: Run

    @property
    def by_the_engine(self) -> bool:
        """Whether the engine made the run with semi-implicit Euler: first v changes, then q moves by the new v."""
        run = self.run
        return run.law in BY_THE_ENGINE and run.law_settings.get("integrator") == "semi_implicit_euler"

    @property
    def carries_itself(self) -> bool:
        """Whether there is no unilateral coupler, which moves the tool from outside."""
        return self.run.coupling != "unilateral"

    @cached_property
    def system(self) -> Any:
        """Mechanism, gravity and step of the scene."""
        return System(scene_from_text(self.run.scene_source))

    @cached_property
    def masses(self) -> Floats:
        """M at the beginning of each step, (n, d, d); a constant M is computed once and broadcast."""
        mechanism, q = self.system.mechanism, self.run.q[:-1]
        if mechanism.has_constant_mass_matrix:
            one = mechanism.mass_matrix(q[0])
            return np.asarray(np.broadcast_to(one, (len(q), *one.shape)))
        return np.asarray(mechanism.mass_matrices(q))

    @cached_property
    def v_struck(self) -> Floats:
        """Velocity (n, d) after the impulse of each step and before its forces."""
        v, impulse = self.run.v[:-1].copy(), self.run.impulse
        struck = np.flatnonzero(np.any(impulse, axis=1))
        if len(struck):
            v[struck] += np.linalg.solve(self.masses[struck], impulse[struck][:, :, None])[:, :, 0]
        return v

    @cached_property
    def bias_and_gravity(self) -> Floats:
        """B + G (n, d) of (1) at the beginning of each step, after the impulse."""
        system, q = self.system, self.run.q[:-1]
        out = np.zeros_like(self.v_struck)
        if system.mechanism.has_velocity_terms:
            out += system.mechanism.biases(q, self.v_struck)
        if np.any(system.gravity):
            out += np.array([system.mechanism.gravity(at, system.gravity) for at in q])
        return out

    @cached_property
    def forces(self) -> Floats:
        """Sum (n, d) of all recorded generalized forces."""
        run = self.run
        return run.hand_force + run.coupling_force + run.penalty_force + run.friction_force

    @property
    def turns_over(self) -> bool:
        """Whether a spatial body may turn by half a turn or more in a step, so that its displacement is ambiguous."""
        run, mechanism = self.run, self.system.mechanism
        return bool(mechanism.nq != mechanism.nv and run.dt * np.max(np.abs(run.v[1:]), initial=0.0) >= HALF_TURN)

    @cached_property
    def displacements(self) -> Floats:
        """Displacement (n, d) of each step."""
        mechanism, q = self.system.mechanism, self.run.q
        if mechanism.nq == mechanism.nv:
            return np.asarray(np.diff(q, axis=0))
        return np.array([mechanism.difference(a, b) for a, b in zip(q[:-1], q[1:], strict=True)])


def norm(vector: Floats) -> Floats:
    """Largest magnitude along the last axis."""
    return np.asarray(np.max(np.abs(vector), axis=-1, initial=0.0))


# The state stays finite, or the run ends and gives a reason.

_ARRAYS = ("time", "q", "v", "device_q", "device_v", "hand_force", "coupling_force", "penalty_force",
           "friction_force", "impulse", "environment_force", "device_force")  # fmt: skip


def state_stays_finite(trajectory: Trajectory) -> LawResidual:
    """Number of arrays with an entry that is not finite, plus 1 if an incomplete run gives no reason; tolerance 0."""
    run = trajectory.run
    wrong = sum(not np.all(np.isfinite(getattr(run, name))) for name in _ARRAYS)
    wrong += sum(not np.all(np.isfinite(values)) for values in run.energy.values())
    return LawResidual("finite", float(wrong + (not run.complete and not run.stopped)), 0.0)


# Theorem 2 along a trajectory: no impact raises the kinetic energy of the bodies that it strikes.
def impacts_take_energy(trajectory: Trajectory) -> LawResidual | None:
    """Largest relative energy gain over its bound 10 d ε √κ(M), for M restricted to the trees with an impulse."""
    impacts = trajectory.run.impacts
    if not len(impacts.step):
        return None
    return LawResidual("impact_energy", max(_ratio(trajectory, k) for k in range(len(impacts.step))), 1.0)


def _ratio(trajectory: Trajectory, k: int) -> float:
    impacts = trajectory.run.impacts
    of = struck_coordinates(trajectory, impacts.impulse[k])
    before, after = impacts.v_minus[k][of], impacts.v_plus[k][of]
    if not before.any():
        return np.inf if after.any() else 0.0
    mass = trajectory.masses[impacts.step[k]][np.ix_(of, of)]
    values = np.linalg.eigvalsh(mass)
    allowed = FACTORED.factor * len(of) * EPS * float(np.sqrt(values[-1] / values[0]))
    return _gain(mass, before, after) / allowed


def _gain(mass: Floats, before: Floats, after: Floats) -> float:
    """Relative gain in double-double, or in exact rationals if the speeds of a diverging run exceed its range."""
    try:
        gain, bound = bulk_energy_gain(mass, before, after)
    except ArgumentError:
        return relative_energy_gain(mass, before, after)
    return float(gain[0]) if np.isfinite(bound[0]) else np.inf


def struck_coordinates(trajectory: Trajectory, impulse: Floats) -> Any:
    """Coordinates of all trees with an impulse; all coordinates if there is no impulse."""
    chosen = [np.arange(a, b) for a, b in trajectory.system.mechanism.tree_dofs if np.any(impulse[a:b])]
    return np.concatenate(chosen) if chosen else np.arange(len(impulse))


# (8): the recorded impulse explains the impact, M (v⁺ − v⁻) = Jᵀp, and the impact starts from the recorded state.
def impulses_explain_impacts(trajectory: Trajectory) -> LawResidual | None:
    """Largest of |M (v⁺ − v⁻) − impulse|∞ over d ε ‖M‖ |v|, and of the difference between a step's impulse and the sum
    of its impacts' impulses.
    """
    impacts, run = trajectory.run.impacts, trajectory.run
    if not len(impacts.step):
        return None
    masses = trajectory.masses[impacts.step]
    change = np.einsum("kij,kj->ki", masses, impacts.v_plus - impacts.v_minus)
    size = norm(masses.reshape(len(masses), -1)) * norm(np.hstack([impacts.v_minus, impacts.v_plus]))
    apart = norm(change - impacts.impulse) / np.maximum(size, np.finfo(float).tiny)
    total = np.zeros_like(run.impulse)
    np.add.at(total, impacts.step, impacts.impulse)
    lost = norm(total - run.impulse) / max(float(np.max(np.abs(run.impulse))), np.finfo(float).tiny)
    worst = max(float(np.max(apart)), float(np.max(lost)))
    # Solving with M, scaled to a unit diagonal, causes an error ε κ of the scaled matrix; κ is computed here.
    return LawResidual("impulse_momentum", worst, 10.0 * impacts.v_plus.shape[1] * EPS * _scaled_condition(masses))


def _scaled_condition(masses: np.ndarray) -> float:
    scale = 1.0 / np.sqrt(np.einsum("kii->ki", masses))
    return float(np.max(np.linalg.cond(masses * scale[:, :, None] * scale[:, None, :])))


# (1): the recorded forces alone move the bodies: M (v_{k+1} − v_k⁺)/Δt + B + G = Σ F.
def forces_explain_motion(trajectory: Trajectory) -> LawResidual | None:
    """Largest |M Δv − Δt (Σ F − B − G)|∞ over |M|(|v| + |v'|) + Δt Σ|F|, in units of d ε."""
    if not (trajectory.by_the_engine and trajectory.carries_itself):
        return None
    run, masses = trajectory.run, trajectory.masses
    changed = np.einsum("kij,kj->ki", masses, run.v[1:] - trajectory.v_struck)
    pushed = run.dt * (trajectory.forces - trajectory.bias_and_gravity)
    speed = np.abs(run.v[1:]) + np.abs(trajectory.v_struck) + np.abs(run.v[:-1])
    parts = (run.hand_force, run.coupling_force, run.penalty_force, run.friction_force, trajectory.bias_and_gravity)
    size = np.einsum("kij,kj->ki", np.abs(masses), speed) + run.dt * sum(np.abs(part) for part in parts)
    # One scale per step, not per coordinate, because a force on one link causes rounding in the other equations.
    apart = norm(changed - pushed) / np.maximum(norm(size), np.finfo(float).tiny)
    return LawResidual("motion", float(np.max(apart)), 20.0 * run.v.shape[1] * EPS)


# q moves by the new velocity, q_{k+1} = q_k ⊕ Δt v_{k+1}; rotations are integrated, because they are not vectors.
def velocity_moves_configuration(trajectory: Trajectory) -> LawResidual | None:
    """Largest |q_{k+1} − q_k ⊕ Δt v_{k+1}|∞ over |q| + Δt |v|."""
    if not (trajectory.by_the_engine and trajectory.carries_itself):
        return None
    run, mechanism = trajectory.run, trajectory.system.mechanism
    if mechanism.nq == mechanism.nv:
        moved = run.q[:-1] + run.dt * run.v[1:]
    else:
        moved = np.array([mechanism.integrate(q, v, run.dt) for q, v in zip(run.q[:-1], run.v[1:], strict=True)])
    size = 1.0 + norm(run.q[1:]) + run.dt * norm(run.v[1:])
    return LawResidual("kinematics", float(np.max(norm(moved - run.q[1:]) / size)), 16.0 * EPS)


# The energy balance closes: each work is the force times the displacement, and the impact losses follow from the
# velocities. With a constant mass matrix the integrator's error is known exactly: semi-implicit Euler loses ½ Δv·M Δv
# per step, with Δv due to the forces, and takes the weight −G as constant over a step.

_FORCES = ("hand", "coupling", "penalty", "friction")
HALF_TURN = np.pi / np.sqrt(3.0)  # [rad] of each of the three rates of a body


def ledger_closes(trajectory: Trajectory) -> LawResidual | None:
    """Largest difference between a recorded and a recomputed energy term, relative to the energy exchanged."""
    run = trajectory.run
    if not (trajectory.by_the_engine and trajectory.carries_itself) or not run.energy:
        return None
    works = {name: np.einsum("nd,nd->n", getattr(run, f"{name}_force"), trajectory.displacements) for name in _FORCES}
    kinetic, potential = _energies(trajectory)
    size = float(np.max(kinetic) + np.max(np.abs(potential)) + sum(np.sum(np.abs(work)) for work in works.values()))
    wrong = [_apart(np.cumsum(works[name]), run.energy[f"{name}_work"]) for name in _FORCES]
    wrong += [_apart(kinetic, run.energy["kinetic"]), _apart(potential, run.energy["potential"])]
    wrong += [_apart(_impact_losses(trajectory), run.energy["impact_loss"]), _apart(*_residuals(trajectory))]
    return LawResidual("ledger", max(wrong) / max(size, np.finfo(float).tiny), 10.0 * len(run.time) * EPS)


def _energies(trajectory: Trajectory) -> tuple[Floats, Floats]:
    """Kinetic energy ½ vᵀMv by einsum, and potential energy of the scene, at all instants."""
    run, system = trajectory.run, trajectory.system
    _, potential = system.mechanism.energies(run.q, run.v, system.gravity)
    last = system.mechanism.mass_matrix(run.q[-1])[None]
    masses = np.concatenate([trajectory.masses, last])
    return 0.5 * np.einsum("ni,nij,nj->n", run.v, masses, run.v), potential


def _impact_losses(trajectory: Trajectory) -> Floats:
    """Energy lost in impacts up to each step (n,), recomputed from each impact's velocities before and after."""
    impacts, losses = trajectory.run.impacts, np.zeros(trajectory.run.steps)
    masses = trajectory.masses[impacts.step]
    lost = -0.5 * np.einsum(
        "ki,kij,kj->k", impacts.v_plus - impacts.v_minus, masses, impacts.v_plus + impacts.v_minus
    )
    np.add.at(losses, impacts.step, lost)
    return np.asarray(np.cumsum(losses))


def _residuals(trajectory: Trajectory) -> tuple[Floats, Floats]:
    """Energy error of the integration, recorded and as computed from the method.

    Both are 0 if M varies or if a spatial body turns by half a turn in a step, because its displacement then differs
    from the integrated motion.
    """
    run, mechanism = trajectory.run, trajectory.system.mechanism
    if trajectory.turns_over or not mechanism.has_constant_mass_matrix:
        return np.zeros(1), np.zeros(1)
    dv = run.v[1:] - trajectory.v_struck
    lost = 0.5 * np.einsum("ni,nij,nj->n", dv, trajectory.masses, dv)
    constant_weight = np.einsum("nd,nd->n", trajectory.bias_and_gravity, trajectory.displacements)
    made = np.diff(run.energy["potential"]) - constant_weight - lost
    return run.energy["integration_residual"], np.cumsum(made)


def _apart(one: Floats, other: Floats) -> float:
    return float(np.max(np.abs(one - other), initial=0.0))


# (5): a contact with a force pushes with −K s − B v_n; it pulls only if the scene selects the `printed` penalty.
def contacts_push_by_the_penalty(trajectory: Trajectory) -> LawResidual | None:
    """Largest |F − (−K s − B v_n)| of the contacts with a force, relative to the terms; infinite if a contact pulls."""
    run, contacts = trajectory.run, trajectory.run.contacts
    if not trajectory.by_the_engine or not len(contacts.gap):
        return None
    constants = run.scene_resolved["contact"]
    K, B = constants["stiffness"], constants["damping"]
    force = -K * contacts.gap - B * contacts.normal_velocity
    if constants["penalty"] == "clamped":
        force = np.maximum(force, 0.0)
        if np.any(contacts.normal_force < 0.0):
            return LawResidual("penalty", np.inf, 1.0)
    size = K * np.abs(contacts.gap) + B * np.abs(contacts.normal_velocity) + np.finfo(float).tiny
    apart = np.where(contacts.normal_force != 0.0, np.abs(contacts.normal_force - force) / size, 0.0)
    return LawResidual("penalty", float(np.max(apart)), 16.0 * EPS)


# (6) and Coulomb's law: friction is at most μ F_n, lies in the contact plane, and is zero without a normal force.
def friction_stays_in_its_cone(trajectory: Trajectory) -> LawResidual | None:
    """Largest of |F_f| − μ F_n and |F_f · n|, relative to μ F_n; infinite if there is friction without a normal force.

    Subtracting v_n from the velocity rounds v_t by ε |v_n|, and (6) divides by v_threshold or more; the tolerance
    covers this error.
    """
    run, contacts = trajectory.run, trajectory.run.contacts
    if not trajectory.by_the_engine or not len(contacts.gap):
        return None
    constants = run.scene_resolved["contact"]
    most = trajectory.system.scene.largest_friction * np.maximum(contacts.normal_force, 0.0)
    length = np.linalg.norm(contacts.friction_force, axis=1)
    along = np.abs(np.einsum("ni,ni->n", contacts.friction_force, contacts.normal))
    excess = np.maximum(length - most, along)
    rounding = 1.0 + np.abs(contacts.normal_velocity) / constants["friction_velocity"]
    relative = np.divide(excess, most * rounding, out=np.where(excess > 0.0, np.inf, 0.0), where=most > 0.0)
    return LawResidual("friction", float(np.max(relative)), 16.0 * EPS)


# Friction by Coulomb's law dissipates energy in every step: its work is never positive.
def friction_takes_energy(trajectory: Trajectory) -> LawResidual | None:
    """Largest F_f · Δq of a step, relative to the rounding of that sum; the paper's explicit (6) is not checked.

    The work of a sticking contact is only rounding: each entry of Δq is the difference of two coordinates, and each
    entry of F_f is a sum over the contacts, whose terms may cancel.
    """
    run, contacts = trajectory.run, trajectory.run.contacts
    constants = run.scene_resolved["contact"]
    explicit = constants.get("friction_law", "regularised") != "coulomb"
    if explicit or run.law not in ENGINE_LAWS or not np.any(run.friction_force) or trajectory.turns_over:
        return None
    moved = trajectory.displacements
    work = np.einsum("nd,nd->n", run.friction_force, moved)
    step = np.repeat(np.arange(run.steps), np.diff(contacts.offsets))
    summed = np.bincount(step, np.linalg.norm(contacts.friction_force, axis=1), minlength=run.steps)
    size = (summed + norm(run.friction_force)) * (norm(run.q[:-1]) + norm(run.q[1:]) + norm(moved))
    relative = np.divide(work, size, out=np.where(work > 0.0, np.inf, 0.0), where=size > 0.0)
    return LawResidual("friction_work", float(np.max(relative)), 16.0 * moved.shape[1] * EPS)


# The device never exceeds its force limit, whatever contact, coupling and rendering require.
def device_keeps_its_limits(trajectory: Trajectory) -> LawResidual | None:
    """Largest |device force| over its limit; the law applies if the rendering fits impulses to the limits."""
    run = trajectory.run
    limit = (run.scene_resolved.get("device") or {}).get("force_limit")
    if limit is None or not run.device_force.size or run.law_settings.get("rendering", "full") == "full":
        return None
    return LawResidual("device_limits", float(np.max(np.abs(run.device_force) / np.array(limit))), 1.0)


class TrajectoryLaw(NamedTuple):
    """A law: its statement in words and its check."""

    statement: str
    check: Callable[[Trajectory], LawResidual | None]


TRAJECTORY_LAWS: dict[str, TrajectoryLaw] = {
    "finite": TrajectoryLaw("the state stays finite, or the run ends and says why", state_stays_finite),
    "impact_energy": TrajectoryLaw("no impact raises kinetic energy", impacts_take_energy),
    "impulse_momentum": TrajectoryLaw("M(v⁺ − v⁻) is the recorded impulse", impulses_explain_impacts),
    "motion": TrajectoryLaw("recorded forces explain the motion (1)", forces_explain_motion),
    "kinematics": TrajectoryLaw("q moves by the new velocity", velocity_moves_configuration),
    "ledger": TrajectoryLaw("the energy ledger closes", ledger_closes),
    "penalty": TrajectoryLaw("resting contacts push by (5)", contacts_push_by_the_penalty),
    "friction": TrajectoryLaw("friction stays in its cone", friction_stays_in_its_cone),
    "friction_work": TrajectoryLaw("friction does no positive work in any step", friction_takes_energy),
    "device_limits": TrajectoryLaw("the device keeps its force limits", device_keeps_its_limits),
}


def judge_run(run: Run) -> Iterator[tuple[str, LawResidual]]:
    """Yield the residual of every law that applies to a run; if the run is not finite, yield only that residual."""
    trajectory = Trajectory(run)
    for name, law in TRAJECTORY_LAWS.items():
        residual = law.check(trajectory)
        if residual is not None:
            yield name, residual
            if name == "finite" and not residual.passed:
                return
