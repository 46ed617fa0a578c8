"""Decide which effects a scene needs, and why: those of the paper's (1)-(26) that the scene needs, and no others.

The decision is made once, here. `iapb.system.make_world` and `make_port` set the engine's switches from it, every run
records it, and `iapb effects` prints it. An effect is a function of a `Question`; to add one, write the function and
add it to `EFFECTS`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.advice.checks import settled
from iapb.contact.geometry import Shapes
from iapb.contact.laws import (
    CLUSTERS,
    ENGINE_LAWS,
    EVERYTHING,
    FRICTION,
    IMPACT_FRICTION,
    IMPULSES,
    JOINTS,
    NEWNESS,
    OWN_RESTITUTION,
    PENALTY,
    ContactLaw,
)
from iapb.haptics.coupling import Coupling
from iapb.mechanics.mechanism import Mechanism
from iapb.scene import Scene
from iapb.scene.mechanism import friction_by_pair, mechanism_of, pairs_of, restitutions_of, shapes_of
from iapb.scene.model import Hand

COUPLING_FIELDS = {"four-channel": "four_channel", "unilateral": "unilateral"}
TURNING_JOINTS = ("revolute", "continuous", "planar", "spherical", "free_flyer")
_POSES = 4  # number of poses at which gravity is evaluated


@dataclass(frozen=True)
class Effect:
    """One effect of a scene: whether it is on, why, and what would change without it.

    `reason` and `left_out` are sentences for readers; `reason` carries the scene's own values. `ignores` names the
    contact field that contacts would need but the law does not use; it is empty if there is none.
    """

    name: str
    active: bool
    reason: str
    left_out: str
    ignores: str = ""


class Facts(NamedTuple):
    """Quantities derived from a scene that the effects need besides its fields."""

    mechanism: Mechanism
    wall_pairs: int  # candidate pairs of a moving shape and a static one
    body_pairs: int  # candidate pairs of shapes of two trees
    tree_pairs: int  # candidate pairs of shapes of one tree
    restitutions: tuple[float, ...]  # different values of e among the pairs, ascending
    frictions: tuple[float, ...]  # different values of mu among the pairs, ascending


@dataclass(frozen=True)
class Question:
    """A scene and the caller's law, coupling and rendering. None means not chosen yet: only the scene decides."""

    scene: Scene
    mechanism: Mechanism  # this and the next five: see `Facts`
    wall_pairs: int
    body_pairs: int
    tree_pairs: int
    restitutions: tuple[float, ...]
    frictions: tuple[float, ...]
    limited: tuple[str, ...]  # bodies whose joint has limits that the law keeps
    law: str | None
    uses: frozenset[str]  # parts of the contact section that the law uses
    coupling: str | None
    logs_impulses: bool  # the law logs the energy lost in impulses, which the observer of pulses needs
    own_gains: Any  # of a coupling object of the caller; None: the scene's gains
    rendering: str | None

    @property
    def pairs(self) -> int:
        """All candidate pairs of shapes."""
        return self.wall_pairs + self.body_pairs + self.tree_pairs

    @property
    def contacts(self) -> int:
        """Number of pairs of shapes and of joints with limits, which all can touch."""
        return self.pairs + len(self.limited)

    def unused(self, part: str) -> str | None:
        """Return why no contact needs a part of the contact section; None if one does."""
        if self.contacts == 0:
            return "nothing can touch: the scene has no pair of shapes"
        return None if part in self.uses else f"the law '{self.law}' does not use it"

    def ignored(self, field: str, *parts: str) -> str:
        """Return the field if something can touch and the law uses none of these parts; else an empty text."""
        return field if self.contacts and not self.uses.intersection(parts) else ""

    def without_device(self) -> str | None:
        """Return why no device takes part; None if one does."""
        if self.scene.hand is None:
            return "the scene has no hand"
        if self.coupling == "none":
            return "no coupling was asked for: the hand holds the tool itself"
        if self.gains() is None:
            wanted = COUPLING_FIELDS.get(self.coupling or "", "")
            return f"the scene gives no gains under couplings{'.' + wanted if wanted else ''}"
        return None

    def gains(self) -> Any:
        """Return the gains of the chosen coupling, or of any coupling if none is chosen; None if there are no gains."""
        couplings = self.scene.couplings
        if self.own_gains is not None:
            return self.own_gains
        if self.coupling is None:
            return couplings.four_channel or couplings.unilateral
        return getattr(couplings, COUPLING_FIELDS.get(self.coupling, "four_channel"))


