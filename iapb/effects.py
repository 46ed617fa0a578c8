"""Decide which effects a scene needs, and why: those of the paper's (1)-(26) that the scene needs,
and no others.

The decision is made once, here. `iapb.system.System` sets the switches of the engine from it, every
run records it, and `iapb effects` prints it. An effect is a row of `EFFECTS`; to add one, add a
row.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from iapb.contact import laws
from iapb.errors import counted
from iapb.scene import Scene
from iapb.scene.model import Device

TURNING_JOINTS = ("revolute", "continuous", "planar", "spherical", "free_flyer")
_POSES = 4  # number of poses at which gravity is evaluated


@dataclass(frozen=True)
class Effect:
    """One effect of a scene: whether it is on, why, and what would change without it.

    `reason` and `left_out` are sentences for readers; `reason` carries the scene's own values.
    `ignores` names the contact field that contacts would need but the law does not use; it is empty
    if there is none.
    """

    name: str
    active: bool
    reason: str
    left_out: str
    ignores: str = ""


@dataclass(frozen=True)
class Question:
    """A scene and the caller's law and coupling. None means not chosen yet: only the scene
    decides."""

    system: Any  # the scene's `iapb.system.System`
    law: Any
    uses: frozenset[str]  # parts of the contact section that the law uses
    coupling: Any

    @property
    def rendering(self) -> str | None:
        """How the law respects the device's limits; None without a law."""
        return self.law and getattr(self.law, "rendering", "full")

    @property
    def scene(self) -> Scene:
        """The scene."""
        found: Scene = self.system.scene
        return found

    @cached_property
    def pairs(self) -> Counter[str]:
        """Number of candidate pairs of a moving shape with: walls, or anything static; shapes of
        other trees; links, shapes of its own tree."""
        body_a, body_b = self.system.shapes.body[self.system.pairs.T]
        tree = self.system.mechanism.tree_of_body
        moving = np.where(tree[body_a] == tree[body_b], "links", "others")
        return Counter(np.where(body_b < 0, "walls", moving))

    @cached_property
    def frictions(self) -> list[float]:
        """Different values of mu among the pairs, ascending."""
        found: list[float] = np.unique(self.system.surfaces.by_pair(self.system.pairs)[1]).tolist()
        return found

    @cached_property
    def device(self) -> Device:
        """The scene's device, or an ideal one."""
        return self.scene.device or Device.model_validate({})

    @cached_property
    def sinking(self) -> list[str]:
        """Names of bodies whose generalized gravity force is not exactly zero at all of some random
        poses."""
        mechanism = self.system.mechanism
        field = self.system.gravity
        chance = np.random.default_rng(0)
        q, _ = self.system.start
        felt = np.zeros(mechanism.nv, np.bool_)
        if field.any():
            for _ in range(_POSES):
                felt |= mechanism.gravity(q, field) != 0.0
                q = mechanism.integrate(q, chance.uniform(-1.0, 1.0, mechanism.nv), 1.0)
        felt_by = mechanism.arrays.dof_body[: mechanism.nv][felt]
        return [mechanism.names[b] for b in dict.fromkeys(felt_by)]

    @property
    def turning(self) -> str:
        """The bodies whose joints rotate, as text."""
        names = [body.name for body in self.scene.bodies if body.joint in TURNING_JOINTS]
        return f"{'the joint' if len(names) == 1 else 'the joints'} of {', '.join(names)}"

    @property
    def gains(self) -> Any:
        """Gains of the chosen coupling, or of any coupling if none is chosen; None if there are no
        gains."""
        couplings = self.scene.couplings
        return self.coupling or couplings.four_channel or couplings.unilateral

    def no_contact(self) -> str:
        """Return why nothing can touch; empty if shapes, or joints with limits that the law keeps,
        can."""
        stops = laws.JOINTS in self.uses and len(self.system.stops.bound)
        return "" if self.pairs or stops else "nothing can touch: the scene has no pair of shapes"

    def no_device(self) -> str:
        """Return why no device takes part; empty if one does."""
        if self.scene.hand is None:
            return "the scene has no hand"
        if self.coupling is not None and self.coupling.name == "none":
            return "no coupling was chosen: the hand holds the tool itself"
        return "" if self.gains is not None else "the scene gives no gains under couplings"


