"""Contact laws: the whole step from (q, v) to (q, v), as one protocol that engine, references and users share.

The engine brings two: impulses while a contact is new and penalties while it lasts (ImpulseAugmented, the
paper's), and penalties alone (Penalty: the same page with e = −1, claim C09). `reference.time_stepping` adds rigid
constraints; any class with `name`, `settings` and `advance` is a law.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from iapb.contact.kernels.step import STATUS_TEXT
from iapb.contact.kernels.world import State
from iapb.errors import ArgumentError, IapbError
from iapb.mechanics.integrators import INTEGRATORS
from iapb.names import one_of
from iapb.run import COLLIDING, FREE, RESTING

Floats = NDArray[np.float64]

IMPULSE_AUGMENTED = "impulse-augmented penalty"
PUSHING = "impulse-augmented penalty, contacts only push"
WITH_IMPACT_FRICTION = "impulse-augmented penalty with impact friction"
RENDERINGS = ("full", "saturate", "scale", "spread")

# Parts of a scene's contact section: what a law makes of it is its attribute `uses`.
PENALTY, IMPULSES, FRICTION, CLUSTERS, NEWNESS = "penalty", "impulses", "friction", "clusters", "newness"
IMPACT_FRICTION, OWN_RESTITUTION = "impact friction", "own restitution"
JOINTS = "joints"  # damping and limits of joints: a law that does not name this part ignores them
EVERYTHING = frozenset({PENALTY, IMPULSES, FRICTION, CLUSTERS, NEWNESS, IMPACT_FRICTION, OWN_RESTITUTION})


class StepResult(NamedTuple):
    """What a law returns for one step (d generalized velocities)."""

    q: Floats  # (nq,) configuration at the end of the step
    v: Floats  # (d,) generalized velocity at the end of the step [m/s, rad/s]
    penalty_force: Floats  # (d,) generalized normal contact force over the step [N, N m]
    friction_force: Floats  # (d,)
    impulse: Floats  # (d,) generalized collision impulse [N s, N m s], on top of the forces
    state: int  # FREE, COLLIDING or RESTING: the tool's contact state (see iapb.run)


def copied_step(system: Any, state: State) -> StepResult:
    """The step that a state has just done, as copies."""
    return StepResult(
        q=state.q.copy(), v=state.v.copy(), penalty_force=state.penalty_force.copy(),
        friction_force=state.friction_force.copy(), impulse=state.impulse.copy(),
        state=_contact_state(state.state_of_tree, system.tool_tree),
    )


def _contact_state(states: NDArray[np.int8], tool_tree: int) -> int:
    """`iapb.contact.kernels.step.contact_state`, from Python faster without numba's look-up of types."""
    if tool_tree >= 0:
        return int(states[tool_tree])
    return next((state for state in (COLLIDING, RESTING) if state in states), FREE)


class ContactLaw(Protocol):
    """A contact law: the whole step.

    A law may also fill ``state.contacts`` (with ``state.contact_count[0]``), for the record. Stateless where possible:
    what changes lives in `state`. An attribute `uses` names the parts of the contact section that count, for
    `iapb.effects`; without it all are taken to.
    """

    @property
    def name(self) -> str:
        """Name that goes into every run."""
        ...

    @property
    def settings(self) -> dict[str, Any]:
        """Settings that go into every run: plain numbers and texts."""
        ...

    def advance(self, system: Any, state: State, applied_force: Floats, dt: float) -> StepResult:
        """Advance (state.q, state.v) by dt [s] under a generalized force (d,) held constant over the step."""
        ...


@dataclass(frozen=True)
class _EngineLaw:
    """What the two laws of the engine share: an integrator, and a compiled kernel."""

    integrator: str = "semi_implicit_euler"

    def __post_init__(self) -> None:
        if self.integrator not in INTEGRATORS:
            raise ArgumentError("integrator", self.integrator, one_of(self.integrator, INTEGRATORS))

    def advance(self, system: Any, state: State, applied_force: Floats, dt: float) -> StepResult:
        """One step by the compiled kernel, from Python (see `ContactLaw`)."""
        world = system.world_under(self)
        if dt != world.dt:
            raise ArgumentError("dt", dt, f"the scene's step {world.dt!r} s: the engine's laws keep a fixed step")
        status = system.advance_under(self)(world, state, np.ascontiguousarray(applied_force, np.float64))
        if status:
            raise IapbError(STATUS_TEXT[status])
        return copied_step(system, state)

    @classmethod
    def runs_compiled(cls) -> bool:
        """Whether the compiled loop does what `advance` does: not where a subclass has a step of its own."""
        return cls.advance is _EngineLaw.advance


@dataclass(frozen=True)
class ImpulseAugmented(_EngineLaw):
    """The paper's law: impulses (20)-(21) when a contact is new, penalty (5) and friction (6) while it lasts.

    Parameters
    ----------
    integrator : name in `INTEGRATORS`.
    rendering : how impulses meet the device's force limits (paper section VI): ``full`` ignores them,
        ``saturate`` clips at the device, ``scale`` scales tool and device alike, ``spread`` scales and stays in
        collision until the rest is rendered. Without limits in the scene all four are the same.
    friction_in_impacts : whether `contact.friction` acts in collisions too, by Coulomb's law and never with a gain
        of energy (`iapb.resolve_frictional_impact`). Default: no, as in the paper, which leaves it to the future.
    pushing : whether contacts can only push: Poisson's law by two LCPs at every collision (`method="poisson"` of
        `iapb.resolve_impact`), where (21) takes every row as an equality. Default: no, as in the paper.
    """

    rendering: str = "full"
    friction_in_impacts: bool = False
    pushing: bool = False
    impulses = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.rendering not in RENDERINGS:
            raise ArgumentError("rendering", self.rendering, one_of(self.rendering, RENDERINGS))
        for name in ("friction_in_impacts", "pushing"):
            if not isinstance(getattr(self, name), bool):
                raise ArgumentError(name, getattr(self, name), "True or False")
        if self.friction_in_impacts and self.pushing:
            raise ArgumentError("pushing", True, "False with friction_in_impacts, whose split is that of the equality")

    @property
    def name(self) -> str:
        """The law, and whether friction acts in its impacts or contacts only push."""
        return WITH_IMPACT_FRICTION if self.friction_in_impacts else PUSHING if self.pushing else IMPULSE_AUGMENTED

    @property
    def uses(self) -> frozenset[str]:
        """Parts of the scene that the law uses."""
        return EVERYTHING - ({IMPACT_FRICTION} if not self.friction_in_impacts else set()) | {JOINTS}

    @property
    def settings(self) -> dict[str, Any]:
        """Integrator, rendering, and whether friction acts in impacts; `pushing` where it is asked for."""
        settings = {"integrator": self.integrator, "rendering": self.rendering,
                    "friction_in_impacts": self.friction_in_impacts}
        return settings | ({"pushing": True} if self.pushing else {})


@dataclass(frozen=True)
class Penalty(_EngineLaw):
    """Penalties alone: (5)-(6) at every contact, new or old."""

    name = "penalty"
    impulses = False
    friction_in_impacts = pushing = False
    rendering = "full"
    uses = frozenset({PENALTY, FRICTION, CLUSTERS, NEWNESS, JOINTS})  # the record says which contacts are new

    @property
    def settings(self) -> dict[str, Any]:
        """Integrator."""
        return {"integrator": self.integrator}


ENGINE_LAWS: dict[str, ContactLaw] = {
    law.name: law for law in (
        ImpulseAugmented(), ImpulseAugmented(friction_in_impacts=True), ImpulseAugmented(pushing=True), Penalty(),
    )
}
