"""Topic: the scenes of the project in the world IAPB: penetration, energy balance, residual at
shorter steps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from iapb.run import Run
from iapb.scene import find_scene, load_scene, scene_names
from verification.check import Check, Study, Topic
from verification.finding import MIXED, REFUTED, REPRODUCED, Part
from verification.scenes.books import (
    GAIN_SHARE,
    OPEN,
    OPEN_SHARE,
    ORDER_SLACK,
    ROUNDING,
    WORTH_NAMING,
    energy_book,
    energy_series,
    is_first_order,
    open_row,
    rounding_of,
    scene_of,
    turned_over,
)
from verification.table import Row, Table

WORLD = "IAPB"
REFINEMENTS = {"quick": (1, 2, 4), "full": (1, 2, 4, 8)}
INSTANTS = 90  # instants of the energy balance over time: as many as a strip of the figure can show

# a scene is at rest if its kinetic energy is below this share of its largest kinetic energy
AT_REST = 1e-3
# share of the energy exchanged; a smaller kinetic energy is rounding or due to settling springs
NEVER_MOVED = 1e-9
LAST_PART = 0.1  # share of the run, at its end, in which the scene must be at rest
RESTS, SETTLES, MOVES, STOPPED = "stays at rest", "comes to rest", "keeps moving", "stopped: "

# penetration, as a share of the thinnest moving shape, from which contacts push to the wrong side
DEEP = 0.5
_ADDED = "most energy added by an impact, share of the energy exchanged"


def _run(study: Study, name: str) -> Run:
    return study.once((WORLD, name), lambda: study.run(study.scene(name), WORLD))


def contact_row(run: Run) -> dict[str, Any]:
    """Return the penetration, the numbers of collisions and the end of a run."""
    turned = turned_over(run)
    return {
        "scene": run.scene_name,
        "dimensions": getattr(scene_of(run), "dimensions", 2),
        "steps": run.steps,
        "step [ms]": 1e3 * run.dt,
        "most penetration [mm]": 1e3 * float(np.maximum(-run.contacts.gap, 0.0).max(initial=0.0)),
        "thinnest moving shape [mm]": thinnest(run),
        "impacts": len(run.impacts.step),
        "most rows in one impact": int(run.impacts.rows.max(initial=0)),
        _ADDED: float(-run.impacts.energy_lost.min(initial=0.0)) / turned if turned else 0.0,
        "most contacts in one step": int(np.diff(run.contacts.offsets).max(initial=0)),
        "how it ends": ending(run, turned),
        "energy exchanged [J]": turned,
    }


def ending(run: Run, turned: float) -> str:
    """Return in words whether the scene rests or moves in the last tenth of the run, or why the run
    stopped."""
    if not run.complete:
        return STOPPED + run.stopped
    kinetic = run.energy["kinetic"]
    largest, last = kinetic.max(), kinetic[-max(int(LAST_PART * len(kinetic)), 1) :].max()
    if largest <= NEVER_MOVED * max(turned, abs(run.energy["potential"][0])):
        return RESTS
    return SETTLES if last <= AT_REST * largest else MOVES


def thinnest(run: Run) -> float | None:
    """Return the smallest thickness [mm] of a moving shape; None if there is no shape."""
    shapes = [shape for body in run.scene_resolved["bodies"] for shape in body["shapes"]]
    return 1e3 * min(map(_thickness, shapes)) if shapes else None


def _thickness(shape: Mapping[str, Any]) -> float:
    if "radius" in shape:
        return 2.0 * float(shape["radius"])
    return float(
        min(shape["size"]) if "size" in shape else np.ptp(np.array(shape["vertices"]), axis=0).min()
    )


def _of_contacts(table: Table) -> Iterator[Part]:
    """Yield the parts on penetration, on energy in impacts, and on how the runs end."""
    rows = table.records()
    ratio, scene = max(
        (row["most penetration"] / row["thinnest moving shape"], row["scene"])
        for row in rows
        if row["most contacts in one step"]
    )
    deepest, most = _most(rows, "most penetration"), _most(rows, "most rows in one impact")
    yield Part.of(
        "Deepest overlap of bodies",
        f"{deepest['most penetration']:.2f} mm ({deepest['scene']}); at most {ratio:.0%} "
        f"of the thinnest moving shape of its scene ({scene})",
        f"below {DEEP:.0%} of that shape",
        REPRODUCED if ratio < DEEP else MIXED,
    )
    gained = max(table.column(_ADDED))
    yield Part.of(
        f"Largest energy gain in one of {sum(table.column('impacts'))} impacts, which have up to "
        f"{most['most rows in one impact']} rows ({most['scene']})",
        f"{gained:.0e} of the energy exchanged, summed in doubles",
        f"at most {ROUNDING:.0e}",
        REPRODUCED if gained <= ROUNDING else REFUTED,
    )
    complete = sum(not row["how it ends"].startswith(STOPPED) for row in rows)
    yield Part.of(
        "Runs that complete",
        f"{complete} of {len(rows)}",
        "all",
        REPRODUCED if complete == len(rows) else REFUTED,
    )


def _title(name: str) -> str:
    return load_scene(find_scene(name)).title if name in scene_names() else name


def _most(rows: Sequence[Row], key: str) -> Row:
    return max(rows, key=lambda row: float(row[key]))


def book_row(run: Run) -> dict[str, Any]:
    """Return the energy balance of a run with the units in its keys."""
    book = energy_book(run)
    return {"scene": run.scene_name} | {
        f"{key} [{'%' if key in (OPEN_SHARE, GAIN_SHARE) else 'J'}]": value
        for key, value in book.items()
    }


def _of_books(table: Table) -> Part:
    """Return the part on whether the stored energy ever exceeds the energy at the start plus the
    work done."""
    rows = table.records()
    made = sorted(
        (row for row in rows if row[GAIN_SHARE] * row["energy exchanged"] > 100 * rounding_of(row)),
        key=lambda row: float(row[GAIN_SHARE]),
        reverse=True,
    )
    words = ", ".join(f"{row['scene']} {row[GAIN_SHARE]:.1f} %" for row in made)
    return Part.of(
        "The stored energy never exceeds the energy at the start plus the work done on the scene",
        f"holds up to rounding in {len(rows) - len(made)} of {len(rows)} scenes"
        + (
            f". Elsewhere time stepping, not an impact, creates energy: {words} of the energy exchanged"
            if made
            else ""
        ),
        "all scenes",
        MIXED if made else REPRODUCED,
        miss=f"in {len(made)} of {len(rows)} scenes errors of time stepping create energy: the stored energy at some "
        f"instant exceeds that at the start plus the work done ({words} of the energy exchanged)"
        if made
        else "",
    )


def _of_residuals(table: Table) -> Iterator[Part]:
    """Yield the parts on the order of the residuals and on their size. The channels are added by
    size."""
    rows = table.records()
    tried = [row for row in rows if row["order measured"] is not None]
    short = [row for row in tried if not is_first_order(row)]
    orders = sorted(float(row["order measured"]) for row in tried)
    below = ", ".join(f"{row['scene']} ({row['order measured']:.2f})" for row in short)
    yield Part.of(
        "The residual of the energy balance is rounding, or falls as the step is shortened",
        f"rounding in {len(rows) - len(tried)} scenes; order {orders[0]:.2f} to {orders[-1]:.2f} "
        f"(median {float(np.median(orders)):.2f}) in {len(tried)} scenes"
        + (f"; too low: {below}" if short else ""),
        f"order 1, or at most {ORDER_SLACK} less",
        MIXED if short else REPRODUCED,
    )
    wide = sorted(
        (row for row in rows if row[OPEN] > WORTH_NAMING),
        key=lambda row: float(row[OPEN]),
        reverse=True,
    )
    said = ", ".join(f"{row['scene']} {row[OPEN]:.3g} %" for row in wide)
    yield Part.of(
        "Residual at the scene's own time step: the absolute residuals of motion and springs, added",
        f"larger in {len(wide)} of {len(rows)} scenes{said and ': ' + said}",
        f"at most {WORTH_NAMING:.0f} % of the energy exchanged",
        MIXED if wide else REPRODUCED,
        miss=f"in “{_title(wide[0]['scene'])}” the energy errors of the time steps add up to "
        f"{wide[0][OPEN]:.1f} % of the energy exchanged"
        if wide
        else "",
    )


def over_time(run: Run) -> Iterator[Row]:
    """Yield the energies of a run at some instants, with the number of impacts since the previous
    instant."""
    series = energy_series(run)
    shown = np.unique(np.linspace(0, run.steps, INSTANTS + 1).round().astype(int))
    struck = np.histogram(run.impacts.step + 1, [*shown, run.steps + 1])[0]
    for place, impacts in zip(shown, [0, *struck[:-1]], strict=True):
        yield {
            "scene": run.scene_name,
            "time [s]": float(run.time[place]),
            **{f"{name} [J]": float(values[place]) for name, values in series.items()},
            "impacts": int(impacts),
        }


CONTACTS = Check(
    key="contact",
    question="How deep do the bodies overlap, what do the impacts add, and how do the runs end?",
    cases=lambda study: scene_names(),
    row=lambda study, name: contact_row(_run(study, name)),
    says=_of_contacts,
    digits=3,
)
RESIDUALS = Check(
    key="what the books leave open",
    question="Does the residual fall with the step?",
    cases=lambda study: scene_names(),
    says=_of_residuals,
    digits=3,
    row=lambda study, name: open_row(
        study.scene(name),
        lambda scene: study.run(scene, WORLD, keep=False),
        REFINEMENTS[study.depth],
    ),
    note="Residuals of the energy balance: the absolute residuals of motion and springs, added. If a scene has no "
    f"order, its residual is rounding, and no shorter step was tried. The step for a residual of "
    f"{WORTH_NAMING:g} % is "
    "the longest tried step that reaches this residual; if none does, it is extrapolated with the "
    "measured order.",
)
BOOKS = Check(
    key="energy ledger",
    question="Does the stored energy ever exceed the energy at the start plus the work done?",
    cases=lambda study: scene_names(),
    row=lambda study, name: book_row(_run(study, name)),
    says=_of_books,
    digits=3,
    note="Energy at the end − at the start = work of hand and coupling − losses + residual. The residual is energy "
    "that time stepping created (> 0) or lost (< 0). The residual of the motion comes from forces "
    "that are constant "
    "over a step. The residual of the springs has two causes: springs are evaluated once a step, "
    "and at curved shapes "
    "the touching points move along arcs while the step pushes along J Δq (“curved gaps”). "
    "“Residual by size” adds "
    "the absolute residuals of motion and springs. A loss is the sum over steps of a constant "
    "force times a path, so "
    "it can be slightly negative. Percentages are shares of the energy exchanged.",
)
OVER_TIME = Check(
    key="books over time",
    question="Where is the energy at each instant?",
    cases=lambda study: scene_names(),
    row=lambda study, name: over_time(_run(study, name)),
)


def _answer(tables: Mapping[str, Table], parts: Sequence[Part]) -> str:
    contacts, residuals = tables["contact"].records(), tables["what the books leave open"].records()
    deepest, widest = _most(contacts, "most penetration"), _most(residuals, OPEN)
    falls = sum(is_first_order(row) for row in residuals)
    return (
        f"In {len(contacts)} scenes, {sum(row['dimensions'] == 3 for row in contacts)} of them "
        f"three-dimensional, "
        f"bodies overlap by at most {deepest['most penetration']:.2f} mm. The energy errors of "
        f"the time steps add "
        f"up to at most {widest[OPEN]:.1f} % of the energy exchanged "
        f"(“{_title(widest['scene'])}”). In {falls} of "
        f"{len(residuals)} scenes this error is rounding, or falls in proportion to the step "
        "(with an order of 1, or at most 0.25 less)."
    )


scene_ledger = Topic(
    key="scene-ledger",
    title="The scenes",
    question="Every scene file of the project is run in the world IAPB at its own time step. For each run we compute "
    "an energy balance: ideally, the change of stored energy equals the work of hand and coupling "
    "minus the losses. "
    "The difference, the residual, is the error of time stepping. It must fall in proportion to "
    "the step when "
    "the step is shortened. Residuals are shares of the energy exchanged. The residual of the "
    "motion and that of the "
    "contact springs are added by absolute value, so that opposite signs do not cancel.",
    checks=(CONTACTS, RESIDUALS, BOOKS, OVER_TIME),
    says=_answer,
)
