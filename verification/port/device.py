"""The hand's port of a haptic device: what the hand does, what the law reads, and the energy that
the hand gets.

The hand moves the bare device along positions x_k, one per period T. The law reads them rounded by
the encoder and late, with their difference over one period as the velocity. Its force F_k on the
hand is held until the next sample. By the end of period n, the hand has drawn at most

    E_n = Σ F_k·Δx_k − b |Δx_k|²/T − f_c |Δx_k|,   Δx_k = x_{k+1} − x_k,

with the damping b and the Coulomb friction f_c of the bare device. Uniform motion between the
samples dissipates least, so some passive hand draws exactly this. The mass of the device only
stores energy, and drops out. The law is passive on the device if E_n ≤ stored for every motion
from rest at the start, and every n.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from inspect import signature
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from iapb.errors import ArgumentError
from reference import Floats
from verification.impacts import EPS
from verification.laws.resolver import ResolverFault, answer_of


@dataclass(frozen=True)
class BareDevice:
    """A haptic device without its law.

    Parameters
    ----------
    rate : samples per second [Hz].
    damping : physical damping b [N s/m], the least in any direction.
    friction : Coulomb friction f_c [N].
    resolution : of the position sensor [m]; 0: exact.
    reach : how far the hand moves from the start along each axis [m].
    delay : periods by which the readings are late.
    """

    rate: float = 1000.0
    damping: float = 0.0
    friction: float = 0.0
    resolution: float = 0.0
    reach: float = 0.01
    delay: int = 0

    def __post_init__(self) -> None:
        for name in ("rate", "reach"):
            value = getattr(self, name)
            if not 0.0 < value < np.inf:
                raise ArgumentError(name, value, "a finite number above 0")
        for name in ("damping", "friction", "resolution", "delay"):
            value = getattr(self, name)
            if not 0.0 <= value < np.inf:
                raise ArgumentError(name, value, "a finite number, 0 or more")
        if self.delay != int(self.delay):
            raise ArgumentError("delay", self.delay, "a whole number of periods")

    @property
    def dt(self) -> float:
        """Period T [s]."""
        return 1.0 / self.rate

    def readings(self, positions: Floats) -> tuple[Floats, Floats]:
        """Return what the law reads at positions (n, d): x and v, each (n, d)."""
        step = self.resolution
        late = int(self.delay)
        sensed = np.round(positions / step) * step if step > 0.0 else positions.copy()
        if late:
            sensed = np.concatenate([np.repeat(sensed[:1], late, axis=0), sensed])[: len(sensed)]
        rate = np.zeros_like(sensed)
        rate[1:] = np.diff(sensed, axis=0) * self.rate
        return sensed, rate


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion of the hand from rest: a lead-in, then a cycle that is repeated.

    start : (d,) [m]; lead : (m, d); cycle : (p, d), p may be 0; repeats : of the cycle.
    """

    start: Floats
    lead: Floats
    cycle: Floats
    repeats: int = 1

    @property
    def positions(self) -> Floats:
        """Every position (n, d), the start first."""
        again = np.tile(self.cycle, (self.repeats, 1))
        return np.concatenate([self.start[None], self.lead, again, self.cycle[:1]])


class Sums(NamedTuple):
    """Sums of a motion by the end of each period (n,): work of the force on the hand [J], Σ|Δx|²/T
    [m²/s], Σ|Δx| [m], and the rounding of the work [J]."""

    work: Floats
    damped: Floats
    rubbed: Floats
    rounding: Floats

    def drawn(self, damping: float, friction: float) -> Floats:
        """E_n (n,) [J], less its rounding."""
        return self.work - self.rounding - damping * self.damped - friction * self.rubbed


def sums_of(positions: Floats, forces: Floats, dt: float) -> Sums:
    """Return the sums of a motion (n, d) with its forces (n, d), the last of which never acts."""
    change = np.diff(positions, axis=0)
    product = forces[:-1] * change
    length = np.einsum("ij,ij->i", change, change)
    rounding = 4.0 * EPS * len(change) * np.cumsum(np.abs(product).sum(axis=1))
    return Sums(
        np.cumsum(product.sum(axis=1)),
        np.cumsum(length) / dt,
        np.cumsum(np.sqrt(length)),
        rounding,
    )


class Port:
    """A force law behind the sensors and the hold of a device.

    law : a function of (x, v), numbers in one dimension and arrays (d,) in more; an object with
        `step(x, v)` and `reset()`, which forgets earlier samples; `reset(dt)` if the law needs the
        period; a class of such objects, of which each motion gets a new one; or an object with
        `follow(x, v)`, which returns the forces (n, d) of a whole motion from rest.
    """

    def __init__(self, law: Any, device: BareDevice, size: int) -> None:
        self.law = law
        self.device = device
        self.size = size
        self.calls = 0
        self.changed = 0  # motions in which the law changed its arguments

    def forces(self, positions: Floats) -> Floats:
        """Return the forces (n, d) [N] at positions (n, d); raises ResolverFault."""
        answer = answer_of(self.answer, (positions.ravel(),))
        if isinstance(answer, ResolverFault):
            raise answer
        self.calls += len(positions)
        forces: Floats = np.reshape(answer, positions.shape)
        return forces

    def answer(self, flat: Floats) -> Floats:
        """Play a motion, given and answered as a flat array."""
        x, v = self.device.readings(flat.reshape(-1, self.size))
        given = x.copy(), v.copy()
        if hasattr(self.law, "follow"):
            answer = self.law.follow(x, v)
        elif self.size == 1:
            step = self.fresh()
            listed = zip(x[:, 0].tolist(), v[:, 0].tolist(), strict=True)
            answer = [step(at, rate) for at, rate in listed]
        else:
            step = self.fresh()
            answer = [np.array(step(*pair), float) for pair in zip(x, v, strict=True)]
            self.changed += not (np.array_equal(x, given[0]) and np.array_equal(v, given[1]))
        return np.asarray(answer, float).reshape(-1)

    def fresh(self) -> Callable[[Any, Any], Any]:
        """Return the law's function of one sample, which remembers nothing."""
        law = self.law() if isinstance(self.law, type) else self.law
        reset = getattr(law, "reset", None)
        if reset is not None:
            reset(self.device.dt) if signature(reset).parameters else reset()
        step: Callable[[Any, Any], Any] = getattr(law, "step", law)
        return step


def start_of(start: ArrayLike) -> Floats:
    """Return the start as an array (d,)."""
    at = np.atleast_1d(np.asarray(start, float))
    if at.ndim != 1 or not 1 <= len(at) <= 3 or not np.all(np.isfinite(at)):
        raise ArgumentError("start", start, "a number, or two or three coordinates [m]")
    return at