def number(value: float) -> str:
    """Return a number as text for a sentence."""
    return f"{value:g}"


def numbers(values: Any) -> str:
    """Return a list of numbers as text for a sentence."""
    return "[" + ", ".join(number(value) for value in values) + "]"


def gravity(question: Question) -> Effect:
    """Gravity, G of (1)."""
    field = question.scene.gravity
    sinking = _sinking(question, field) if field is not None and any(field) else []
    if sinking:
        reason = f"gravity is on: gravity = {numbers(field or ())} m/s2"
    elif field is None or not any(field):
        reason = "the scene gives no gravity"
    elif not any(body.mass > 0.0 for body in question.scene.bodies):
        reason = "no body has mass"
    else:
        reason = f"nothing moves along gravity = {numbers(field)} m/s2"
    left_out = f"{', '.join(sinking) or 'bodies'} would not fall or sag"
    return Effect("gravity", bool(sinking), reason, left_out)


def _sinking(question: Question, field: Sequence[float]) -> list[str]:
    """Return the names of bodies whose generalized gravity force is not exactly zero at all of some random poses."""
    mechanism, numbers_by_chance = question.mechanism, np.random.default_rng(0)
    q = np.array([x for body in question.scene.bodies for x in body.position], np.float64)
    felt = np.zeros(mechanism.nv, np.bool_)
    for _ in range(_POSES):
        felt |= mechanism.gravity(q, [*field, 0.0][:3]) != 0.0
        q = mechanism.integrate(q, numbers_by_chance.uniform(-1.0, 1.0, mechanism.nv), 1.0)
    return [mechanism.names[b] for b in dict.fromkeys(mechanism.arrays.dof_body[felt].tolist())]


def varying_inertia(question: Question) -> Effect:
    """Configuration-dependent mass matrix, M(q) of (1)."""
    active = not question.mechanism.has_constant_mass_matrix
    reason = (
        f"the mass matrix depends on the configuration: {_turning(question)} carries mass off its axis or other links"
        if active
        else "the mass matrix is constant: it is factored once, before the first step"
    )
    return Effect("varying_inertia", active, reason, "links would keep the inertia of their first pose")


def velocity_terms(question: Question) -> Effect:
    """Coriolis and centripetal forces, B of (1)."""
    active = question.mechanism.has_velocity_terms
    reason = (
        f"bodies carried by {_turning(question)} feel Coriolis or centripetal forces"
        if active
        else "no joint feels the velocity of another: B(q, v) is zero for every motion"
    )
    return Effect("velocity_terms", active, reason, "swinging links would gain or lose energy in free motion")


def hand_force(question: Question) -> Effect:
    """Force of the hand, J_h^T F_h of (1)."""
    hand = question.scene.hand
    active = hand is not None and (any(hand.force) or hand.changes)
    if hand is None:
        reason = "the scene has no hand"
    elif hand.changes:
        reason = f"the hand pushes {hand.body}: {_over_time(hand)}"
    elif active:
        units = "N, N, N m" if len(hand.force) == 3 else "N, N, N, N m, N m, N m"
        reason = f"the hand pushes {hand.body} with hand.force = {numbers(hand.force)} {units}"
    else:
        reason = "the hand holds still: hand.force is zero"
    return Effect("hand_force", active, reason, "the tool would not be pushed")