Reason = Callable[[Question], str]


class Rule(NamedTuple):
    """One effect. It is off if `absent` or `off` gives a reason, or if the law does not use the
    first of `parts`."""

    on: Reason  # why it is on
    left_out: str | Reason  # what would change without it
    off: Reason = lambda q: ""  # why the scene's values switch it off; empty if they do not
    parts: tuple[str, ...] = ()  # of the contact section
    # why there is nothing to act on; default: nothing can touch, if there are `parts`
    absent: Reason | None = None
    ignores: str = ""  # field to report if only the law switches it off, and uses none of `parts`

    def decide(self, name: str, q: Question) -> Effect:
        """Return the effect for a question."""
        absent = q.no_contact() if self.parts else ""
        if self.absent is not None:
            absent = self.absent(q)
        off = absent or self.off(q)
        unused = ""
        if self.parts and self.parts[0] not in q.uses:
            unused = f"the law '{q.law.name}' does not use it"
        ignored = unused and not off and q.uses.isdisjoint(self.parts)
        left_out = self.left_out if isinstance(self.left_out, str) else self.left_out(q)
        why = absent or unused or off
        return Effect(name, not why, why or self.on(q), left_out, self.ignores if ignored else "")


def numbers(values: Any) -> str:
    """Return a list of numbers as text for a sentence."""
    return "[" + ", ".join(f"{value:g}" for value in values) + "]"


def _weightless(q: Question) -> str:
    """Return why gravity moves nothing; empty if it moves something."""
    if q.sinking:
        return ""
    if not q.system.gravity.any():
        return "the scene gives no gravity"
    if not any(body.mass > 0.0 for body in q.scene.bodies):
        return "no body has mass"
    return f"nothing moves along gravity = {numbers(q.scene.gravity)} m/s2"


def _push(q: Question) -> str:
    """Return text that describes the hand's force, constant or over time; empty if there is
    none."""
    hand = q.scene.hand
    if hand is None or not any(hand.force) and not hand.changes:
        return ""
    said = [f"hand.force = {numbers(hand.force)}"] if any(hand.force) else []
    if not hand.changes:
        units = "N, N, N m" if len(hand.force) == 3 else "N, N, N, N m, N m, N m"
        return f"the hand pushes {hand.body} with {said[0]} {units}"
    if rows := hand.force_table:
        said.append(
            f"hand.force_table, {counted(len(rows), 'row')} from {rows[0][0]:g} to {rows[-1][0]:g} s"
        )
    if hand.force_function:
        said.append(f"hand.force_function = [{', '.join(hand.force_function)}]")
    return f"the hand pushes {hand.body}: {' + '.join(said)}"


def _joints(what: str, unit: str, left_out: str, part: str = laws.JOINTS) -> Rule:
    """Return the rule of an effect that joints ask for by a field."""
    field = f"joint_{what}"

    def given(q: Question) -> str:
        """The first three joints that have it, with its numbers."""
        values = [(body.name, getattr(body, field)) for body in q.scene.bodies]
        found = [
            f"{name} {numbers(x)}" for name, x in values if any(x or ()) or what == "limits" and x
        ]
        return ", ".join(found[:3]) + " …" * (len(found) > 3)

    return Rule(
        lambda q: f"{field}: {given(q)} {unit}",
        left_out,
        parts=(part,),
        absent=lambda q: "" if given(q) else f"no joint has {what}",
        ignores=field,
    )


_OF_PAIRS = {
    "restitution": "the smaller that body or wall of a pair gives",
    "friction": "by pair: of two values the geometric mean",
}


