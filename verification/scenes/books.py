"""The energy book of a run: what is stored, what was given, what was lost, and what is left open.

The normal force (5) of a contact is a spring K s and a damper −B v_n; their sum never pulls. The
spring stores K s² / 2. The damper's work is its force, held over the step, times the distance by
which the touching points separate.

A force held over a step does other work than a force that changes within the step. This error
belongs to the integrator and falls with its order, 1; any residual that does not fall is a fault.
The residual has two channels, the motion and the contact springs. The two may have opposite signs,
so their absolute values are added.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from iapb.run import Run
from iapb.scene import Scene, scene_from_text
from iapb.scene.mechanism import mechanism_of
from reference import Floats
from verification.table import Row

# share of the total energy that bounds the rounding of some thousand sums in double precision
ROUNDING = 1e-12
ORDER_SLACK = 0.25  # tolerance below order 1, because collision times change with the step
OPEN = "left open at the scene's step"


def scene_of(run: Run) -> Scene:
    """Return the scene that is stored in the run."""
    return scene_from_text(json.dumps(run.scene_resolved))


def work_given(run: Run, *, device: bool = False) -> Floats:
    """Return the work (n + 1,) [J] of the hand and the coupling on the bodies; with the device,
    that of the hand on bodies and device."""
    names = ("hand_work", "device_hand_work" if device else "coupling_work")
    found = [run.energy[name] for name in names if name in run.energy]
    return np.append(0.0, np.sum(found, axis=0))


def risen(run: Run, *, device: bool = False) -> Floats:
    """Return by how much (n + 1,) [J] kinetic and potential energy exceed the start and the work.

    Springs store energy that is never negative; so a rise is energy that the simulation made.
    """
    held = run.energy["kinetic"] + run.energy["potential"]
    if device and "device_kinetic" in run.energy:
        held = held + run.energy["device_kinetic"]
    above: Floats = held - held[0] - work_given(run, device=device)
    return above


@dataclass(frozen=True)
class EnergyBook:
    """The energies of a run [J].

    Attributes
    ----------
    run : its kinetic and potential energy, work and losses
    springs : (n + 1,) energy in the contact springs
    damping : (n,) work of the contacts' dampers so far
    """

    run: Run
    springs: Floats
    damping: Floats

    @cached_property
    def stored(self) -> Floats:
        """Energy (n + 1,) in motion, height and contact springs."""
        held: Floats = self.run.energy["kinetic"] + self.run.energy["potential"] + self.springs
        return held

    @property
    def lost(self) -> dict[str, float]:
        """Energy lost until the end."""
        energy = self.run.energy
        return {
            "impacts": float(energy["impact_loss"][-1]),
            "contact damping": -float(self.damping[-1]),
            "friction": -float(energy["friction_work"][-1]),
        }

    @property
    def of_motion(self) -> float:
        """What the integration of the motion made up (> 0) or lost (< 0)."""
        return float(self.run.energy["integration_residual"][-1])

    @property
    def of_springs(self) -> float:
        """The same of the contact springs, which are evaluated once a step."""
        work = float(self.run.energy["penalty_work"][-1] - self.damping[-1])
        return work + float(self.springs[-1] - self.springs[0])

    @property
    def left_open(self) -> float:
        """The sum of both residuals by size."""
        return abs(self.of_motion) + abs(self.of_springs)

    @property
    def gain(self) -> float:
        """The most that the stored energy ever exceeds the start and the work."""
        return float((self.stored - self.stored[0] - work_given(self.run)).max())

    @property
    def exchanged(self) -> float:
        """The largest of kinetic energy, range of the potential, work of hand or coupling."""
        energy = self.run.energy
        sizes = [energy["kinetic"].max(), np.ptp(energy["potential"])]
        sizes += [np.abs(energy[name]).max(initial=0.0) for name in ("hand_work", "coupling_work")]
        return float(max(sizes))

    @property
    def rounding(self) -> float:
        """The rounding of these energies."""
        return ROUNDING * max(abs(self.stored[0]), abs(self.stored[-1]), self.exchanged)

    def share(self, energy: float) -> float:
        """Return an energy as a share of the energy exchanged; 0 if none was."""
        return energy / self.exchanged if self.exchanged else 0.0


def energy_book(run: Run) -> EnergyBook:
    """Return the energy book of a run."""
    return EnergyBook(run, *contact_energy(run, scene_of(run)))


def is_first_order(row: Row) -> bool:
    """Whether the measured order in a row is at least 1; rounding has no order."""
    return row["order measured"] is None or bool(row["order measured"] >= 1.0 - ORDER_SLACK)


def open_row(scene: Scene, simulate: Callable[[Scene], Run], refinements: Sequence[int]) -> Row:
    """Return what a scene leaves open at decreasing steps, until rounding is all that is left, and
    the order with which it falls.

    simulate : returns the run of a scene in any world; refinements : divisors of the scene's step
    """
    shares: dict[int, float | None] = dict.fromkeys(refinements)
    left: dict[int, float] = {}
    for factor in refinements:
        book = energy_book(simulate(scene.with_values({"rate": scene.rate * factor})))
        left[factor] = book.left_open
        shares[factor] = book.share(book.left_open)
        if book.left_open <= book.rounding:
            break
    return {
        **{
            f"{OPEN} [%]" if factor == 1 else f"at 1/{factor} of it [%]": _percent(share)
            for factor, share in shares.items()
        },
        "order measured": order_of(left),
    }


def _percent(share: float | None) -> float | None:
    return None if share is None else 100.0 * share


def order_of(left: dict[int, float]) -> float | None:
    """Return the order with which an error falls, from its size by the divisor of the step."""
    (coarse, first) = min(left.items())
    (fine, last) = max(left.items())
    if coarse == fine:
        return None
    return math.log(first / last) / math.log(fine / coarse) if last else math.inf


def contact_energy(run: Run, scene: Scene) -> tuple[Floats, Floats]:
    """Return the energy in the contact springs at each instant (n + 1,) [J], and the work of the
    dampers so far (n,)."""
    contacts = run.contacts
    step = np.repeat(np.arange(run.steps), np.diff(contacts.offsets))
    overlap = np.maximum(-contacts.gap, 0.0)
    stiffness, damping = scene.contact.gains
    spring = stiffness * overlap
    # Spring and damper act if they push, or if the damper cancels the spring. In a colliding group
    # the impulse acts instead of both. The damper is limited if it would pull more than the spring
    # pushes.
    cancelled = spring <= damping * contacts.normal_velocity
    acts = (contacts.normal_force != 0.0) | cancelled
    damper = np.where(acts, contacts.normal_force - spring, 0.0)
    held = np.bincount(step, 0.5 * stiffness * overlap**2 * acts, minlength=run.steps)
    work = np.bincount(step, damper * separations(run, scene, step), minlength=run.steps)
    # the last state has no contacts recorded
    return np.append(held, held[-1:]), np.cumsum(work)


def separations(run: Run, scene: Scene, step: NDArray[np.int64]) -> Floats:
    """Return the distance (m,) [m] by which the touching points of each contact separate along its
    normal in its step."""
    contacts = run.contacts
    if not len(step):
        return np.zeros(0)
    mechanism = mechanism_of(scene)
    places = [mechanism.placements(q) for q in run.q]
    rotation, position = (np.array(part) for part in zip(*places, strict=True))

    def moved(body: NDArray[np.int64]) -> Floats:
        own = np.maximum(body, 0)
        arm = np.einsum("mji,mj->mi", rotation[step, own], contacts.point - position[step, own])
        end = np.einsum("mij,mj->mi", rotation[step + 1, own], arm) + position[step + 1, own]
        return np.where((body >= 0)[:, None], end - contacts.point, 0.0)

    apart: Floats = np.einsum(
        "mi,mi->m", contacts.normal, moved(contacts.body_a) - moved(contacts.body_b)
    )
    return apart
