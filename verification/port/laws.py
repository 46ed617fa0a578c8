"""The laws of a force law at the hand's port, each judged on one motion of the hand."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from reference import Floats
from verification.impacts import EPS
from verification.laws.bounds import Found, Law, law
from verification.laws.counterexample import rounded
from verification.port.device import Motion, Port, sums_of

FORCE_LAWS: dict[str, Law] = {}
WAIT = 300  # samples at rest before a motion
TAP = 0.8  # of the share that is lost at half the period: 0 for a force, 1 for an impulse


@dataclass(frozen=True)
class Terms:
    """What the law may do: energy stored at the start [J], and the largest force [N] or None."""

    stored: float = 0.0
    limit: float | None = None


def _differing(a: Floats, b: Floats) -> float:
    """Number of samples at which two motions got different bits."""
    return float(np.count_nonzero(np.any(a != b, axis=1)))


@law(FORCE_LAWS, "energy", "E_n ≤ stored: the hand gets no energy")
def hand_gets_no_energy(motion: Motion, port: Port, terms: Terms) -> Found:
    """Largest E_n − stored, relative to the energy exchanged; the tolerance is the rounding of the
    sums."""
    positions = motion.positions
    device = port.device
    forces = port.forces(positions)
    sums = sums_of(positions, forces, device.dt)
    drawn = float(sums.drawn(device.damping, device.friction).max(initial=0.0)) - terms.stored
    exchanged = float(np.abs(forces[:-1] * np.diff(positions, axis=0)).sum()) + terms.stored
    return drawn / exchanged if exchanged > 0.0 else 0.0, 4.0 * len(positions) * EPS


@law(FORCE_LAWS, "finite", "every force is a finite number, and the law raises nothing")
def force_is_finite(motion: Motion, port: Port, terms: Terms) -> Found:
    """0 if the law answers; a fault is infinite."""
    port.forces(motion.positions)
    return 0.0, 0.0


@law(FORCE_LAWS, "repeatable", "the same motion after another: the same forces, bit by bit")
def force_repeats(motion: Motion, port: Port, terms: Terms) -> Found:
    """Number of samples whose force changed; half of the motion is played in between."""
    positions = motion.positions
    first = port.forces(positions)
    port.forces(positions[: 1 + len(positions) // 2])
    return _differing(first, port.forces(positions)), 0.0


@law(FORCE_LAWS, "waiting", f"{WAIT} samples at rest before a motion change no force")
def waiting_changes_nothing(motion: Motion, port: Port, terms: Terms) -> Found:
    """Number of samples whose force changed."""
    positions = motion.positions
    later = np.concatenate([np.repeat(positions[:1], WAIT, axis=0), positions])
    return _differing(port.forces(positions), port.forces(later)[WAIT:]), 0.0


@law(FORCE_LAWS, "silent", "at rest at the start, the force is at most the friction")
def start_is_silent(motion: Motion, port: Port, terms: Terms) -> Found:
    """|F| at the start; with energy stored there, a force is allowed."""
    force = float(np.linalg.norm(port.forces(motion.positions[:1])))
    return (force, port.device.friction) if terms.stored == 0.0 else None


@law(FORCE_LAWS, "arguments", "the law does not change x and v")
def arguments_are_kept(motion: Motion, port: Port, terms: Terms) -> Found:
    """1 if x or v were changed; numbers cannot be."""
    if port.size == 1:
        return None
    before = port.changed
    port.forces(motion.positions)
    return float(port.changed - before), 0.0


@law(FORCE_LAWS, "bounded", "|F| ≤ limit")
def force_is_bounded(motion: Motion, port: Port, terms: Terms) -> Found:
    """Largest |F|; without a limit, the law does not apply."""
    if terms.limit is None:
        return None
    largest = np.linalg.norm(port.forces(motion.positions), axis=1).max()
    return float(largest), terms.limit * (1.0 + 4.0 * EPS)


@law(FORCE_LAWS, "tap", "∫|F| dt of a tap is the same at half the period")
def tap_does_not_depend_on_the_period(motion: Motion, port: Port, terms: Terms) -> Found:
    """Share of ∫|F| dt that is lost at half the period, for the way to the motion's farthest point and
    back: 0 if the integral is the same, 1 if it is half, negative if it changes otherwise.

    An impulse that is handed over as a force loses half. A law with a period of its own cannot
    tell: `reset(dt)` says that it is given the period.
    """
    if hasattr(port.law, "follow"):  # a scene has a period of its own
        return None
    at = motion.positions
    far = at[np.argmax(np.linalg.norm(at - at[0], axis=1))]
    share = np.sin(np.pi * np.arange(40)[:, None] / 40.0) ** 2
    tap = at[0] + share * (far - at[0])
    device = port.device
    half = replace(device, rate=2.0 * device.rate, delay=2 * device.delay)
    forces = port.forces(tap)
    between = 0.5 * (tap + np.roll(tap, -1, axis=0))
    finer = np.stack([tap, between], axis=1).reshape(-1, port.size)
    twice = Port(port.law, half, port.size).forces(finer)
    total = float(np.abs(forces).sum())
    more = float(np.abs(twice).sum()) - total
    return (1.0 - abs(more) / total, TAP) if total > 0.0 else None


def judge(name: str, law: Any, device: Any, motion: Motion, **terms: Any) -> Any:
    """Return the residual of a law of this name for a motion; the tests that are printed call it."""
    port = Port(law, device, len(motion.start))
    return FORCE_LAWS[name].check(motion, port, Terms(**terms))


def smaller_motions(motion: Motion) -> Iterator[Motion]:
    """Yield simpler motions: fewer rounds and samples, then fewer digits."""
    lead = motion.lead
    cycle = motion.cycle
    repeats = motion.repeats
    for fewer in (1, repeats // 10, repeats // 2, repeats - 1):
        if 0 < fewer < repeats and len(cycle):
            yield replace(motion, repeats=fewer)
    if len(cycle) and len(cycle) * repeats <= 12:
        flat = np.concatenate([lead, np.tile(cycle, (repeats, 1)), cycle[:1]])
        yield replace(motion, lead=flat, cycle=cycle[:0], repeats=0)
    for part in (slice(0, 0), slice(None, len(lead) // 2), slice(1, None, 2), slice(None, -1)):
        if len(lead[part]) < len(lead):
            yield replace(motion, lead=lead[part])
    for k in range(min(len(lead), 12)):
        yield replace(motion, lead=np.delete(lead, k, axis=0))
    for digits in (3, 4, 5, 6, 7, 8):
        for name in ("lead", "cycle", "start"):
            yield from rounded(motion, name, digits)
