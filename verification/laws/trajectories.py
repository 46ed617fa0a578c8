"""Laws of a whole trajectory. Each law uses only the arrays of a run, so it can also check a stored
run.

A law returns a residual and its tolerance, or None if it does not apply. To add a law, write its
function here, and add a fault to `planted`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.contact.laws import ENGINE_LAWS
from iapb.run import Run
from iapb.scene import scene_from_text
from iapb.system import System
from reference import Floats
from reference.exact import relative_energy_gain
from verification.impacts import EPS, over
from verification.laws.bounds import FACTORED, Found, Law, LawResidual, law

TRAJECTORY_LAWS: dict[str, Law] = {}
PLAIN_LAWS = ("impulse-augmented penalty", "penalty")
TINY = float(np.finfo(float).tiny)
HALF_TURN = np.pi / np.sqrt(3.0)  # [rad] of each of the three rates of a body
_ARRAYS = (
    "time",
    "q",
    "v",
    "device_q",
    "device_v",
    "hand_force",
    "coupling_force",
    "penalty_force",
    "friction_force",
    "impulse",
    "environment_force",
    "device_force",
)
_FORCES = ("hand", "coupling", "penalty", "friction")


@dataclass(frozen=True)
class Trajectory:
    """A run, and quantities computed from it and its scene."""

    run: Run

    @property
    def by_plain_euler(self) -> bool:
        """Whether the engine made the run with semi-implicit Euler: first v changes, then q moves
        by the new v."""
        return (
            self.run.law in PLAIN_LAWS
            and self.run.law_settings.get("integrator") == "semi_implicit_euler"
        )

    @property
    def implicit(self) -> bool:
        """Whether the forces of resting contacts follow from the velocity at the end of the
        step."""
        return bool(self.run.scene_resolved["contact"]["forces"] == "implicit")

    @property
    def is_explained(self) -> bool:
        """Whether all that moves the bodies is recorded: a unilateral coupler moves the tool from
        outside."""
        return self.by_plain_euler and self.run.coupling != "unilateral"

    @cached_property
    def system(self) -> Any:
        """Mechanism, gravity and step of the scene."""
        return System(scene_from_text(self.run.scene_source))

    @cached_property
    def masses(self) -> Floats:
        """M at each instant, (n + 1, d, d)."""
        return self._masses_at(self.run.q)

    @cached_property
    def struck_masses(self) -> Floats:
        """M at each impact, (k, d, d)."""
        return self._masses_at(self.run.impacts.q)

    def _masses_at(self, q: Floats) -> Floats:
        masses: Floats = self.system.mechanism.mass_matrices_of_run(self.system.start[0], q)
        return masses

    @cached_property
    def cut(self) -> NDArray[np.bool_]:
        """Whether impacts happen within each step (n,): it then has more than one velocity, and its
        forces are means."""
        impacts = self.run.impacts
        found = np.zeros(self.run.steps, np.bool_)
        found[impacts.step[impacts.time > impacts.step * self.run.dt]] = True
        return found

    @cached_property
    def v_struck(self) -> Floats:
        """Velocity (n, d) after the impulse of each step and before its forces."""
        run = self.run
        return run.v[:-1] + np.linalg.solve(self.masses[:-1], run.impulse[:, :, None])[:, :, 0]

    @cached_property
    def bias_and_gravity(self) -> Floats:
        """B + G (n, d) of (1) at the beginning of each step, after the impulse."""
        system = self.system
        q = self.run.q[:-1]
        out = np.zeros_like(self.v_struck)
        if system.mechanism.has_velocity_terms:
            out += system.mechanism.biases(q, self.v_struck)
        if np.any(system.gravity):
            out += [system.mechanism.gravity(at, system.gravity) for at in q]
        return out

    @property
    def turns_over(self) -> bool:
        """Whether a spatial body may turn by half a turn or more in a step, so that its
        displacement is ambiguous."""
        run = self.run
        mechanism = self.system.mechanism
        return bool(
            mechanism.nq != mechanism.nv
            and run.dt * np.max(np.abs(run.v[1:]), initial=0.0) >= HALF_TURN
        )

    @cached_property
    def displacements(self) -> Floats:
        """Displacement (n, d) of each step."""
        mechanism = self.system.mechanism
        if mechanism.nq == mechanism.nv:  # without the kernel that is judged
            return np.diff(self.run.q, axis=0)
        moved: Floats = mechanism.displacements(self.run.q)
        return moved


def norm(vector: Floats) -> Floats:
    """Largest magnitude along the last axis."""
    return np.asarray(np.max(np.abs(vector), axis=-1, initial=0.0))


@law(TRAJECTORY_LAWS, "finite", "the state stays finite, or the run stops and gives the reason")
def state_stays_finite(trajectory: Trajectory) -> Found:
    """Number of arrays with an entry that is not finite, plus 1 if an incomplete run gives no
    reason; tolerance 0."""
    run = trajectory.run
    wrong = sum(not np.all(np.isfinite(getattr(run, name))) for name in _ARRAYS)
    wrong += sum(not np.all(np.isfinite(values)) for values in run.energy.values())
    return float(wrong + (not run.complete and not run.stopped)), 0.0


@law(TRAJECTORY_LAWS, "impact_energy", "no impact raises kinetic energy")
def impacts_take_energy(trajectory: Trajectory) -> Found:
    """Theorem 2: largest energy gain over its bound 10 d ε √κ(M), for M restricted to the trees
    with an impulse."""
    impacts = trajectory.run.impacts
    ratios = []
    for k, whole in enumerate(trajectory.struck_masses):
        trees = [
            np.arange(a, b)
            for a, b in trajectory.system.mechanism.tree_dofs
            if impacts.impulse[k, a:b].any()
        ]
        of = np.concatenate(trees) if trees else np.arange(impacts.impulse.shape[1])
        mass = whole[np.ix_(of, of)]
        gain = relative_energy_gain(mass, impacts.v_minus[k][of], impacts.v_plus[k][of])
        values = np.linalg.eigvalsh(mass)
        ratios.append(
            gain / (FACTORED.factor * len(of) * EPS * float(np.sqrt(values[-1] / values[0])))
        )
    return (max(ratios), 1.0) if ratios else None


@law(TRAJECTORY_LAWS, "impulse_momentum", "M(v⁺ − v⁻) is the recorded impulse")
def impulses_explain_impacts(trajectory: Trajectory) -> Found:
    """(8): largest of |M (v⁺ − v⁻) − impulse|∞ over d ε ‖M‖ |v|, and of the difference between a
    step's impulse and the sum of its impacts' impulses.

    Solving with M, scaled to a unit diagonal, causes an error ε κ of the scaled matrix; κ is
    computed here.
    """
    impacts = trajectory.run.impacts
    run = trajectory.run
    if not len(impacts.step):
        return None
    masses = trajectory.struck_masses
    change = np.einsum("kij,kj->ki", masses, impacts.v_plus - impacts.v_minus)
    size = norm(masses.reshape(len(masses), -1)) * norm(
        np.hstack([impacts.v_minus, impacts.v_plus])
    )
    apart = norm(change - impacts.impulse) / np.maximum(size, TINY)
    total = np.zeros_like(run.impulse)
    np.add.at(total, impacts.step, impacts.impulse)
    lost = norm(total - run.impulse) / max(float(np.max(np.abs(run.impulse))), TINY)
    scale = 1.0 / np.sqrt(np.einsum("kii->ki", masses))
    condition = float(np.max(np.linalg.cond(masses * scale[:, :, None] * scale[:, None, :])))
    return max(float(np.max(apart)), float(np.max(lost))), 10.0 * impacts.v_plus.shape[
        1
    ] * EPS * condition


@law(TRAJECTORY_LAWS, "motion", "velocities change as the recorded forces demand (1)")
def forces_explain_motion(trajectory: Trajectory) -> Found:
    """Largest |M Δv − Δt (Σ F − B − G)|∞ over |M|(|v| + |v'|) + Δt Σ|F|, in units of d ε.

    There is one scale per step, not per coordinate, because a force on one link causes rounding in
    the other equations. Implicit contact is not checked: an iteration finds its forces, to less
    than rounding.
    """
    if not trajectory.is_explained or trajectory.implicit:
        return None
    run = trajectory.run
    masses = trajectory.masses[:-1]
    changed = np.einsum("kij,kj->ki", masses, run.v[1:] - trajectory.v_struck)
    forces = (run.hand_force, run.coupling_force, run.penalty_force, run.friction_force)
    pushed = run.dt * (sum(forces) - trajectory.bias_and_gravity)
    speed = np.abs(run.v[1:]) + np.abs(trajectory.v_struck) + np.abs(run.v[:-1])
    size = np.einsum("kij,kj->ki", np.abs(masses), speed)
    size += run.dt * sum(np.abs(part) for part in (*forces, trajectory.bias_and_gravity))
    apart = norm(changed - pushed) / np.maximum(norm(size), TINY)
    return float(np.max(apart)), 20.0 * run.v.shape[1] * EPS


@law(TRAJECTORY_LAWS, "kinematics", "q changes by the new velocity times the step")
def velocity_moves_configuration(trajectory: Trajectory) -> Found:
    """Largest |q_{k+1} − q_k ⊕ Δt v_{k+1}|∞ over |q| + Δt |v|; rotations are integrated, as they
    are no vectors."""
    if not trajectory.is_explained or trajectory.cut.any():
        return None
    run = trajectory.run
    mechanism = trajectory.system.mechanism
    if mechanism.nq == mechanism.nv:  # without the kernel that is judged
        moved = run.q[:-1] + run.dt * run.v[1:]
    else:
        each = zip(run.q[:-1], run.v[1:], strict=True)
        moved = np.array([mechanism.integrate(q, v, run.dt) for q, v in each])
    size = 1.0 + norm(run.q[1:]) + run.dt * norm(run.v[1:])
    return float(np.max(norm(moved - run.q[1:]) / size)), 16.0 * EPS


@law(TRAJECTORY_LAWS, "ledger", "stored energy, work and losses balance")
def ledger_closes(trajectory: Trajectory) -> Found:
    """Largest difference between a recorded and a recomputed energy term, relative to the energy
    exchanged.

    Each work is the force times the displacement, and the impact losses follow from the velocities.
    With a constant mass matrix the integrator's error is known exactly: see `_residuals`.
    """
    run = trajectory.run
    system = trajectory.system
    if not trajectory.is_explained or not run.energy:
        return None
    works = {
        name: np.einsum("nd,nd->n", getattr(run, f"{name}_force"), trajectory.displacements)
        for name in _FORCES
    }
    _, potential = system.mechanism.energies(run.q, run.v, system.gravity)
    kinetic = 0.5 * np.einsum("ni,nij,nj->n", run.v, trajectory.masses, run.v)
    size = float(
        np.max(kinetic)
        + np.max(np.abs(potential))
        + sum(np.sum(np.abs(work)) for work in works.values())
    )
    impacts = run.impacts
    losses = np.zeros(run.steps)
    v = impacts.v_plus + impacts.v_minus
    dv = impacts.v_plus - impacts.v_minus
    np.add.at(
        losses,
        impacts.step,
        -0.5 * np.einsum("ki,kij,kj->k", dv, trajectory.struck_masses, v),
    )
    pairs = [(np.cumsum(works[name]), run.energy[f"{name}_work"]) for name in _FORCES]
    pairs += [
        (kinetic, run.energy["kinetic"]),
        (potential, run.energy["potential"]),
        (np.cumsum(losses), run.energy["impact_loss"]),
        _residuals(trajectory),
    ]
    wrong = max(float(np.max(np.abs(one - other), initial=0.0)) for one, other in pairs)
    return wrong / max(size, TINY), 10.0 * len(run.time) * EPS


def _residuals(trajectory: Trajectory) -> tuple[Floats, Floats]:
    """Energy error of the integration, recorded and as computed from the method.

    Semi-implicit Euler loses ½ Δv·M Δv per step, with Δv due to the forces, and takes the weight −G
    as constant over a step. Both are 0 if M varies, if contact is implicit (an iteration finds its
    forces, to less than rounding), or if a spatial body turns by half a turn in a step, because its
    displacement then differs from the integrated motion.
    """
    run = trajectory.run
    if (
        trajectory.implicit
        or trajectory.turns_over
        or not trajectory.system.mechanism.has_constant_mass_matrix
    ):
        return np.zeros(1), np.zeros(1)
    dv = run.v[1:] - trajectory.v_struck
    lost = 0.5 * np.einsum("ni,nij,nj->n", dv, trajectory.masses[:-1], dv)
    constant_weight = np.einsum("nd,nd->n", trajectory.bias_and_gravity, trajectory.displacements)
    return run.energy["integration_residual"], np.cumsum(
        np.diff(run.energy["potential"]) - constant_weight - lost
    )


@law(TRAJECTORY_LAWS, "penalty", "resting contacts push with the force (5)")
def contacts_push_by_the_penalty(trajectory: Trajectory) -> Found:
    """Largest |F − (−K s − B v_n)| of the contacts with a force, relative to the terms.

    A contact pulls only if the scene selects the `printed` penalty; otherwise a pull is infinite.
    """
    run = trajectory.run
    contacts = trajectory.run.contacts
    if not trajectory.by_plain_euler or trajectory.implicit or not len(contacts.gap):
        return None
    constants = run.scene_resolved["contact"]
    K = constants["stiffness"]
    B = constants["damping"]
    force = -K * contacts.gap - B * contacts.normal_velocity
    if constants["penalty"] == "clamped":
        force = np.maximum(force, 0.0)
        if np.any(contacts.normal_force < 0.0):
            return np.inf, 1.0
    size = K * np.abs(contacts.gap) + B * np.abs(contacts.normal_velocity) + TINY
    apart = np.where(
        contacts.normal_force != 0.0, np.abs(contacts.normal_force - force) / size, 0.0
    )
    return float(np.max(apart)), 16.0 * EPS


@law(TRAJECTORY_LAWS, "friction", "friction stays in its cone")
def friction_stays_in_its_cone(trajectory: Trajectory) -> Found:
    """(6): largest of |F_f| − μ F_n and |F_f · n|, relative to μ F_n; infinite if μ F_n = 0.

    Subtracting v_n from the velocity rounds v_t by ε |v_n|, and (6) divides by v_threshold or more;
    the tolerance covers this error.
    """
    run = trajectory.run
    contacts = trajectory.run.contacts
    if not trajectory.by_plain_euler or trajectory.implicit or not len(contacts.gap):
        return None
    most = trajectory.system.scene.largest_friction * np.maximum(contacts.normal_force, 0.0)
    length = np.linalg.norm(contacts.friction_force, axis=1)
    along = np.abs(np.einsum("ni,ni->n", contacts.friction_force, contacts.normal))
    rounding = (
        1.0 + np.abs(contacts.normal_velocity) / run.scene_resolved["contact"]["friction_velocity"]
    )
    return float(np.max(over(np.maximum(length - most, along), most * rounding))), 16.0 * EPS


@law(TRAJECTORY_LAWS, "friction_work", "friction drives nothing")
def friction_takes_energy(trajectory: Trajectory) -> Found:
    """Largest positive work F_f · Δq of a step of implicit contact, as a share of the largest work
    of a step; (6) may do positive work.

    Friction opposes the slip along the arcs that points move on in a step, and F_f · Δq is along
    their tangents. The difference is a share ω Δt/2 of the way of the points, so a hundredth of the
    largest |F_f| |Δq| is added to the divisor. Friction that drives by a tenth is noticed.
    """
    run = trajectory.run
    if (
        not trajectory.implicit
        or run.law not in ENGINE_LAWS
        or not np.any(run.friction_force)
        or trajectory.turns_over
    ):
        return None
    moved = np.where(trajectory.cut[:, None], 0.0, trajectory.displacements)
    work = np.einsum("nd,nd->n", run.friction_force, moved)
    arcs = 0.01 * float(np.max(norm(run.friction_force) * norm(moved)))
    return float(np.max(work)) / (float(np.max(np.abs(work))) + arcs + TINY), 0.1


@law(TRAJECTORY_LAWS, "device_limits", "the device keeps its force limits")
def device_keeps_its_limits(trajectory: Trajectory) -> Found:
    """Largest |device force| over its limit; the law applies if the rendering fits impulses to the
    limits."""
    run = trajectory.run
    limit = (run.scene_resolved.get("device") or {}).get("force_limit")
    if (
        limit is None
        or not run.device_force.size
        or run.law_settings.get("rendering", "full") == "full"
    ):
        return None
    return float(np.max(np.abs(run.device_force) / np.array(limit))), 1.0


def judge_run(
    run: Run, laws: dict[str, Law] = TRAJECTORY_LAWS
) -> Iterator[tuple[str, LawResidual]]:
    """Yield the residual of every law that applies to a run; if the run is not finite, yield only
    that residual."""
    trajectory = Trajectory(run)
    for name, one in laws.items():
        residual = one.check(trajectory)
        if residual is not None:
            yield name, residual
            if name == "finite" and not residual.passed:
                return
