"""Effects of contact: who can touch, impulses, penalties, friction, and the filters of flickering contacts."""

from __future__ import annotations

from iapb.effects.question import (
    CLUSTERS,
    FRICTION,
    IMPACT_FRICTION,
    IMPULSES,
    NEWNESS,
    OWN_RESTITUTION,
    PENALTY,
    Effect,
    Question,
    number,
)


def wall_contacts(question: Question) -> Effect:
    """Contacts with the static world."""
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
    """Impulses (20)-(21) when a contact is new."""
    unused = question.unused(IMPULSES)
    reason = unused or f"new contacts collide: {_restitution(question)}"
    return Effect(
        "impulses", unused is None, reason, "bodies would be stopped by springs alone and sink in further"
    )


def _restitution(question: Question) -> str:
    """Say the restitution of the pairs that can touch."""
    smallest, largest = question.restitutions[0], question.restitutions[-1]
    if smallest < largest:
        return f"restitution {number(smallest)} to {number(largest)}, the smaller that body or wall of a pair gives"
    own = smallest != question.scene.contact.restitution
    return f"{'all pairs have restitution' if own else 'contact.restitution ='} {number(smallest)}"


def unequal_restitution(question: Question) -> Effect:
    """Contacts of one impact that differ in restitution: a future extension in the paper.

    The engine's impulses follow Poisson's law there; rigid constraints Newton's for each contact while that has a
    solution that gains nothing, else Poisson's.
    """
    unused = question.unused(OWN_RESTITUTION)
    if unused is None and len(question.restitutions) == 1:
        unused = f"alike everywhere: {_restitution(question)}"
    reason = unused or f"pairs that can touch differ: {_restitution(question)}"
    return Effect("unequal_restitution", unused is None, reason, "all contacts of a collision would bounce alike")


def impact_friction(question: Question) -> Effect:
    """Coulomb friction in the impacts themselves: a future extension in the paper."""
    contact = question.scene.contact
    active, reason = _valued(question, IMPACT_FRICTION, "friction", contact.friction, "")
    if active and contact.self_collision_rows == "per_body":
        active, reason = False, "contact.self_collision_rows = per_body: rows of one body alone have no slip"
    return Effect("impact_friction", active, reason, "bodies would bounce without losing tangential speed")


def penalty_stiffness(question: Question) -> Effect:
    """K of (5)."""
    value = question.scene.contact.stiffness
    active, reason = _valued(question, PENALTY, "stiffness", value, "N/m")
    return Effect("penalty_stiffness", active, reason, "nothing would hold a body that rests on another")


def contact_damping(question: Question) -> Effect:
    """B of (5)."""
    value = question.scene.contact.damping
    active, reason = _valued(question, PENALTY, "damping", value, "N s/m")
    return Effect("contact_damping", active, reason, "resting contacts would swing on their springs")


def friction(question: Question) -> Effect:
    """Modified Coulomb friction (6)."""
    value = question.scene.contact.friction
    active, reason = _valued(question, FRICTION, "friction", value, "")
    return Effect("friction", active, reason, "bodies would slide along each other without loss")


def clustering(question: Question) -> Effect:
    """Contacts close together count as one (section III)."""
    value = question.scene.contact.cluster_distance
    active, reason = _valued(question, CLUSTERS, "cluster_distance", value, "m")
    return Effect("clustering", active, reason, "contacts that a fine mesh repeats would count several times")


def coherence(question: Question) -> Effect:
    """A contact near one of the step before is not new (section III)."""
    value = question.scene.contact.coherence_distance
    active, reason = _valued(question, NEWNESS, "coherence_distance", value, "m")
    return Effect("coherence", active, reason, "contacts that move from facet to facet would collide again")


def _valued(question: Question, part: str, field: str, value: float, unit: str) -> tuple[bool, str]:
    """Decide an effect that is on where its number is not zero and a contact needs it."""
    unused = question.unused(part)
    if unused is None and value == 0.0:
        unused = f"contact.{field} = 0"
    return unused is None, unused or f"contact.{field} = {number(value)}{' ' + unit if unit else ''}"


def _pairs(count: int) -> str:
    return "1 pair" if count == 1 else f"{count} pairs"