def _over_time(hand: Hand) -> str:
    """Return text that describes how the hand's force changes over time."""
    said = [f"hand.force = {numbers(hand.force)}"] if any(hand.force) else []
    if hand.force_table:
        rows = hand.force_table
        said.append(f"hand.force_table, {len(rows)} row{'s' * (len(rows) > 1)} from {number(rows[0][0])} to "
                    f"{number(rows[-1][0])} s")
    if hand.force_function:
        said.append(f"hand.force_function = [{', '.join(hand.force_function)}]")
    return " + ".join(said)


def joint_damping(question: Question) -> Effect:
    """Viscous damping of joints, integrated implicitly."""
    damped = [body for body in question.scene.bodies if any(body.joint_damping)]
    unused = None if damped else "no joint has damping"
    if damped and JOINTS not in question.uses:
        unused = f"the law '{question.law}' does not use it"
    given = ", ".join(f"{body.name} {numbers(body.joint_damping)}" for body in damped[:3])
    reason = unused or f"joint_damping: {given}{' …' if len(damped) > 3 else ''} N s/m, N m s/rad"
    return Effect("joint_damping", unused is None, reason, "joints would turn and slide without loss",
                  "joint_damping" if damped and unused else "")


def joint_limits(question: Question) -> Effect:
    """Limits of joints, which act as contacts of a link with its parent."""
    given = [body for body in question.scene.bodies if body.joint_limits is not None]
    unused = None if given else "no joint has limits"
    if given and not question.limited:
        unused = f"the law '{question.law}' does not use it"
    said = ", ".join(f"{body.name} {numbers(body.joint_limits)}" for body in given[:3])
    reason = unused or f"joint_limits: {said}{' …' if len(given) > 3 else ''} rad, m"
    return Effect("joint_limits", unused is None, reason, "joints would turn and slide without end",
                  "joint_limits" if given and unused else "")


def _turning(question: Question) -> str:
    """Return the names of the bodies whose joints rotate."""
    turning = [body.name for body in question.scene.bodies if body.joint in TURNING_JOINTS]
    return f"the joint{'' if len(turning) == 1 else 's'} of {', '.join(turning)}"


def wall_contacts(question: Question) -> Effect:
    """Contacts of moving shapes with the static world."""
    count = question.wall_pairs
    reason = f"{_pairs(count)} of a moving shape and a static one can touch"
    reason = reason if count else "no moving shape has a static one to touch"
    return Effect("wall_contacts", count > 0, reason, "bodies would pass through walls")


def body_contacts(question: Question) -> Effect:
    """Contacts between bodies of different trees."""
    count = question.body_pairs
    reason = f"{_pairs(count)} of shapes of separate bodies can touch"
    reason = reason if count else "no two separate moving bodies have shapes"
    return Effect("body_contacts", count > 0, reason, "moving bodies would pass through each other")


def self_collisions(question: Question) -> Effect:
    """Contacts between links of one tree."""
    asked, count = question.scene.contact.self_collisions, question.tree_pairs
    if not asked:
        reason = "contact.self_collisions = false"
    elif count:
        reason = (
            f"contact.self_collisions = true, and {_pairs(count)} of links that are not neighbours can touch"
        )
    else:
        reason = "contact.self_collisions = true, but no two links with shapes are more than one joint apart"
    return Effect("self_collisions", count > 0, reason, "links of one tree would pass through each other")


def impulses(question: Question) -> Effect:
    """Impulses (20)-(21) at new contacts."""
    unused = question.unused(IMPULSES)
    if unused is None and question.restitutions[-1] == -1.0:
        unused = f"{_restitution(question)}: an impulse would be zero"
    reason = unused or f"new contacts collide: {_restitution(question)}"
    left_out = "bodies would be stopped by springs alone and sink in further"
    ignored = question.ignored("restitution", IMPULSES, OWN_RESTITUTION)
    return Effect("impulses", unused is None, reason, left_out, ignored)


def _restitution(question: Question) -> str:
    """Return text with the restitution of the pairs that can touch."""
    smallest, largest = question.restitutions[0], question.restitutions[-1]
    if smallest < largest:
        return f"restitution {number(smallest)} to {number(largest)}, the smaller that body or wall of a pair gives"
    own = smallest != question.scene.contact.restitution
    return f"{'all pairs have restitution' if own else 'contact.restitution ='} {number(smallest)}"


