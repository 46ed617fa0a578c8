"""Effects of free motion: gravity, inertia that depends on the configuration, velocity terms, the hand's force."""

from __future__ import annotations

from iapb.effects.question import Effect, Question, numbers

TURNING_JOINTS = ("revolute", "continuous", "planar", "spherical", "free_flyer")


def gravity(question: Question) -> Effect:
    """G of (1)."""
    field = question.scene.gravity
    active = field is not None and any(field) and any(body.mass > 0.0 for body in question.scene.bodies)
    if active:
        reason = f"gravity is on: gravity = {numbers(field or ())} m/s2"
    elif field is not None and any(field):
        reason = "no body has mass"
    else:
        reason = "the scene gives no gravity"
    return Effect("gravity", active, reason, "bodies would not fall, links would not sag")


def varying_inertia(question: Question) -> Effect:
    """M(q) of (1), where it is not constant."""
    active = not question.mechanism.has_constant_mass_matrix
    reason = (
        f"the mass matrix depends on the configuration: {_turning(question)} carries mass off its axis or other links"
        if active
        else "the mass matrix is constant: it is factored once, before the first step"
    )
    return Effect("varying_inertia", active, reason, "links would keep the inertia of their first pose")


def velocity_terms(question: Question) -> Effect:
    """B of (1): Coriolis and centripetal forces."""
    active = question.mechanism.has_velocity_terms
    reason = (
        f"bodies carried by {_turning(question)} feel Coriolis or centripetal forces"
        if active
        else "no joint feels the velocity of another: B(q, v) is zero for every motion"
    )
    return Effect("velocity_terms", active, reason, "swinging links would gain or lose energy in free motion")


def hand_force(question: Question) -> Effect:
    """J_h^T F_h of (1)."""
    hand = question.scene.hand
    active = hand is not None and any(hand.force)
    if hand is None:
        reason = "the scene has no hand"
    elif active:
        units = "N, N, N m" if len(hand.force) == 3 else "N, N, N, N m, N m, N m"
        reason = f"the hand pushes {hand.body} with hand.force = {numbers(hand.force)} {units}"
    else:
        reason = "the hand holds still: hand.force is zero"
    return Effect("hand_force", active, reason, "the tool would not be pushed")


def _turning(question: Question) -> str:
    """Name the joints that turn something."""
    turning = [body.name for body in question.scene.bodies if body.joint in TURNING_JOINTS]
    return f"the joint{'' if len(turning) == 1 else 's'} of {', '.join(turning)}"