def _by_pair(q: Question, field: str) -> str:
    """Return text with restitution or friction of the pairs that can touch."""
    values = q.frictions if field == "friction" else q.system.restitutions
    if len(values) > 1:
        return f"{field} {values[0]:g} to {values[-1]:g}, {_OF_PAIRS[field]}"
    if values[0] != getattr(q.scene.contact, field):
        return f"all pairs have {field} {values[0]:g}"
    return f"contact.{field} = {values[0]:g}"


def _no_impulse(q: Question) -> str:
    """Return why an impulse would be zero; empty if it would not."""
    if q.system.restitutions[-1] > -1.0:
        return ""
    return f"{_by_pair(q, 'restitution')}: an impulse would be zero"


def _at_first_overlap(q: Question) -> str:
    """Return why impacts wait for an overlap; empty if they happen at the touch."""
    if q.scene.contact.forces == "paper":
        return "contact.forces = paper"
    return _no_impulse(q) if q.scene.contact.at_touch else "contact.impact_time = step"


def _no_slip(q: Question) -> str:
    """Return why impacts have no friction; empty if they have."""
    if q.scene.contact.self_collision_rows == "per_body" and not _smooth(q):
        return "contact.self_collision_rows = per_body: rows of one body alone have no slip"
    return _smooth(q)


def _explicit(q: Question) -> str:
    """Return that contact forces are explicit; empty if they are implicit."""
    return "contact.forces = paper" if q.scene.contact.forces == "paper" else ""


def _unlimited(q: Question) -> str:
    """Return why the device's limits have no effect; empty if they have."""
    if q.device.force_limit is None:
        return "the scene gives no device.force_limit"
    return "the rendering 'full' ignores the limits" if q.rendering == "full" else ""


def _smooth(q: Question) -> str:
    """Return why no pair has friction; empty if one has."""
    if not q.frictions:
        return "nothing can rub: the scene has no pair of shapes"
    return "" if q.frictions[-1] > 0.0 else _by_pair(q, "friction")


def _contact(
    field: str, unit: str, part: str, left_out: str, more: Reason = lambda q: "", ignores: str = ""
) -> Rule:
    """Return the rule of an effect that contacts ask for by a number of the contact section, unless
    it is zero."""
    return Rule(
        lambda q: (
            f"the scene gives no contact.{field}: it follows from the masses that touch"
            if getattr(q.scene.contact, field) is None
            else f"contact.{field} = {getattr(q.scene.contact, field):g} {unit}{more(q)}"
        ),
        left_out,
        lambda q: f"contact.{field} = 0" if getattr(q.scene.contact, field) == 0.0 else "",
        (part,),
        None,
        ignores,
    )


def _device(field: str, unit: str, left_out: str) -> Rule:
    """Return the rule of an effect that a list of the device asks for, unless all its numbers are
    zero."""
    return Rule(
        lambda q: f"device.{field} = {numbers(getattr(q.device, field))} {unit}",
        left_out,
        lambda q: (
            "" if any(getattr(q.device, field) or ()) else f"the scene gives no device.{field}"
        ),
        absent=Question.no_device,
    )


