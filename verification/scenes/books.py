"""The energy balance of a run: stored energy, work, losses, and the residual of the time
integration.

The normal force (5) of a contact is a spring K s and a damper −B v_n; their sum never pulls. The
spring stores K s² / 2. The damper's work is its force, held over the step, times the distance by
which the touching points separate.

A force held over a step does other work than a force that changes within the step. This error
belongs to the integrator and falls with its order, 1; any residual that does not fall is a fault.
The residual has two channels, the motion and the contact springs. The two may have opposite signs,
so their absolute values are added. A line of its own has the part of the springs that curved gaps
cause: the step pushes along J Δq, the touching points move along arcs.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.run import Run
from iapb.scene import Scene, scene_from_text
from iapb.scene.mechanism import mechanism_of
from reference import Floats

Book = Mapping[str, float]

# share of the total energy that bounds the rounding of some thousand sums in double precision
ROUNDING = 1e-12
ORDER_SLACK = 0.25  # tolerance below order 1, because collision times change with the step
OPEN_SHARE, GAIN_SHARE = (
    "residual by size, share of the energy exchanged",
    "most energy beyond what was put in",
)
WORTH_NAMING = 1.0  # [%] of the energy exchanged; scenes with a larger energy residual are listed
OPEN = "residual at the scene's step"
_HELD = ("kinetic", "potential", "in contact springs")


def energy_series(
    run: Run, of_contacts: tuple[Floats, Floats, float] | None = None
) -> dict[str, Floats]:
    """Return the energies at every instant (n + 1,) [J]: stored energies, and work and losses
    accumulated so far."""
    springs, damping_work, _ = of_contacts or contact_energy(run, scene_of(run))
    ledger = run.energy
    sums = {
        "given": ledger["hand_work"] + ledger["coupling_work"],
        "lost impacts": ledger["impact_loss"],
        "lost damping": -damping_work,
        "lost friction": -ledger["friction_work"],
    }
    stored = {"kinetic": ledger["kinetic"], "potential": ledger["potential"], "springs": springs}
    return stored | {name: np.append(0.0, values) for name, values in sums.items()}


def scene_of(run: Run) -> Scene:
    """Return the scene that is stored in the run."""
    return scene_from_text(json.dumps(run.scene_resolved))


def energy_book(run: Run) -> dict[str, float]:
    """Return the energy balance of a run: the quantities by name, in joules or per cent.

    `iapb.mechanics.energy` records the work of the penalties as one sum. This function splits it
    into the energy in the springs at the end, the work of the dampers, and the remainder, which is
    the error of one spring evaluation per step.
    """
    of_contacts = contact_energy(run, scene_of(run))
    series, ledger, turned, pushed = (
        energy_series(run, of_contacts),
        run.energy,
        turned_over(run),
        of_contacts[2],
    )
    springs, damping = series["springs"], series["lost damping"][-1]
    parts = dict(zip(_HELD, (series["kinetic"], series["potential"], springs), strict=True))
    held = series["kinetic"] + series["potential"] + springs
    book = {
        f"{name}, {when}": float(values[place])
        for when, place in (("start", 0), ("end", -1))
        for name, values in parts.items()
    }
    book |= {
        "work of the hand": float(ledger["hand_work"][-1]),
        "work of the coupling": float(ledger["coupling_work"][-1]),
        "lost in impacts": float(series["lost impacts"][-1]) + 0.0,  # + 0.0 turns −0.0 into 0.0
        "lost in contact damping": float(damping) + 0.0,
        "lost in friction": float(series["lost friction"][-1]) + 0.0,
        "residual: motion": float(ledger["integration_residual"][-1]),
        "residual: springs": float(ledger["penalty_work"][-1] + damping)
        + float(springs[-1] - springs[0]),
        "of the springs' residual, curved gaps": float(ledger["penalty_work"][-1]) - pushed,
        "energy exchanged": turned,
    }
    gain = float((held - held[0] - series["given"]).max())
    shares = {OPEN_SHARE: left_open(book), GAIN_SHARE: gain}
    return book | {name: 100 * (part / turned) if turned else 0.0 for name, part in shares.items()}


def turned_over(run: Run) -> float:
    """Return the energy exchanged [J]: the largest of kinetic energy, range of the potential, work
    of hand or coupling."""
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


def rounding_of(book: Book) -> float:
    """Return the rounding of the energies [J]."""
    return ROUNDING * max(
        abs(total(book, "start")), abs(total(book, "end")), book["energy exchanged"]
    )


def is_first_order(row: Mapping[str, Any]) -> bool:
    """Whether the measured order in a row is at least 1; rounding has no order."""
    return row["order measured"] is None or bool(row["order measured"] >= 1.0 - ORDER_SLACK)


def open_row(
    scene: Scene, simulate: Callable[[Scene], Run], refinements: Sequence[int]
) -> dict[str, Any]:
    """Run a scene at decreasing steps, until rounding is all that is left, and return the row of
    its energy residuals.

    simulate : returns the run of a scene in any world; refinements : divisors of the scene's step
    """
    books: list[dict[str, float]] = []
    for factor in refinements:
        run = simulate(scene.with_values({"rate": scene.rate * factor}))
        books.append(energy_book(run))
        if left_open(books[-1]) <= rounding_of(books[-1]):
            break
    first, last = left_open(books[0]), left_open(books[-1])
    order = None
    if len(books) > 1:  # the error falls as step^order
        order = (
            math.log(first / last) / math.log(refinements[len(books) - 1] / refinements[0])
            if last
            else math.inf
        )
    shares = dict(zip(refinements, (book[OPEN_SHARE] / 100 for book in books), strict=False))
    return residual_row(scene.name, 1.0 / scene.rate, dict.fromkeys(refinements) | shares, order)


def residual_row(
    scene: str, step: float, shares: Mapping[int, float | None], order: float | None
) -> dict[str, Any]:
    """Return the row of residuals, shares of the energy exchanged, by the divisor of the scene's
    step [s]; None if that step was not tried."""
    found = step_for(WORTH_NAMING / 100, step, shares, order)
    return {
        "scene": scene,
        **{
            f"{OPEN} [%]" if k == 1 else f"at 1/{k} of this step [%]": None
            if share is None
            else 100 * share
            for k, share in shares.items()
        },
        "order measured": order,
        "the scene's step [ms]": 1e3 * step,
        f"step for a residual of {WORTH_NAMING:g} % [ms]": None if found is None else 1e3 * found,
    }


def step_for(
    wanted: float, step: float, shares: Mapping[int, float | None], order: float | None
) -> float | None:
    """Return a step [s] whose residual is at most the share `wanted`: a tested step or one from the
    measured order."""
    tried = [(factor, share) for factor, share in shares.items() if share is not None]
    for factor, share in tried:
        if share <= wanted:
            return step / factor
    if order is None or order <= 0.0:
        return None
    factor, share = tried[-1]
    return step / factor * (wanted / share) ** (1.0 / order)


def contact_energy(run: Run, scene: Scene) -> tuple[Floats, Floats, float]:
    """Return energies [J]: in the contact springs at each instant (n + 1,), the work of the dampers
    so far (n,), and the work of all normal forces along the paths on which the touching points
    separate.
    """
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
    apart = separations(run, scene, step)
    work = np.bincount(step, damper * apart, minlength=run.steps)
    pushed = float(np.dot(contacts.normal_force, apart))
    return (
        np.append(held, held[-1:]),
        np.cumsum(work),
        pushed,
    )  # the last state has no contacts recorded


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
