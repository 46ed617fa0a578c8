"""Effects of the hand's side: coupling, the device's force limits, delay, sensors and damping."""

from __future__ import annotations

from collections.abc import Sequence

from iapb.effects.question import IMPULSES, Effect, Question, number, numbers


def coupling(question: Question) -> Effect:
    """A device coordinated with the tool (section VI)."""
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
    """Largest forces that the device renders, and what is done about larger ones (section VI)."""
    limit = question.scene.device.force_limit if question.scene.device else None
    scaled = question.rendering in ("scale", "spread")  # the tool's impulse is scaled, device or not
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
    """Steps that pass between world and device."""
    steps = question.scene.device.delay if question.scene.device else 0
    absent = question.without_device() or ("device.delay = 0" if steps == 0 else None)
    reason = absent or f"device.delay = {steps} steps, {number(1e3 * steps * question.scene.step)} ms"
    return Effect(
        "delay", absent is None, reason, "the coupling would look more stable than over a real line"
    )


def quantisation(question: Question) -> Effect:
    """Positions as the device's sensors see them."""
    resolution = question.scene.device.position_resolution if question.scene.device else None
    active, reason = _listed(question, "position_resolution", resolution, "m, rad")
    return Effect("quantisation", active, reason, "the coupling would be fed exact positions and velocities")


def device_damping(question: Question) -> Effect:
    """Physical damping of the device: it bounds the virtual damping (C20)."""
    damping = question.scene.device.damping if question.scene.device else None
    active, reason = _listed(question, "damping", damping, "N s/m, N m s/rad")
    return Effect(
        "device_damping", active, reason, "the device would be a pure inertia, the worst case for stability"
    )


def waveform(question: Question) -> Effect:
    """An impulse handed out to the device over many steps."""
    name = question.scene.device.waveform if question.scene.device else "step"
    absent = question.without_device() or question.unused(IMPULSES)
    if absent is None and question.coupling == "unilateral":
        absent = "a unilateral coupler gives the hand no impulse"
    if absent is None and name == "step":
        absent = "device.waveform = step: an impulse is given in one step"
    reason = absent or f"device.waveform = {name}: an impulse is given over many steps, watched by the observer"
    return Effect("waveform", absent is None, reason, "the hand would get each impulse as a blow of one step")


def _listed(question: Question, field: str, values: Sequence[float] | None, unit: str) -> tuple[bool, str]:
    """Decide an effect that is on where a device takes part and any of its numbers is not zero."""
    absent = question.without_device()
    if absent is None and not any(values or ()):
        absent = f"the scene gives no device.{field}"
    return absent is None, absent or f"device.{field} = {numbers(values or ())} {unit}"
