"""Decide which effects a scene needs, and why: those of the paper's (1)-(26) that the scene needs,
and no others.

The decision is made once, here. `iapb.system.System` sets the switches of the engine from it, every
run records it, and `iapb effects` prints it. An effect is a row of `EFFECTS`; to add one, add a
row.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from iapb.contact import laws
from iapb.contact.geometry import Shapes, contact_capacity
from iapb.haptics.coupling import Coupling
from iapb.mechanics.mechanism import Mechanism
from iapb.numerics.schema import Indices
from iapb.scene import Scene
from iapb.scene.mechanism import (
    frictions_of,
    mechanism_of,
    pairs_of,
    restitutions_of,
    shapes_of,
    stops_of,
)
from iapb.scene.model import Device

COUPLING_FIELDS = {"four-channel": "four_channel", "unilateral": "unilateral"}
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
    """A scene and the caller's law, coupling and rendering. None means not chosen yet: only the
    scene decides."""

    scene: Scene
    mechanism: Mechanism
    wall_pairs: int  # candidate pairs of a moving shape and a static one
    body_pairs: int  # candidate pairs of shapes of two trees
    tree_pairs: int  # candidate pairs of shapes of one tree
    most_contacts: int  # for which there is room
    restitutions: list[float]  # different values of e among the pairs, ascending
    frictions: list[float]  # different values of mu among the pairs, ascending
    law: str | None
    uses: frozenset[str]  # parts of the contact section that the law uses
    coupling: str | None
    own_gains: Any  # of a coupling object of the caller; None: the scene's gains
    rendering: str | None

    @cached_property
    def device(self) -> Device:
        """The scene's device, or an ideal one."""
        return self.scene.device or Device.model_validate({})

    @cached_property
    def sinking(self) -> list[str]:
        """Names of bodies whose generalized gravity force is not exactly zero at all of some random
        poses."""
        mechanism = self.mechanism
        field = self.scene.gravity or ()
        chance = np.random.default_rng(0)
        q = np.array([x for body in self.scene.bodies for x in body.position], np.float64)
        felt = np.zeros(mechanism.nv, np.bool_)
        for _ in range(_POSES if any(field) else 0):
            felt |= mechanism.gravity(q, [*field, 0.0][:3]) != 0.0
            q = mechanism.integrate(q, chance.uniform(-1.0, 1.0, mechanism.nv), 1.0)
        felt_by = mechanism.arrays.dof_body[: mechanism.nv][felt]
        return [mechanism.names[b] for b in dict.fromkeys(felt_by.tolist())]

    @property
    def turning(self) -> str:
        """The bodies whose joints rotate, as text."""
        names = [body.name for body in self.scene.bodies if body.joint in TURNING_JOINTS]
        return f"the joint{'' if len(names) == 1 else 's'} of {', '.join(names)}"

    @property
    def gains(self) -> Any:
        """Gains of the chosen coupling, or of any coupling if none is chosen; None if there are no
        gains."""
        couplings = self.scene.couplings
        if self.own_gains is not None or self.coupling is None:
            return self.own_gains or couplings.four_channel or couplings.unilateral
        return getattr(couplings, COUPLING_FIELDS.get(self.coupling, "four_channel"))

    def no_contact(self) -> str:
        """Return why nothing can touch; empty if shapes, or joints with limits that the law keeps,
        can."""
        stops = laws.JOINTS in self.uses and any(
            body.joint_limits is not None for body in self.scene.bodies
        )
        pairs = self.wall_pairs or self.body_pairs or self.tree_pairs
        return "" if pairs or stops else "nothing can touch: the scene has no pair of shapes"

    def no_device(self) -> str:
        """Return why no device takes part; empty if one does."""
        if self.scene.hand is None:
            return "the scene has no hand"
        if self.coupling == "none":
            return "no coupling was chosen: the hand holds the tool itself"
        wanted = COUPLING_FIELDS.get(self.coupling or "", "")
        return (
            ""
            if self.gains is not None
            else f"the scene gives no gains under couplings{'.' * bool(wanted)}{wanted}"
        )


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
        absent = self.absent(q) if self.absent else q.no_contact() if self.parts else ""
        off = absent or self.off(q)
        unused = (
            f"the law '{q.law}' does not use it"
            if self.parts and self.parts[0] not in q.uses
            else ""
        )
        ignored = unused and not off and q.uses.isdisjoint(self.parts)
        left_out = self.left_out if isinstance(self.left_out, str) else self.left_out(q)
        why = absent or unused or off
        return Effect(name, not why, why or self.on(q), left_out, self.ignores if ignored else "")


