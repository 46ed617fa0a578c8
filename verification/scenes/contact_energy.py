"""What the springs of resting contacts hold and their dampers take, from a stored run alone.

The normal force (5) of a contact is a spring K s and a damper −B v_n, together never pulling. The spring's energy is
K s² / 2; the damper's work is its force, held over the step, times the distance that the touching points moved apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iapb.run import Run
from iapb.scene import Scene
from iapb.scene.mechanism import mechanism_of

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ContactEnergy:
    """`springs` (n + 1,) [J] held at each instant; `damping_work` (n,) [J] done on the bodies so far."""

    springs: Floats
    damping_work: Floats


def contact_energy(run: Run, scene: Scene) -> ContactEnergy:
    """Return the energy in the contact springs and the work of the contact dampers along a run."""
    step = np.repeat(np.arange(run.steps), np.diff(run.contacts.offsets))
    held = 0.5 * scene.contact.stiffness * overlap(run) ** 2 * acting(run, scene)
    springs = np.bincount(step, held, minlength=run.steps)
    work = np.bincount(step, damper_forces(run, scene) * separations(run, scene, step), minlength=run.steps)
    return ContactEnergy(np.append(springs, springs[-1:]), np.cumsum(work))  # the last state has no contacts recorded


def damper_forces(run: Run, scene: Scene) -> Floats:
    """Return the damper's part (m,) [N] of each contact's normal force, > 0 pushes the bodies apart.

    Where the damper would pull more than the spring pushes, it is cut to the spring's force. In a group that collides
    neither acts: the impulse does.
    """
    spring = scene.contact.stiffness * overlap(run)
    return np.where(acting(run, scene), run.contacts.normal_force - spring, 0.0)


def overlap(run: Run) -> Floats:
    """Return the depth (m,) [m] of each contact."""
    depth: Floats = np.maximum(-run.contacts.gap, 0.0)
    return depth


def acting(run: Run, scene: Scene) -> NDArray[np.bool_]:
    """Tell of each contact (m,) whether its spring and damper act: they push, or the damper cancels the spring."""
    pulls = scene.contact.stiffness * overlap(run) <= scene.contact.damping * run.contacts.normal_velocity
    pushes = run.contacts.normal_force != 0.0
    return np.asarray(pushes | pulls)


def separations(run: Run, scene: Scene, step: NDArray[np.int64]) -> Floats:
    """Return how far (m,) [m] the touching points of each contact moved apart along its normal during its step."""
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

    apart: Floats = np.einsum("mi,mi->m", contacts.normal, moved(contacts.body_a) - moved(contacts.body_b))
    return apart