EFFECTS: dict[str, Rule] = {
    # (1): gravity G, mass matrix M(q), Coriolis and centripetal forces B, force of the hand J_h^T
    # F_h
    "gravity": Rule(
        lambda q: f"the scene gives gravity = {numbers(q.scene.gravity)} m/s2",
        lambda q: f"{', '.join(q.sinking) or 'bodies'} would not fall or sag",
        _weightless,
    ),
    "varying_inertia": Rule(
        lambda q: (
            f"the mass matrix depends on the configuration: {q.turning} can turn links or mass off the axis"
        ),
        "links would keep the inertia of their first pose",
        lambda q: (
            "the mass matrix is constant: it is factored once, before the first step"
            if q.system.mechanism.has_constant_mass_matrix
            else ""
        ),
    ),
    "velocity_terms": Rule(
        lambda q: f"bodies carried by {q.turning} feel Coriolis or centripetal forces",
        "swinging links would gain or lose energy in free motion",
        lambda q: (
            ""
            if q.system.mechanism.has_velocity_terms
            else "no joint feels the velocity of another: B(q, v) is zero for every motion"
        ),
    ),
    "hand_force": Rule(
        _push,
        "the tool would not be pushed",
        lambda q: "" if _push(q) else "the hand holds still: hand.force is zero",
        absent=lambda q: "" if q.scene.hand else "the scene has no hand",
    ),
    # joints: viscous damping and dry friction, integrated implicitly, and limits, which act as contacts of a link
    # with its parent
    "joint_damping": _joints(
        "damping", "N s/m, N m s/rad", "joints would turn and slide without loss"
    ),
    "joint_friction": _joints(
        "friction",
        "N, N m",
        "joints would turn and slide without dry friction",
        laws.JOINT_FRICTION,
    ),
    "joint_limits": _joints("limits", "rad, m", "joints would turn and slide without end"),
    # what can touch
    "wall_contacts": Rule(
        lambda q: (
            f"{counted(q.pairs['walls'], 'pair')} of a moving shape and a static one can touch"
        ),
        "bodies would pass through walls",
        lambda q: "" if q.pairs["walls"] else "no moving shape has a static one to touch",
    ),
    "body_contacts": Rule(
        lambda q: f"{counted(q.pairs['others'], 'pair')} of shapes of separate bodies can touch",
        "moving bodies would pass through each other",
        lambda q: "" if q.pairs["others"] else "no two separate moving bodies have shapes",
    ),
    "self_collisions": Rule(
        lambda q: (
            f"contact.self_collisions = true, and {counted(q.pairs['links'], 'pair')} of links that are not "
            f"neighbours "
            "can touch"
        ),
        "links of one tree would pass through each other",
        lambda q: (
            ""
            if q.pairs["links"]
            else "contact.self_collisions = true, but no two links with shapes are more than one joint apart"
        ),
        absent=lambda q: (
            "" if q.scene.contact.self_collisions else "contact.self_collisions = false"
        ),
    ),
    # Impulses (20)-(21) at new contacts. Different restitution in one impact and friction in
    # impacts are future extensions in the paper: here Poisson's law (rigid constraints: Newton's
    # where it gains no energy), and Coulomb's.
    "impulses": Rule(
        lambda q: f"new contacts collide: {_by_pair(q, 'restitution')}",
        "bodies would be stopped by springs alone and sink in further",
        _no_impulse,
        (laws.IMPULSES, laws.OWN_RESTITUTION),
        ignores="restitution",
    ),
    "unequal_restitution": Rule(
        lambda q: f"pairs that can touch differ: {_by_pair(q, 'restitution')}",
        "all contacts of an impact would bounce alike",
        lambda q: (
            ""
            if len(q.system.restitutions) > 1
            else f"all contacts are alike: {_by_pair(q, 'restitution')}"
        ),
        (laws.OWN_RESTITUTION,),
    ),
    "impact_friction": Rule(
        lambda q: _by_pair(q, "friction"),
        "bodies would bounce without losing tangential speed",
        _no_slip,
        (laws.IMPACT_FRICTION,),
    ),
    # resting contacts: K and B of (5), friction by Coulomb's law or by (6)
    "penalty_stiffness": _contact(
        "stiffness",
        "N/m",
        laws.PENALTY,
        "nothing would hold a body that rests on another",
        lambda q: (
            ", implicit" if q.scene.contact.forces == "implicit" else ", explicit, equation (5)"
        ),
        "stiffness",
    ),
    "contact_damping": _contact(
        "damping",
        "N s/m",
        laws.PENALTY,
        "resting contacts would swing on their springs",
        ignores="damping",
    ),
    "friction": Rule(
        lambda q: _by_pair(q, "friction"),
        "bodies would slide along each other without loss",
        _smooth,
        (laws.FRICTION,),
        ignores="friction",
    ),
    "implicit_contact": Rule(
        lambda q: "contact.forces = implicit: springs and friction act at the end of each step",
        "stiff springs would need shorter steps",
        _explicit,
    ),
    "touch": Rule(
        lambda q: "contact.impact_time = touch: a step is cut where new contacts meet",
        "impacts would happen at the first step that finds an overlap, with its lever arms",
        _at_first_overlap,
        (laws.TOUCH,),
    ),
    "supports": Rule(
        lambda q: (
            f"up to {q.system.most_contacts} contacts: those that carry a load take part in impacts"
        ),
        "a body that is struck from above would sink into what carries it",
        _explicit,
        absent=lambda q: "" if q.system.most_contacts > 1 else "there is at most one contact",
    ),
    # section III: contacts close together count as one; a contact near one of the step before is
    # not new
    "clustering": _contact(
        "cluster_distance",
        "m",
        laws.CLUSTERS,
        "contacts that a fine mesh repeats would count several times",
    ),
    "coherence": _contact(
        "coherence_distance",
        "m",
        laws.NEWNESS,
        "contacts that move from facet to facet would collide again",
    ),
    # section VI: coupling and device
    "coupling": Rule(
        lambda q: (
            f"{q.coupling.name if q.coupling else 'a coupling'} holds tool and device together, "
            f"stiffness {numbers(q.gains.stiffness)} N/m, N m/rad"
        ),
        "the hand would hold the tool itself, without a device between",
        absent=Question.no_device,
    ),
    "device_limits": Rule(
        lambda q: (
            f"device.force_limit = {numbers(q.device.force_limit)} N, N m"
            + (f", rendering '{q.rendering}'" if q.rendering else "")
        ),
        "the hand would feel impulses that no motor can give",
        _unlimited,
        absent=lambda q: "" if q.rendering in ("scale", "spread") else q.no_device(),
    ),  # they scale the tool's impulse
    "delay": Rule(
        lambda q: (
            f"device.delay = {q.device.delay} steps, {1e3 * q.device.delay * q.scene.step:g} ms"
        ),
        "the coupling would look more stable than with a real delay",
        lambda q: "" if q.device.delay else "device.delay = 0",
        absent=Question.no_device,
    ),
    "quantisation": _device(
        "position_resolution", "m, rad", "the coupling would be fed exact positions and velocities"
    ),
    "device_damping": _device(
        "damping",
        "N s/m, N m s/rad",  # it bounds the virtual damping (C20)
        "the device would be a pure inertia, the worst case for stability",
    ),
}

EFFECT_NAMES = tuple(EFFECTS)


def decide(system: Any, law: Any = None, coupling: Any = None) -> tuple[Effect, ...]:
    """Decide which effects are on for a scene's system (see `iapb.system.decide_effects`)."""
    law = law.within(system.scene) if hasattr(law, "within") else law
    uses = getattr(law, "uses", laws.ASSUMED)
    if law is None:
        uses = laws.ASSUMED | {laws.JOINTS, laws.JOINT_FRICTION, laws.TOUCH}
    question = Question(system, law, uses, coupling)
    return tuple(rule.decide(name, question) for name, rule in EFFECTS.items())


def ignored_fields(effects: Iterable[Any]) -> tuple[str, ...]:
    """Return the fields that the law ignores, friction first, from effects or from the rows of a
    run."""
    found = [effect.ignores for effect in effects if effect.ignores]
    return tuple(sorted(found, key=lambda field: field != "friction"))


def active_names(effects: Sequence[Effect]) -> frozenset[str]:
    """Return the names of the effects that are on."""
    return frozenset(effect.name for effect in effects if effect.active)
