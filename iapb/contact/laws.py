"""Contact laws: each computes a whole step from (q, v). Engine, references and users share one
protocol.

The engine has two laws. `ImpulseAugmented`, the paper's law, applies impulses while a contact is
new and penalty forces while it lasts. `Penalty` applies penalty forces alone: the same algorithm
with e = −1, at which a collision changes nothing (claim C09). `reference.time_stepping` adds rigid
constraints. Any class with `name`, `settings` and `advance` is a law.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, NamedTuple, Protocol, Self

from iapb.contact.kernels.motion import STATUS_TEXT
from iapb.contact.kernels.step import contact_state
from iapb.contact.kernels.world import State
from iapb.errors import ArgumentError, IapbError
from iapb.names import one_of
from iapb.numerics.compiled import Entry
from iapb.numerics.schema import Floats

INTEGRATORS = ("momentum", "semi_implicit_euler")  # of a scene: see `iapb.contact.kernels.motion`
RENDERINGS = ("full", "saturate", "scale", "spread")

# Parts of a scene's contact section. A law's attribute `uses` names the parts that affect it.
PENALTY = "penalty"
IMPULSES = "impulses"
FRICTION = "friction"
CLUSTERS = "clusters"
NEWNESS = "newness"
IMPACT_FRICTION = "impact friction"
OWN_RESTITUTION = "own restitution"
JOINT_FRICTION = "joint friction"
TOUCH = "touch"  # impacts at the moment of touch
JOINTS = "joints"  # damping and limits of joints: a law that does not name this part ignores them
# what a law without `uses` is taken to use: not joints, nor the moment of touch
ASSUMED = frozenset(
    {PENALTY, IMPULSES, FRICTION, CLUSTERS, NEWNESS, IMPACT_FRICTION, OWN_RESTITUTION}
)


class StepResult(NamedTuple):
    """Result of one step of a law (d generalized velocities)."""

    q: Floats  # (nq,) configuration at the end of the step
    v: Floats  # (d,) generalized velocity at the end of the step [m/s, rad/s]
    penalty_force: Floats  # (d,) generalized normal contact force over the step [N, N m]
    friction_force: Floats  # (d,)
    impulse: Floats  # (d,) generalized collision impulse [N s, N m s], on top of the forces
    state: int  # FREE, COLLIDING or RESTING: the tool's contact state (see iapb.run)


STEP_VECTORS = StepResult._fields[:-1]
_contact_state = Entry(contact_state)


def copied_step(system: Any, state: State) -> StepResult:
    """Return copies of the results of the step that `state` has just made."""
    vectors = [getattr(state, name).copy() for name in STEP_VECTORS]
    return StepResult._make([*vectors, int(_contact_state(state, system.tool_tree))])


class ContactLaw(Protocol):
    """A contact law: it computes the whole step.

    A law may also write its contacts to ``state.contacts`` and their number to
    ``state.contact_count[0]``; the run then records them. A law should keep no state of its own:
    everything that changes belongs in `state`. The optional attribute `uses` names the parts of the
    contact section that affect the law (`iapb.effects` reads it). Without it, every part is
    assumed to affect the law.
    """

    @property
    def name(self) -> str:
        """Name of the law, recorded in every run."""
        ...

    @property
    def settings(self) -> dict[str, Any]:
        """Settings of the law, recorded in every run: plain numbers and texts."""
        ...

    def advance(self, system: Any, state: State, applied_force: Floats, dt: float) -> StepResult:
        """Advance (state.q, state.v) by dt [s] under a generalized force (d,) held constant over
        the step."""
        ...


@dataclass(frozen=True)
class _EngineLaw:
    """Base class of the engine's two laws: an integrator, by default the scene's, and a compiled
    kernel."""

    integrator: str | None = None

    def __post_init__(self) -> None:
        if self.integrator is not None and self.integrator not in INTEGRATORS:
            raise ArgumentError("integrator", self.integrator, one_of(self.integrator, INTEGRATORS))

    def advance(self, system: Any, state: State, applied_force: Floats, dt: float) -> StepResult:
        """Advance one step by the compiled kernel (see `ContactLaw`)."""
        if dt != system.dt:
            raise ArgumentError(
                "dt",
                dt,
                f"the step of the scene, {system.dt!r} s; to change it, set the scene's rate",
            )
        status = system.advance(self, state, applied_force)
        if status:
            raise IapbError(STATUS_TEXT[status])
        return copied_step(system, state)

    def within(self, scene: Any) -> Self:
        """Return the law with the scene's choices where it leaves them open."""
        return self if self.integrator else replace(self, integrator=scene.own_integrator)

    @property
    def settings(self) -> dict[str, Any]:
        """Settings of the law; `pushing` only if it is True."""
        settings = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: value for name, value in settings.items() if name != "pushing" or value}