def unequal_restitution(question: Question) -> Effect:
    """Different restitution at the contacts of one impact, a future extension in the paper.

    The engine's impulses then follow Poisson's law. Rigid constraints follow Newton's law at each contact if that has a
    solution without energy gain, and Poisson's law otherwise.
    """
    unused = question.unused(OWN_RESTITUTION)
    if unused is None and len(question.restitutions) == 1:
        unused = f"alike everywhere: {_restitution(question)}"
    reason = unused or f"pairs that can touch differ: {_restitution(question)}"
    return Effect("unequal_restitution", unused is None, reason, "all contacts of a collision would bounce alike")


def impact_friction(question: Question) -> Effect:
    """Coulomb friction during impacts, a future extension in the paper."""
    contact = question.scene.contact
    active, reason = _rough(question, IMPACT_FRICTION)
    if active and contact.self_collision_rows == "per_body":
        active, reason = False, "contact.self_collision_rows = per_body: rows of one body alone have no slip"
    return Effect("impact_friction", active, reason, "bodies would bounce without losing tangential speed")


def penalty_stiffness(question: Question) -> Effect:
    """Penalty stiffness, K of (5)."""
    value = question.scene.contact.stiffness
    active, reason = _valued(question, PENALTY, "stiffness", value, "N/m")
    if active:
        reason += {"implicit": ", implicit", "paper": ", explicit (5)"}[question.scene.contact.forces]
        reason += ": chosen for small sags" if "stiffness" in question.scene.contact.chosen else ""
    ignored = question.ignored("stiffness", PENALTY) if value else ""
    return Effect("penalty_stiffness", active, reason, "nothing would hold a body that rests on another", ignored)


def contact_damping(question: Question) -> Effect:
    """Contact damping, B of (5)."""
    value = question.scene.contact.damping
    active, reason = _valued(question, PENALTY, "damping", value, "N s/m")
    if active and "damping" in question.scene.contact.chosen:
        reason += ": chosen so that overlaps fade in 10 ms"
    ignored = question.ignored("damping", PENALTY) if value else ""
    return Effect("contact_damping", active, reason, "resting contacts would swing on their springs", ignored)


def friction(question: Question) -> Effect:
    """Friction at resting contacts, by Coulomb's law or by (6)."""
    active, reason = _rough(question, FRICTION)
    rough = question.frictions[-1:] > (0.0,)
    ignored = question.ignored("friction", FRICTION) if rough else ""
    return Effect("friction", active, reason, "bodies would slide along each other without loss", ignored)


def _rough(question: Question, part: str) -> tuple[bool, str]:
    """Decide an effect that is on if a pair has friction and the law uses this part."""
    unused, values = question.unused(part), question.frictions
    if unused is None and not values:
        unused = "nothing can rub: the scene has no pair of shapes"
    own = len(values) > 1 or values[:1] not in ((), (question.scene.contact.friction,))
    if not own:
        value = values[0] if values else 0.0
        return unused is None and value > 0.0, unused or f"contact.friction = {number(value)}"
    said = f"friction {number(values[0])} to {number(values[-1])}, by pair: of two values the geometric mean"
    if len(values) == 1:
        said = f"all pairs have friction {number(values[0])}"
    return unused is None and values[-1] > 0.0, unused or said


def clustering(question: Question) -> Effect:
    """Clustering: contacts close together count as one (section III)."""
    value = question.scene.contact.cluster_distance
    active, reason = _valued(question, CLUSTERS, "cluster_distance", value, "m")
    return Effect("clustering", active, reason, "contacts that a fine mesh repeats would count several times")


def coherence(question: Question) -> Effect:
    """Coherence: a contact near one of the previous step is not new (section III)."""
    value = question.scene.contact.coherence_distance
    active, reason = _valued(question, NEWNESS, "coherence_distance", value, "m")
    return Effect("coherence", active, reason, "contacts that move from facet to facet would collide again")