def numbers(values: Any) -> str:
    """Return a list of numbers as text for a sentence."""
    return "[" + ", ".join(f"{value:g}" for value in values) + "]"


def _count(pairs: int) -> str:
    return "1 pair" if pairs == 1 else f"{pairs} pairs"


def _weightless(q: Question) -> str:
    """Return why gravity moves nothing; empty if it moves something."""
    if q.sinking:
        return ""
    if not any(q.scene.gravity or ()):
        return "the scene gives no gravity"
    massless = not any(body.mass > 0.0 for body in q.scene.bodies)
    return (
        "no body has mass"
        if massless
        else f"nothing moves along gravity = {numbers(q.scene.gravity)} m/s2"
    )


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
        count = f"{len(rows)} row{'s' * (len(rows) > 1)}"
        said.append(f"hand.force_table, {count} from {rows[0][0]:g} to {rows[-1][0]:g} s")
    if hand.force_function:
        said.append(f"hand.force_function = [{', '.join(hand.force_function)}]")
    return f"the hand pushes {hand.body}: {' + '.join(said)}"


def _joints(what: str, unit: str, left_out: str, part: str = laws.JOINTS) -> Rule:
    """Return the rule of an effect that joints ask for by a field."""
    field = f"joint_{what}"

    def given(q: Question) -> list[str]:
        values = ((body.name, getattr(body, field)) for body in q.scene.bodies)
        return [
            f"{name} {numbers(x)}"
            for name, x in values
            if x is not None and (what == "limits" or any(x))
        ]

    return Rule(
        lambda q: f"{field}: {', '.join(given(q)[:3])}{' …' if len(given(q)) > 3 else ''} {unit}",
        left_out,
        parts=(part,),
        absent=lambda q: "" if given(q) else f"no joint has {what}",
        ignores=field,
    )


