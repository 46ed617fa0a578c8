"""Which effects a scene calls for, and why (design: simulate only what the scene calls for).

An effect is a function of a `Question`; to add one, write it and name it in `EFFECTS`. Every effect can be
switched by a scene alone: the tests hold each of them to that.
"""

from __future__ import annotations

from collections.abc import Callable

from iapb.effects import contact, device, motion
from iapb.effects.question import Effect, Question
from iapb.scene import Scene

__all__ = ["EFFECTS", "Effect", "decide_effects"]

EFFECTS: tuple[Callable[[Question], Effect], ...] = (
    motion.gravity,
    motion.varying_inertia,
    motion.velocity_terms,
    motion.hand_force,
    contact.wall_contacts,
    contact.body_contacts,
    contact.self_collisions,
    contact.impulses,
    contact.unequal_restitution,
    contact.impact_friction,
    contact.penalty_stiffness,
    contact.contact_damping,
    contact.friction,
    contact.clustering,
    contact.coherence,
    device.coupling,
    device.device_limits,
    device.delay,
    device.quantisation,
    device.device_damping,
    device.waveform,
)


def decide_effects(
    scene: Scene, law: str | None = None, coupling: str | None = None, rendering: str | None = None
) -> tuple[Effect, ...]:
    """Decide every effect for a scene, and for the caller's choices where they are made.

    Parameters
    ----------
    scene
        a checked scene.
    law, coupling, rendering
        names as they stand in a run: such as "penalty", "four-channel", "scale". None leaves the choice open: an
        effect is then on if some choice would need it. An unknown law is taken to use the whole contact section.

    Returns
    -------
    tuple of Effect
        every effect in a fixed order: `active`, the reason, and what leaving it out would change.
    """
    question = Question.about(scene, law, coupling, rendering)
    return tuple(decide(question) for decide in EFFECTS)
