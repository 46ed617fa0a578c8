"""The tables of the topic of the scenes: one row per scene, and the books over time that its figure draws."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from verification.finding import Table, titled

if TYPE_CHECKING:
    from iapb.run import Run
    from verification.scenes.open_books import OpenBooks
    from verification.scenes.scene_measures import SceneMeasure

YARDSTICK = "peg_corner"  # the paper's scene: its step is the unit of time
INSTANTS = 90  # of the books over time: as many as a strip of the figure can show

CONTACTS, LEDGER, OPEN, OVER_TIME = "contact and time", "energy ledger", "what the books leave open", "books over time"
SERIES = ("kinetic", "potential", "springs", "given", "lost_impacts", "lost_damping", "lost_friction")


def all_tables(
    runs: Sequence[Run], measures: Sequence[SceneMeasure], books: Sequence[OpenBooks]
) -> dict[str, Table]:
    """Return every table of the topic by name."""
    return {CONTACTS: contacts(measures), LEDGER: ledger(measures), OPEN: left_open(books), OVER_TIME: over_time(runs)}


def pace_of(measures: Sequence[SceneMeasure]) -> float | None:
    """Return the time of the yardstick's step [s]; None where that scene failed."""
    return next((each.seconds_per_step for each in measures if each.scene == YARDSTICK), None)


def contacts(measures: Sequence[SceneMeasure]) -> Table:
    """How deep, how many collisions, how long a step takes, how it ends."""
    unit = pace_of(measures)
    columns = (
        "scene", "dimensions", "steps", "step [ms]", "most penetration [mm]", "impacts", "most rows in one impact",
        "most contacts in one step", "time per step [µs]", "time per step, peg in the corner = 1",
        "times faster than real time", "how it ends", "energy turned over [J]",
    )  # fmt: skip
    rows = tuple(
        (m.scene, m.dimensions, m.steps, 1e3 * m.dt, 1e3 * m.penetration, m.impacts, m.most_rows, m.most_contacts,
         1e6 * m.seconds_per_step, unit and m.seconds_per_step / unit, m.realtime_factor, m.ending, m.book.turned_over)
        for m in measures
    )  # fmt: skip
    note = "Time of the quickest part of each run, measured on this machine: compare the ratios."
    return titled(columns, rows, digits=3, note=note, timed=columns[8:11])


def ledger(measures: Sequence[SceneMeasure]) -> Table:
    """Every joule of each run."""
    columns = (
        "scene", "kinetic, start [J]", "potential, start [J]", "kinetic, end [J]", "potential, end [J]",
        "in contact springs, end [J]", "work of the hand [J]", "work of the coupling [J]", "lost in impacts [J]",
        "lost in contact damping [J]", "lost in friction [J]", "open: motion [J]", "open: springs [J]",
        "open, share of the energy turned over [%]", "most energy beyond what was put in [%]",
    )  # fmt: skip
    rows = tuple(
        (m.scene, b.kinetic_start, b.potential_start, b.kinetic_end, b.potential_end, b.springs_end, b.hand,
         b.coupling, b.lost_impacts, b.lost_damping, b.lost_friction, b.from_motion, b.from_springs,
         100 * b.open_share, 100 * b.gain_share)
        for m, b in ((m, m.book) for m in measures)
    )  # fmt: skip
    note = (
        "End − start = work of hand and coupling − losses + open. Open is energy that the steps in time made up (> 0) "
        "or swallowed (< 0): by forces on the motion that are held over a step, and by springs that are felt once a "
        "step. A loss too is a force times a path, held over each step, and can so come out a little below zero. "
        "Shares are of the energy turned over: the largest of kinetic energy, range of the potential, work of hand "
        "and of coupling."
    )
    return titled(columns, rows, digits=3, note=note)


def left_open(books: Sequence[OpenBooks]) -> Table:
    """What is open at shorter and shorter steps, and the order at which it falls."""
    refinements = max((each.refinements for each in books), key=len)
    columns = ("scene", *(_heading(factor) for factor in refinements), "order declared", "order measured")
    rows = tuple(
        (each.scene, *(100 * value for value in each.open_shares),
         *(None,) * (len(refinements) - len(each.open_shares)), each.declared_order, each.order)
        for each in books
    )  # fmt: skip
    return titled(columns, rows, digits=3, note="No order: what is open is rounding, and no shorter step was tried.")


def _heading(factor: int) -> str:
    return "open at the scene's step [%]" if factor == 1 else f"at 1/{factor} of it [%]"


def over_time(runs: Sequence[Run]) -> Table:
    """The books of each run at some instants, with the impacts since the instant before."""
    from verification.scenes.scene_measures import energy_series

    rows: list[tuple[object, ...]] = []
    for run in runs:
        series = energy_series(run)
        shown = np.unique(np.linspace(0, run.steps, INSTANTS + 1).round().astype(int))
        struck = np.histogram(run.impacts.step + 1, [*shown, run.steps + 1])[0]
        for place, impacts in zip(shown, [0, *struck[:-1]], strict=True):
            values = (float(getattr(series, name)[place]) for name in SERIES)
            rows.append((run.scene_name, float(run.time[place]), *values, int(impacts)))
    columns = ("scene", "time [s]", *(f"{name.replace('_', ' ')} [J]" for name in SERIES), "impacts")
    return titled(columns, tuple(rows))
