"""The energy balance of a run: stored energy, work, losses, and the residual of the time integration.

The normal force (5) of a contact is a spring K s and a damper −B v_n; their sum never pulls. The spring stores
K s² / 2. The damper's work is its force, held over the step, times the distance by which the touching points separate.

A force held over a step does other work than a force that changes within the step. This error belongs to the integrator
and falls with its declared order; any residual that does not fall is a fault. The residual has two channels, the motion
and the contact springs. The two may have opposite signs, so their absolute values are added.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iapb.mechanics.integrators import INTEGRATORS
from iapb.run import Run
from iapb.scene import Scene, scene_from_text
from iapb.scene.mechanism import mechanism_of

Floats = NDArray[np.float64]
Book = Mapping[str, float]

REFINEMENTS = (1, 2, 4)  # divisors of the scene's step
ROUNDING = 1e-12  # share of the total energy that bounds the rounding of some thousand sums in double precision
ORDER_SLACK = 0.25  # tolerance below the declared order, because collision times change with the step
OPEN_SHARE, GAIN_SHARE = "residual by size, share of the energy exchanged", "most energy beyond what was put in"
_HELD = ("kinetic", "potential", "in contact springs")


def energy_series(run: Run) -> dict[str, Floats]:
    """Return the energies at every instant (n + 1,) [J]: stored energies, and work and losses accumulated so far."""
    ledger, (springs, damping_work) = run.energy, contact_energy(run, scene_of(run))
    sums = {"given": ledger["hand_work"] + ledger["coupling_work"], "lost impacts": ledger["impact_loss"],
            "lost damping": -damping_work, "lost friction": -ledger["friction_work"]}
    stored = {"kinetic": ledger["kinetic"], "potential": ledger["potential"], "springs": springs}
    return stored | {name: np.append(0.0, values) for name, values in sums.items()}


def scene_of(run: Run) -> Scene:
    """Return the scene that is stored in the run."""
    return scene_from_text(json.dumps(run.scene_resolved))


def energy_book(run: Run) -> dict[str, float]:
    """Return the energy balance of a run: the quantities by name, in joules or per cent.

    `iapb.mechanics.energy` records the work of the penalties as one sum. This function splits it into the energy in the
    springs at the end, the work of the dampers, and the remainder, which is the error of one spring evaluation per
    step.
    """
    series, ledger, turned = energy_series(run), run.energy, turned_over(run)
    springs, damping = series["springs"], series["lost damping"][-1]
    parts = dict(zip(_HELD, (series["kinetic"], series["potential"], springs), strict=True))
    held = series["kinetic"] + series["potential"] + springs
    book = {f"{name}, {when}": float(values[place])
            for when, place in (("start", 0), ("end", -1)) for name, values in parts.items()}
    book |= {
        "work of the hand": float(ledger["hand_work"][-1]), "work of the coupling": float(ledger["coupling_work"][-1]),
        "lost in impacts": float(series["lost impacts"][-1]) + 0.0,  # + 0.0 turns −0.0 into 0.0
        "lost in contact damping": float(damping) + 0.0, "lost in friction": float(series["lost friction"][-1]) + 0.0,
        "residual: motion": float(ledger["integration_residual"][-1]),
        "residual: springs": float(ledger["penalty_work"][-1] + damping) + float(springs[-1] - springs[0]),
        "energy exchanged": turned,
    }
    gain = float((held - held[0] - series["given"]).max())
    shares = {OPEN_SHARE: left_open(book), GAIN_SHARE: gain}
    return book | {name: 100 * (part / turned) if turned else 0.0 for name, part in shares.items()}


def turned_over(run: Run) -> float:
    """Return the energy exchanged [J]: the largest of kinetic energy, range of the potential, work of hand or coupling.
    """
    ledger = run.energy
    candidates = [ledger["kinetic"].max(), np.ptp(ledger["potential"])]
    candidates += [np.abs(ledger[name]).max(initial=0.0) for name in ("hand_work", "coupling_work")]
    return float(max(candidates))


def left_open(book: Book) -> float:
    """Return the energy residual [J]: the sum of the absolute residuals of motion and springs."""
    return abs(book["residual: motion"]) + abs(book["residual: springs"])


def total(book: Book, when: str) -> float:
    """Return the total stored energy [J] at the "start" or the "end"."""
    return sum(book[f"{name}, {when}"] for name in _HELD)


def is_rounding(book: Book) -> bool:
    """Whether the energy residual is at most the rounding of the energies."""
    scale = max(abs(total(book, "start")), abs(total(book, "end")), book["energy exchanged"])
    return left_open(book) <= ROUNDING * scale


@dataclass(frozen=True)
class OpenBooks:
    """Energy residuals of a scene at decreasing steps.

    step : the scene's own step [s]; refinements : divisors of this step
    open_shares : energy residual at each refinement, as a share of the energy exchanged
    order : measured order of the residual; None if the residual is rounding
    """

    scene: str
    step: float
    refinements: tuple[int, ...]
    open_shares: tuple[float, ...]
    declared_order: int
    order: float | None

    @property
    def falls_as_declared(self) -> bool:
        """Whether the residual is rounding or falls at least with the declared order."""
        return as_declared(self.order, self.declared_order)

    def step_for(self, wanted: float) -> float | None:
        """Return a step [s] whose residual is at most the share `wanted`: a tested step or one from the measured order.
        """
        for factor, found in zip(self.refinements, self.open_shares, strict=True):
            if found <= wanted:
                return self.step / factor
        if self.order is None or self.order <= 0.0:
            return None
        return self.step / self.refinements[-1] * (wanted / self.open_shares[-1]) ** (1.0 / self.order)


def as_declared(order: float | None, declared: int) -> bool:
    """Whether a measured order is at least the declared one; None is the order of rounding."""
    return order is None or order >= declared - ORDER_SLACK


def measured_order(first: float, last: float, refinement: float) -> float:
    """Return p if the error falls as step^p from `first` to `last` when the step is divided by `refinement`."""
    return math.log(first / last) / math.log(refinement) if last > 0.0 else math.inf


def open_books(
    scene: Scene, simulate: Callable[[Scene], Run], refinements: Sequence[int] = REFINEMENTS
) -> OpenBooks:
    """Run a scene at decreasing steps and return its energy residuals.

    simulate : returns the run of a scene in any world
    """
    books: list[dict[str, float]] = []
    for factor in refinements:
        run = simulate(scene.with_values({"rate": scene.rate * factor}))
        books.append(energy_book(run))
        if is_rounding(books[-1]):
            break
    done = tuple(refinements[: len(books)])
    falls = None if len(done) < 2 else measured_order(left_open(books[0]), left_open(books[-1]), done[-1] / done[0])
    return OpenBooks(scene.name, 1.0 / scene.rate, done, tuple(book[OPEN_SHARE] / 100 for book in books),
                     INTEGRATORS[run.law_settings["integrator"]].order, falls)


def contact_energy(run: Run, scene: Scene) -> tuple[Floats, Floats]:
    """Return the energy in the contact springs at each instant (n + 1,) and the work of the dampers so far (n,) [J]."""
    contacts = run.contacts
    step = np.repeat(np.arange(run.steps), np.diff(contacts.offsets))
    overlap = np.maximum(-contacts.gap, 0.0)
    spring = scene.contact.stiffness * overlap
    # Spring and damper act if they push, or if the damper cancels the spring. In a colliding group the impulse acts
    # instead of both. The damper is limited if it would pull more than the spring pushes.
    cancelled = spring <= scene.contact.damping * contacts.normal_velocity
    acts = (contacts.normal_force != 0.0) | cancelled
    damper = np.where(acts, contacts.normal_force - spring, 0.0)
    held = np.bincount(step, 0.5 * scene.contact.stiffness * overlap**2 * acts, minlength=run.steps)
    work = np.bincount(step, damper * separations(run, scene, step), minlength=run.steps)
    return np.append(held, held[-1:]), np.cumsum(work)  # the last state has no contacts recorded


def separations(run: Run, scene: Scene, step: NDArray[np.int64]) -> Floats:
    """Return the distance (m,) [m] by which the touching points of each contact separate along its normal in its step.
    """
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