def _valued(question: Question, part: str, field: str, value: float, unit: str) -> tuple[bool, str]:
    """Decide an effect that is on if its value is not zero and a contact needs it."""
    unused = question.unused(part)
    if unused is None and value == 0.0:
        unused = f"contact.{field} = 0"
    return unused is None, unused or f"contact.{field} = {number(value)}{' ' + unit if unit else ''}"


def _pairs(count: int) -> str:
    return "1 pair" if count == 1 else f"{count} pairs"


def coupling(question: Question) -> Effect:
    """Coupling of a device to the tool (section VI)."""
    absent = question.without_device()
    gains = question.gains()
    name = question.coupling or "a coupling"
    reason = (
        absent or f"{name} holds tool and device together, stiffness {numbers(gains.stiffness)} N/m, N m/rad"
    )
    return Effect(
        "coupling", absent is None, reason, "the hand would hold the tool itself, without a device between"
    )


def device_limits(question: Question) -> Effect:
    """Force limits of the device, and the treatment of larger forces (section VI)."""
    limit = question.scene.device.force_limit if question.scene.device else None
    scaled = question.rendering in ("scale", "spread")  # the tool's impulse is scaled with and without a device
    absent = None if scaled else question.without_device()
    if absent is None and limit is None:
        absent = "the scene gives no device.force_limit"
    if absent is None and question.rendering == "full":
        absent = "the rendering 'full' ignores the limits"
    how = f", rendering '{question.rendering}'" if question.rendering else ""
    reason = absent or f"device.force_limit = {numbers(limit or ())} N, N m{how}"
    return Effect(
        "device_limits", absent is None, reason, "the hand would feel impulses that no motor can give"
    )


def delay(question: Question) -> Effect:
    """Delay between world and device, in steps."""
    steps = question.scene.device.delay if question.scene.device else 0
    absent = question.without_device() or ("device.delay = 0" if steps == 0 else None)
    reason = absent or f"device.delay = {steps} steps, {number(1e3 * steps * question.scene.step)} ms"
    return Effect(
        "delay", absent is None, reason, "the coupling would look more stable than over a real line"
    )


def quantisation(question: Question) -> Effect:
    """Quantised positions of the device's sensors."""
    resolution = question.scene.device.position_resolution if question.scene.device else None
    active, reason = _listed(question, "position_resolution", resolution, "m, rad")
    return Effect("quantisation", active, reason, "the coupling would be fed exact positions and velocities")


def device_damping(question: Question) -> Effect:
    """Physical damping of the device, which bounds the virtual damping (C20)."""
    damping = question.scene.device.damping if question.scene.device else None
    active, reason = _listed(question, "damping", damping, "N s/m, N m s/rad")
    return Effect(
        "device_damping", active, reason, "the device would be a pure inertia, the worst case for stability"
    )


def waveform(question: Question) -> Effect:
    """Waveform that spreads an impulse to the device over many steps."""
    name = question.scene.device.waveform if question.scene.device else "step"
    absent = question.without_device() or question.unused(IMPULSES)
    if absent is None and question.coupling == "unilateral":
        absent = "a unilateral coupler gives the hand no impulse"
    if absent is None and not question.logs_impulses:
        absent = f"the law '{question.law}' does not say what its impulses take"
    if absent is None and name == "step":
        absent = "device.waveform = step: an impulse is given in one step"
    reason = absent or f"device.waveform = {name}: an impulse is given over many steps, watched by the observer"
    return Effect("waveform", absent is None, reason, "the hand would get each impulse as a blow of one step")


def _listed(question: Question, field: str, values: Sequence[float] | None, unit: str) -> tuple[bool, str]:
    """Decide an effect that is on if a device takes part and one of the values is not zero."""
    absent = question.without_device()
    if absent is None and not any(values or ()):
        absent = f"the scene gives no device.{field}"
    return absent is None, absent or f"device.{field} = {numbers(values or ())} {unit}"