@dataclass(frozen=True)
class ImpulseAugmented(_EngineLaw):
    """The paper's law: impulses (20)-(21) when a contact is new, penalty (5) and friction (6) while
    it lasts.

    Parameters
    ----------
    integrator : ``momentum`` or ``semi_implicit_euler`` (`iapb.contact.kernels.motion`); default: the
        scene's.
    rendering : how the device's force limits affect impulses (paper section VI). ``full`` ignores
        the limits; ``saturate`` clips the force on the device; ``scale`` scales the impulse of tool
        and device alike; ``spread`` scales it and stays in collision until the rest is rendered.
        Without limits in the scene all four are the same.
    friction_in_impacts : whether `contact.friction` acts in collisions too, by Coulomb's law and
        without energy gain (`iapb.resolve_frictional_impact`). Default: the scene decides: False
        for `forces: paper`, which leaves it to future work, and where contacts only push; else
        True.
    pushing : whether contacts can only push. Every collision then uses Poisson's law by two LCPs
        (`method="poisson"` of `iapb.resolve_impact`) instead of (21), which takes every row as an
        equality. Default: False, as in the paper.
    """

    rendering: str = "full"
    friction_in_impacts: bool | None = None
    pushing: bool = False
    impulses = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.rendering not in RENDERINGS:
            raise ArgumentError("rendering", self.rendering, one_of(self.rendering, RENDERINGS))
        for name in ("friction_in_impacts", "pushing"):
            allowed = bool | None if name == "friction_in_impacts" else bool
            if not isinstance(getattr(self, name), allowed):
                raise ArgumentError(name, getattr(self, name), "True or False")
        if self.friction_in_impacts and self.pushing:
            raise ArgumentError(
                "pushing", True, "False: friction_in_impacts needs impulses that may pull"
            )

    def within(self, scene: Any) -> Self:
        """Return the law with the scene's choices where it leaves them open."""
        law = super().within(scene)
        if law.friction_in_impacts is not None:
            return law
        coulomb = scene.contact.forces != "paper" and scene.largest_friction > 0.0
        return replace(law, friction_in_impacts=coulomb and not law.pushing)

    @property
    def name(self) -> str:
        """Name of the law; it says whether friction acts in impacts or contacts only push."""
        extra = ", contacts only push" if self.pushing else ""
        if self.friction_in_impacts:
            extra = " with impact friction"
        return f"impulse-augmented penalty{extra}"

    @property
    def uses(self) -> frozenset[str]:
        """Parts of the scene that the law uses."""
        parts = ASSUMED | {JOINTS, JOINT_FRICTION, TOUCH}
        return parts if self.friction_in_impacts else parts - {IMPACT_FRICTION}


@dataclass(frozen=True)
class Penalty(_EngineLaw):
    """Penalty forces alone: (5)-(6) act at every contact, new or old. NEWNESS is for the record."""

    name = "penalty"
    impulses = False
    friction_in_impacts = pushing = False
    rendering = "full"
    uses = frozenset({PENALTY, FRICTION, CLUSTERS, NEWNESS, JOINTS, JOINT_FRICTION})


_LAWS = (
    ImpulseAugmented(),
    ImpulseAugmented(friction_in_impacts=True),
    ImpulseAugmented(pushing=True),
    Penalty(),
)
ENGINE_LAWS = {law.name for law in _LAWS}  # as a run names them