def _by_pair(q: Question, field: str) -> str:
    """Return text with restitution or friction of the pairs that can touch."""
    values = q.restitutions if field == "restitution" else q.frictions
    if len(values) > 1:
        how = {
            "restitution": "the smaller that body or wall of a pair gives",
            "friction": "by pair: of two values the geometric mean",
        }[field]
        return f"{field} {values[0]:g} to {values[-1]:g}, {how}"
    own = values[0] != getattr(q.scene.contact, field)
    return f"{f'all pairs have {field}' if own else f'contact.{field} ='} {values[0]:g}"


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
        lambda q: f"gravity is on: gravity = {numbers(q.scene.gravity)} m/s2",
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
            if q.mechanism.has_constant_mass_matrix
            else ""
        ),
    ),
    "velocity_terms": Rule(
        lambda q: f"bodies carried by {q.turning} feel Coriolis or centripetal forces",
        "swinging links would gain or lose energy in free motion",
        lambda q: (
            ""
            if q.mechanism.has_velocity_terms
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
        lambda q: f"{_count(q.wall_pairs)} of a moving shape and a static one can touch",
        "bodies would pass through walls",
        lambda q: "" if q.wall_pairs else "no moving shape has a static one to touch",
    ),
    "body_contacts": Rule(
        lambda q: f"{_count(q.body_pairs)} of shapes of separate bodies can touch",
        "moving bodies would pass through each other",
        lambda q: "" if q.body_pairs else "no two separate moving bodies have shapes",
    ),
    "self_collisions": Rule(
        lambda q: (
            f"contact.self_collisions = true, and {_count(q.tree_pairs)} of links that are not "
            f"neighbours "
            "can touch"
        ),
        "links of one tree would pass through each other",
        lambda q: (
            ""
            if q.tree_pairs
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
        lambda q: (
            f"{_by_pair(q, 'restitution')}: an impulse would be zero"
            if q.restitutions[-1] == -1.0
            else ""
        ),
        (laws.IMPULSES, laws.OWN_RESTITUTION),
        ignores="restitution",
    ),
    "unequal_restitution": Rule(
        lambda q: f"pairs that can touch differ: {_by_pair(q, 'restitution')}",
        "all contacts of an impact would bounce alike",
        lambda q: (
            ""
            if len(q.restitutions) > 1
            else f"all contacts are alike: {_by_pair(q, 'restitution')}"
        ),
        (laws.OWN_RESTITUTION,),
    ),
    "impact_friction": Rule(
        lambda q: _by_pair(q, "friction"),
        "bodies would bounce without losing tangential speed",
        lambda q: (
            _smooth(q)
            or (
                "contact.self_collision_rows = per_body: rows of one body alone have no slip"
                if q.scene.contact.self_collision_rows == "per_body"
                else ""
            )
        ),
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
        lambda q: "" if q.scene.contact.forces == "implicit" else "contact.forces = paper",
    ),
    "touch": Rule(
        lambda q: "contact.impact_time = touch: a step is cut where new contacts meet",
        "impacts would happen at the first step that finds an overlap, with its lever arms",
        lambda q: (
            "contact.forces = paper"
            if q.scene.contact.forces == "paper"
            else "contact.impact_time = step"
            if not q.scene.contact.at_touch
            else f"{_by_pair(q, 'restitution')}: an impulse would be zero"
            if q.restitutions[-1] == -1.0
            else ""
        ),
        (laws.TOUCH,),
    ),
    "supports": Rule(
        lambda q: f"up to {q.most_contacts} contacts: those that carry a load take part in impacts",
        "a body that is struck from above would sink into what carries it",
        lambda q: "" if q.scene.contact.forces == "implicit" else "contact.forces = paper",
        absent=lambda q: "" if q.most_contacts > 1 else "there is at most one contact",
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
            f"{q.coupling or 'a coupling'} holds tool and device together, "
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
        lambda q: (
            "the scene gives no device.force_limit"
            if q.device.force_limit is None
            else "the rendering 'full' ignores the limits"
            if q.rendering == "full"
            else ""
        ),
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


def decide_effects(
    scene: Scene,
    law: laws.ContactLaw | str | None = None,
    coupling: Coupling | str | None = None,
    rendering: str | None = None,
) -> tuple[Effect, ...]:
    """Decide which effects are on for a scene and for the caller's choices.

    Parameters
    ----------
    scene
        a checked scene.
    law, coupling
        the objects, or their names in a run file, such as "penalty" and "four-channel". With None,
        an effect is on if some law or coupling needs it. The attribute ``uses`` of a law names the
        parts of the contact section that it uses (`iapb.contact.laws`); a law without it is assumed
        to use all of them.
    rendering
        such as "scale"; default: the rendering of the law.

    Returns
    -------
    tuple of Effect
        all effects in a fixed order, each with its state, the reason, and what would change without
        it.
    """
    shapes = shapes_of(scene)
    return decide_for(
        scene, mechanism_of(scene), shapes, pairs_of(scene, shapes), law, coupling, rendering
    )


def decide_for(
    scene: Scene,
    mechanism: Mechanism,
    shapes: Shapes,
    pairs: Indices,
    law: laws.ContactLaw | str | None,
    coupling: Coupling | str | None,
    rendering: str | None = None,
) -> tuple[Effect, ...]:
    """Do what `decide_effects` does for a scene with its shapes and candidate pairs (k, 2)."""
    body_a, body_b = shapes.body[pairs.T]
    wall = body_b < 0
    same = mechanism.tree_of_body[body_a] == mechanism.tree_of_body[body_b]
    to_walls, between, within = (int(each.sum()) for each in (wall, ~wall & ~same, ~wall & same))
    restitutions = restitutions_of(scene, pairs)
    frictions = sorted(set(frictions_of(scene).by_pair(pairs).tolist()))
    if law is not None and not isinstance(law, str):
        law = law.within(scene) if hasattr(law, "within") else law
        rendering = getattr(law, "rendering", "full") if rendering is None else rendering
    known = laws.ENGINE_LAWS.get(law) if isinstance(law, str) else law
    uses = (
        laws.EVERYTHING | {laws.JOINTS, laws.JOINT_FRICTION, laws.TOUCH}
        if known is None
        else getattr(known, "uses", laws.EVERYTHING)
    )
    names = (one if one is None or isinstance(one, str) else one.name for one in (law, coupling))
    q = Question(
        scene,
        mechanism,
        to_walls,
        between,
        within,
        contact_capacity(shapes, pairs) + len(stops_of(scene, mechanism).bound),
        restitutions.tolist(),
        frictions,
        next(names),
        uses,
        next(names),
        coupling if hasattr(coupling, "stiffness") else None,
        rendering,
    )
    return tuple(rule.decide(name, q) for name, rule in EFFECTS.items())


def ignored_fields(effects: Iterable[Any]) -> tuple[str, ...]:
    """Return the fields that the law ignores, friction first, from effects or from the rows of a
    run."""
    found = [effect.ignores for effect in effects if effect.ignores]
    return tuple(sorted(found, key=lambda field: field != "friction"))


def active_names(effects: Sequence[Effect]) -> frozenset[str]:
    """Return the names of the effects that are on."""
    return frozenset(effect.name for effect in effects if effect.active)