EFFECTS: tuple[Callable[[Question], Effect], ...] = (
    gravity,
    varying_inertia,
    velocity_terms,
    hand_force,
    joint_damping,
    joint_limits,
    wall_contacts,
    body_contacts,
    self_collisions,
    impulses,
    unequal_restitution,
    impact_friction,
    penalty_stiffness,
    contact_damping,
    friction,
    clustering,
    coherence,
    coupling,
    device_limits,
    delay,
    quantisation,
    device_damping,
    waveform,
)

EFFECT_NAMES = tuple(effect.__name__ for effect in EFFECTS)


def decide_effects(
    scene: Scene, law: ContactLaw | str | None = None, coupling: Coupling | str | None = None,
    rendering: str | None = None,
) -> tuple[Effect, ...]:
    """Decide which effects are on for a scene and for the caller's choices.

    Parameters
    ----------
    scene
        a checked scene.
    law, coupling
        the objects, or their names in a run file, such as "penalty" and "four-channel". With None, an effect is on if
        some law or coupling needs it. The attribute ``uses`` of a law names the parts of the contact section that it
        uses (`iapb.contact.laws`); a law without it is assumed to use all of them.
    rendering
        such as "scale"; default: the rendering of the law.

    Returns
    -------
    tuple of Effect
        all effects in a fixed order, each with its state, the reason, and what would change without it.
    """
    scene, _ = settled(scene)
    mechanism, shapes = mechanism_of(scene), shapes_of(scene)
    pairs = pairs_of(scene, shapes)
    values = (np.unique(each).tolist() for each in (restitutions_of(scene, pairs), friction_by_pair(scene, pairs)))
    facts = Facts(mechanism, *count_pairs(mechanism, shapes, pairs), *map(tuple, values))
    return decide_for(scene, facts, law, coupling, rendering)


def count_pairs(mechanism: Mechanism, shapes: Shapes, pairs: NDArray[np.int32]) -> tuple[int, int, int]:
    """Return the numbers of candidate pairs with walls, between two trees, and within one tree."""
    counts = {"wall": 0, "body": 0, "tree": 0}
    for a, b in pairs:
        tree_a, body_b = mechanism.tree_of_body[shapes.body[a]], shapes.body[b]
        same = body_b >= 0 and mechanism.tree_of_body[body_b] == tree_a
        counts["wall" if body_b < 0 else "tree" if same else "body"] += 1
    return counts["wall"], counts["body"], counts["tree"]


def decide_for(
    scene: Scene, facts: Facts, law: ContactLaw | str | None, coupling: Coupling | str | None,
    rendering: str | None = None,
) -> tuple[Effect, ...]:
    """Do what `decide_effects` does for a settled scene with known facts."""
    if law is not None and not isinstance(law, str) and hasattr(law, "within"):
        law = law.within(scene)
    known = ENGINE_LAWS.get(law) if isinstance(law, str) else law
    if rendering is None and law is not None and not isinstance(law, str):
        rendering = getattr(law, "rendering", "full")
    uses = EVERYTHING | {JOINTS} if known is None else getattr(known, "uses", EVERYTHING)
    limited = tuple(body.name for body in scene.bodies if body.joint_limits is not None and JOINTS in uses)
    question = Question(
        scene, *facts, limited=limited,
        law=law if law is None or isinstance(law, str) else law.name, uses=uses,
        coupling=coupling if coupling is None or isinstance(coupling, str) else coupling.name,
        logs_impulses=law is None or isinstance(law, str) or getattr(law, "impulses", False),
        own_gains=coupling if hasattr(coupling, "stiffness") else None, rendering=rendering,
    )
    return tuple(decide(question) for decide in EFFECTS)


def ignored_fields(effects: Iterable[Any]) -> tuple[str, ...]:
    """Return the fields that the law ignores, friction first, from effects or from the rows of a run."""
    found = [effect.ignores for effect in effects if effect.ignores]
    return tuple(sorted(found, key=lambda field: field != "friction"))


def active_names(effects: Sequence[Effect]) -> frozenset[str]:
    """Return the names of the effects that are on."""
    return frozenset(effect.name for effect in effects if effect.active)
