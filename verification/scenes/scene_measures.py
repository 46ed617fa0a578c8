"""Every scene in a world: penetration, energy ledger, simultaneous rows and time per step, as one record each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iapb.run import Run
from iapb.scene import Scene, find_scene, load_scene, scene_from_text
from reference.worlds import run_world
from verification.scenes.contact_energy import contact_energy

Floats = NDArray[np.float64]

AT_REST = 1e-3  # share of the largest kinetic energy below which a scene is said to have come to rest
NEVER_MOVED = 1e-9  # share of the energy turned over: a kinetic energy below it is rounding and settling springs
LAST_PART = 0.1  # share of the run in which it has to be so

RESTS, SETTLES, MOVES = "stays at rest", "comes to rest", "keeps moving"


@dataclass(frozen=True)
class EnergyBook:
    """The energy of a run, beginning to end [J]; what went out counts positive as a loss.

    turned_over : the largest energy that the run had to handle, which relative numbers are shares of
    unexplained : end − start − put in + lost: energy that the steps in time made up (> 0) or swallowed (< 0)
    largest_gain : most energy ever held beyond the start and what was put in, 0 if never
    """

    start: float
    end: float
    kinetic_start: float
    kinetic_end: float
    potential_start: float
    potential_end: float
    springs_start: float
    springs_end: float
    hand: float
    coupling: float
    lost_impacts: float
    lost_damping: float
    lost_friction: float
    unexplained: float
    from_springs: float  # the part of `unexplained` that the sampled contact springs made
    from_motion: float  # the part that the integration of the motion made
    turned_over: float
    largest_gain: float

    @property
    def open_share(self) -> float:
        """`unexplained` as a share of the energy turned over."""
        return share(self.unexplained, self.turned_over)

    @property
    def gain_share(self) -> float:
        """`largest_gain` as a share of the energy turned over."""
        return share(self.largest_gain, self.turned_over)


@dataclass(frozen=True)
class SceneMeasure:
    """One run.

    penetration : deepest overlap [m]; most_rows : rows of the largest impact; most_contacts : in one step
    seconds_per_step : of the quickest timed chunk, since the first may hold compilation and other load only adds
    realtime_factor : step length over it
    ending : how it stands in the last tenth of the run, in words
    """

    scene: str
    world: str
    dimensions: int
    steps: int
    dt: float
    complete: bool
    penetration: float
    most_rows: int
    most_contacts: int
    impacts: int
    book: EnergyBook
    seconds_per_step: float
    realtime_factor: float
    ending: str


def share(part: float, whole: float) -> float:
    """Return part / whole; nothing of nothing is no share."""
    return part / whole if whole > 0.0 else 0.0


def measure(run: Run, again: Sequence[Run] = ()) -> SceneMeasure:
    """Return the record of a run; `again`: the same simulation once more, to time its step with less chance."""
    pace = min(float((timed.chunk_seconds / timed.chunk_steps).min()) for timed in (run, *again))
    scene, book = scene_of(run), energy_book(run)
    return SceneMeasure(
        run.scene_name, run.world, getattr(scene, "dimensions", 2), run.steps, run.dt, run.complete,
        penetration=float(np.maximum(-run.contacts.gap, 0.0).max(initial=0.0)),
        most_rows=int(run.impacts.rows.max(initial=0)),
        most_contacts=int(np.diff(run.contacts.offsets).max(initial=0)),
        impacts=len(run.impacts.step), book=book,
        seconds_per_step=pace, realtime_factor=run.dt / pace, ending=ending(run, book.turned_over),
    )  # fmt: skip


def scene_of(run: Run) -> Scene:
    """Return the scene that the run carries with it."""
    import json

    return scene_from_text(json.dumps(run.scene_resolved))


def energy_book(run: Run) -> EnergyBook:
    """Close the books of a run: its ledger, and what its contact springs hold and its contact dampers took.

    The ledger (`iapb.mechanics.energy`) has the work of the penalties in one sum; here it is split into what the
    springs hold at the end, what the dampers took, and the rest, which a spring felt only once a step makes up.
    """
    series, ledger = energy_series(run), run.energy
    held = series.kinetic + series.potential + series.springs
    work_of_springs = float(ledger["penalty_work"][-1] + series.lost_damping[-1])
    from_springs = work_of_springs + float(series.springs[-1] - series.springs[0])
    from_motion = float(ledger["integration_residual"][-1])
    ends = {
        f"{name}_{when}": float(getattr(series, name)[place])
        for name in ("kinetic", "potential", "springs") for when, place in (("start", 0), ("end", -1))
    }  # fmt: skip
    names = ("lost_impacts", "lost_damping", "lost_friction")
    lost = {name: float(getattr(series, name)[-1]) + 0.0 for name in names}  # + 0.0: no minus before nothing
    return EnergyBook(
        start=float(held[0]), end=float(held[-1]), **ends, **lost,
        hand=float(ledger["hand_work"][-1]), coupling=float(ledger["coupling_work"][-1]),
        unexplained=from_springs + from_motion, from_springs=from_springs, from_motion=from_motion,
        turned_over=turned_over(run), largest_gain=float((held - held[0] - series.given).max()),
    )  # fmt: skip


@dataclass(frozen=True)
class EnergySeries:
    """The books at every instant (n + 1,) [J]: what is held, what was put in so far, what was lost so far."""

    kinetic: Floats
    potential: Floats
    springs: Floats
    given: Floats
    lost_impacts: Floats
    lost_damping: Floats
    lost_friction: Floats


def energy_series(run: Run) -> EnergySeries:
    """Return the books of a run over time."""
    ledger, contact = run.energy, contact_energy(run, scene_of(run))

    def so_far(sums: Floats) -> Floats:
        return np.append(0.0, sums)

    return EnergySeries(
        ledger["kinetic"], ledger["potential"], contact.springs,
        so_far(ledger["hand_work"] + ledger["coupling_work"]), so_far(ledger["impact_loss"]),
        so_far(-contact.damping_work), so_far(-ledger["friction_work"]),
    )  # fmt: skip


def turned_over(run: Run) -> float:
    """Return the largest of: kinetic energy at any time, range of the potential, work of hand and of coupling [J]."""
    ledger = run.energy
    candidates = [ledger["kinetic"].max(), np.ptp(ledger["potential"])]
    candidates += [np.abs(ledger[name]).max(initial=0.0) for name in ("hand_work", "coupling_work")]
    return float(max(candidates))


def ending(run: Run, turned: float) -> str:
    """Return in words how the scene stands in the last tenth of the run."""
    if not run.complete:
        return f"stopped: {run.stopped}"
    kinetic = run.energy["kinetic"]
    largest, last = kinetic.max(), kinetic[-max(int(LAST_PART * len(kinetic)), 1) :].max()
    if largest <= NEVER_MOVED * max(turned, abs(run.energy["potential"][0])):
        return RESTS
    return SETTLES if last <= AT_REST * largest else MOVES


def study_scenes(names: Sequence[str], worlds: Sequence[str] = ("IAPB",)) -> tuple[SceneMeasure, ...]:
    """Return the measures of scenes that come with the project in the paper's worlds."""
    return tuple(measure(run_world(load_scene(find_scene(name)), world)) for name in names for world in worlds)
