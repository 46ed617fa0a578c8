"""The project's scenes in the world IAPB: penetration, energy balance, and the energy residual at shorter steps."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from iapb.run import Run
from iapb.scene import find_scene, load_scene, scene_names
from verification.finding import (
    MIXED,
    REFUTED,
    REPRODUCED,
    Failure,
    Finding,
    Part,
    Table,
    attempt,
    finding_of,
    of_each,
    table_of,
    titled,
)
from verification.scenes.energy_books import (
    BOOK,
    GAIN_SHARE,
    OPEN_SHARE,
    ROUNDING,
    OpenBooks,
    energy_book,
    energy_series,
    open_books,
    scene_of,
    total,
)

Measure = Mapping[str, Any]

TITLE = "The scenes"
QUESTION = (
    "Every scene file of the project is run in the world IAPB at its own time step. An energy balance accounts for "
    "each run: the change of stored energy equals the work of hand and coupling minus the losses. The residual is the "
    "error of time stepping; it must fall with the integrator's order when the step is shortened. Residuals are given "
    "as shares of the energy exchanged. The absolute residuals of the motion and of the contact springs are added, so "
    "opposite signs do not cancel."
)
WORLD = "IAPB"
REFINEMENTS = {"quick": (1, 2, 4), "full": (1, 2, 4, 8)}
INSTANTS = 90  # instants of the energy balance over time: as many as a strip of the figure can show

AT_REST = 1e-3  # a scene is at rest if its kinetic energy is below this share of its largest kinetic energy
NEVER_MOVED = 1e-9  # share of the energy exchanged; a smaller kinetic energy is rounding or due to settling springs
LAST_PART = 0.1  # share of the run, at its end, in which the scene must be at rest
RESTS, SETTLES, MOVES, STOPPED = "stays at rest", "comes to rest", "keeps moving", "stopped: "

DEEP = 0.5  # penetration, as a share of the thinnest moving shape, from which contacts push to the wrong side
WORTH_NAMING = 1.0  # [%] of the energy exchanged; scenes with a larger energy residual are listed
WIDE = 2.0  # [%] of the energy exchanged, above which the sentence gives both channels; the table always gives them

CONTACTS = titled((
    "scene", "dimensions", "steps", "step [ms]", "most penetration [mm]", "thinnest moving shape [mm]", "impacts",
    "most rows in one impact", "most energy added by an impact, share of the energy exchanged",
    "most contacts in one step", "how it ends", "energy exchanged [J]",
)).columns
LEDGER = titled(("scene", *BOOK)).columns
_ADDED = "most energy added by an impact, share of the energy exchanged"
_SERIES = ("kinetic", "potential", "springs", "given", "lost_impacts", "lost_damping", "lost_friction")


def scene_ledger(run: Callable[..., Run], depth: str, progress: Callable[[int, int], None]) -> Finding:
    """Run every scene, also at shorter steps, and compute the energy balance of each.

    Parameters
    ----------
    run : (scene, world, keep=True) -> Run; runs that need not be stored use keep=False
    """
    names, failures = scene_names(), list[Failure]()
    done = iter(range(len(names)))

    def studied(name: str) -> Iterator[tuple[Measure, OpenBooks, Table]]:
        progress(next(done), len(names))
        scene = load_scene(find_scene(name))
        found = run(scene, WORLD)
        refined = open_books(scene, lambda shorter: run(shorter, WORLD, keep=False), REFINEMENTS[depth])
        yield measure(found), refined, over_time([found])

    found = list(of_each(names, studied, failures))
    progress(len(names), len(names))
    measures, books, series = (list(part) for part in zip(*found, strict=True)) if found else ([], [], [])
    return finding(measures, books, series, failures)


def finding(
    measures: Sequence[Measure], books: Sequence[OpenBooks], series: Sequence[Table], failures: Sequence[Failure] = ()
) -> Finding:
    """Return the Finding made from these records."""
    judges = {
        "overlap": partial(_penetration, measures), "impacts": partial(_impacts, measures),
        "order": partial(_order, books), "open books": partial(_open, measures, books),
        "gains": partial(_gains, measures), "endings": partial(_endings, measures),
    }  # fmt: skip
    more = list(failures)
    tried = [attempt(f"sentence on {name}", judge, more) for name, judge in judges.items()]
    tables = {"contact": contacts(measures), "energy ledger": ledger(measures),
              "what the books leave open": left_open_table(books),
              "books over time": Table(over_time(()).columns, tuple(row for one in series for row in one.rows))}
    deepest, widest = _deepest(measures), max(measures, key=_open_share)
    answer = (
        f"{len(measures)} scenes, {sum(m['dimensions'] == 3 for m in measures)} of them in space: bodies overlap by at "
        f"most {deepest['most penetration']:.2f} mm. The residual of the energy balance is rounding or falls with the "
        f"integrator's order in {sum(each.falls_as_declared for each in books)} scenes; at the scene's own time step "
        f"it is at most {_open_share(widest):.1f} % of the energy exchanged ({widest['scene']})."
    )
    return finding_of("scene-ledger", TITLE, QUESTION, answer, [one for one in tried if one], tables, more)


def measure(run: Run) -> dict[str, Any]:
    """Return one row of both tables."""
    book = energy_book(run)
    turned = book["energy exchanged"]
    return {
        "scene": run.scene_name, "dimensions": getattr(scene_of(run), "dimensions", 2), "steps": run.steps,
        "step": 1e3 * run.dt, "most penetration": 1e3 * float(np.maximum(-run.contacts.gap, 0.0).max(initial=0.0)),
        "thinnest moving shape": thinnest(run), "impacts": len(run.impacts.step),
        "most rows in one impact": int(run.impacts.rows.max(initial=0)),
        _ADDED: float(-run.impacts.energy_lost.min(initial=0.0)) / turned if turned else 0.0,
        "most contacts in one step": int(np.diff(run.contacts.offsets).max(initial=0)),
        "how it ends": ending(run, turned), **book,
    }  # fmt: skip


def ending(run: Run, turned: float) -> str:
    """Return in words whether the scene rests or moves in the last tenth of the run, or why the run stopped."""
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
    return float(min(shape["size"]) if "size" in shape else np.ptp(np.array(shape["vertices"]), axis=0).min())


def contacts(measures: Sequence[Measure]) -> Table:
    """Return the table of penetrations, numbers of collisions, and final states."""
    return table_of(CONTACTS, measures, digits=3)


def ledger(measures: Sequence[Measure]) -> Table:
    """Return the table with the energy balance of each run."""
    note = (
        "End − start = work of hand and coupling − losses + residual. The residual is energy that time stepping "
        "created (> 0) or lost (< 0). Its part in the motion comes from forces held constant over a step, its part in "
        "the springs from evaluating them once a step; the share adds both absolute values. A loss is also a force "
        "times a path with the force held over each step, so it can come out slightly negative. Shares are of the "
        "energy exchanged: the largest of kinetic energy, range of the potential energy, work of the "
        "hand and work of the coupling."
    )
    return table_of(LEDGER, measures, digits=3, note=note)


def left_open_table(books: Sequence[OpenBooks]) -> Table:
    """Return the energy residuals at decreasing steps, their order, and the step at which they fall to WORTH_NAMING."""
    refinements: tuple[int, ...] = max((each.refinements for each in books), key=len, default=())
    headings = ["residual at the scene's step [%]" if k == 1 else f"at 1/{k} of this step [%]" for k in refinements]
    rows = [
        (each.scene, *(100 * value for value in each.open_shares),
         *(None,) * (len(refinements) - len(each.open_shares)), each.declared_order, each.order, 1e3 * each.step,
         _milliseconds(each))
        for each in books
    ]  # fmt: skip
    note = ("Residuals of the energy balance, absolute values of motion and springs added. No order: the residual "
            f"is rounding, and no shorter step was tried. The step for a residual of {WORTH_NAMING:g} % is the longest "
            "one tried that reaches it, or is extrapolated with the measured order.")
    columns = ("scene", *headings, "order declared", "order measured", "the scene's step [ms]",
               f"step for a residual of {WORTH_NAMING:g} % [ms]")  # fmt: skip
    return titled(columns, rows, digits=3, note=note)


def _milliseconds(books: OpenBooks) -> float | None:
    step = books.step_for(WORTH_NAMING / 100)
    return None if step is None else 1e3 * step


def over_time(runs: Sequence[Run]) -> Table:
    """Return the energies of each run at some instants, with the number of impacts since the previous instant."""
    rows: list[tuple[object, ...]] = []
    for run in runs:
        series = energy_series(run)
        shown = np.unique(np.linspace(0, run.steps, INSTANTS + 1).round().astype(int))
        struck = np.histogram(run.impacts.step + 1, [*shown, run.steps + 1])[0]
        for place, impacts in zip(shown, [0, *struck[:-1]], strict=True):
            values = (float(getattr(series, name)[place]) for name in _SERIES)
            rows.append((run.scene_name, float(run.time[place]), *values, int(impacts)))
    return titled(("scene", "time [s]", *(f"{name.replace('_', ' ')} [J]" for name in _SERIES), "impacts"), rows)


def _deepest(measures: Sequence[Measure]) -> Measure:
    return max(measures, key=lambda m: float(m["most penetration"]))


def _open_share(m: Measure) -> float:
    return float(m[OPEN_SHARE])


def _penetration(measures: Sequence[Measure]) -> Part:
    touching = [m for m in measures if m["most contacts in one step"]]
    ratio, scene = max((m["most penetration"] / m["thinnest moving shape"], m["scene"]) for m in touching)
    median, deepest = float(np.median([m["most penetration"] for m in touching])), _deepest(measures)
    passes = "" if ratio >= DEEP else " Nothing passes through anything."
    return Part(
        f"Bodies overlap by at most {deepest['most penetration']:.2f} mm ({deepest['scene']}); the median of the "
        f"{len(touching)} scenes with contacts is {median:.2f} mm. Relative to the thinnest moving shape of the scene, "
        f"the deepest overlap is {ratio:.0%} ({scene}).{passes}",
        REPRODUCED if ratio < DEEP else MIXED,
    )  # fmt: skip


def _impacts(measures: Sequence[Measure]) -> Part:
    gained, most = max(m[_ADDED] for m in measures), max(measures, key=lambda m: int(m["most rows in one impact"]))
    rounding = gained <= ROUNDING
    return Part(
        f"In {sum(m['impacts'] for m in measures)} impacts of the scenes as their files are, with up to "
        f"{most['most rows in one impact']} rows at once ({most['scene']}), the largest energy gain, summed in "
        f"doubles, is {gained:.0e} of the energy exchanged"
        + (", the rounding of that sum." if rounding else "."),
        REPRODUCED if rounding else REFUTED)  # fmt: skip


def _order(books: Sequence[OpenBooks]) -> Part:
    tried = [each for each in books if each.order is not None]
    short = [each for each in tried if not each.falls_as_declared]
    orders = sorted(float(each.order) for each in tried)  # type: ignore[arg-type]
    below = ", ".join(f"{each.scene} ({each.order:.2f})" for each in short)
    return Part(
        f"The residual of the energy balance is rounding in {len(books) - len(tried)} scenes. In the other "
        f"{len(tried)} it falls as the step is shortened, with measured orders from {orders[0]:.2f} to "
        f"{orders[-1]:.2f} (median {float(np.median(orders)):.2f}); the integrator declares order "
        f"{max(each.declared_order for each in tried)}."
        + (f" Below the declared order: {below}." if short else ""), MIXED if short else REPRODUCED)  # fmt: skip


def _open(measures: Sequence[Measure], books: Sequence[OpenBooks]) -> Part:
    """Return the part on energy residuals. It adds the sizes of both channels, because opposite signs would cancel."""
    wide = sorted((m for m in measures if _open_share(m) > WORTH_NAMING), key=_open_share, reverse=True)
    if not wide:
        return Part(f"No residual exceeds {WORTH_NAMING:.0f} % of the energy exchanged at the scene's own time step.",
                    REPRODUCED)  # fmt: skip
    of = {each.scene: each for each in books}
    said = "; ".join(
        f"{m['scene']} {_open_share(m):.1f} % of {m['energy exchanged']:.3g} J "
        f"({_channels(m)}{_gone(of[m['scene']])})" for m in wide
    )  # fmt: skip
    return Part(
        f"At the scene's own time step the residual exceeds {WORTH_NAMING:.0f} % of the energy exchanged in "
        f"{len(wide)} of {len(measures)} scenes (absolute values of motion and springs added): {said}.", MIXED,
        miss=f"time stepping leaves up to {_open_share(wide[0]):.1f} % of a scene's energy unaccounted for "
             f"({wide[0]['scene']})",
    )  # fmt: skip


def _channels(m: Measure) -> str:
    """Return both channels of a large energy residual in words, in joules with their signs; "" for a small one."""
    if _open_share(m) <= WIDE:
        return ""
    found = ((name, float(m[f"residual: {name}"])) for name in ("motion", "springs"))
    words = (f"{name} {abs(value):.2g} J {'created' if value > 0 else 'lost'}" for name, value in found)
    return f"{', '.join(words)}; "


def _gone(books: OpenBooks) -> str:
    step = _milliseconds(books)
    if step is None or books.order is None:
        return "the residual does not fall with the step"
    tried = min(books.open_shares) <= WORTH_NAMING / 100
    return (f"order {books.order:.2f}, {'below' if tried else 'extrapolated to'} {WORTH_NAMING:.0f} % at {step:.2g} ms "
            f"instead of {1e3 * books.step:.3g} ms")  # fmt: skip


def _gains(measures: Sequence[Measure]) -> Part:
    made = sorted((m for m in measures if m[GAIN_SHARE] > 100 * max(ROUNDING, _floor(m))),
                  key=lambda m: float(m[GAIN_SHARE]), reverse=True)  # fmt: skip
    if not made:
        return Part("In no scene does the stored energy ever exceed the energy at the start plus the work done on it.",
                    REPRODUCED)  # fmt: skip
    words = ", ".join(f"{m['scene']} {m[GAIN_SHARE]:.1f} %" for m in made)
    return Part(
        f"In {len(measures) - len(made)} of {len(measures)} scenes the stored energy never exceeds the energy at the "
        f"start plus the work done on the scene. In the others it does at some instant, by these shares of the energy "
        f"exchanged: {words}. Time stepping creates this energy, not the impacts.", MIXED,
    )  # fmt: skip


def _floor(m: Measure) -> float:
    """Return the rounding error of the total energy as a share of the energy exchanged."""
    held = max(abs(total(m, "start")), abs(total(m, "end")))
    return ROUNDING * held / m["energy exchanged"] if m["energy exchanged"] else np.inf


def _endings(measures: Sequence[Measure]) -> Part:
    ends = Counter(m["how it ends"] for m in measures)
    words = "; ".join(f"{count} {_plural(ending, count)}" for ending, count in sorted(ends.items()))
    complete = sum(not m["how it ends"].startswith(STOPPED) for m in measures)
    return Part(f"{complete} of {len(measures)} runs complete: {words}.",
                REPRODUCED if complete == len(measures) else REFUTED)  # fmt: skip


def _plural(ending: str, count: int) -> str:
    first, _, rest = ending.partition(" ")
    return f"{first.removesuffix('s')} {rest}" if count != 1 else ending
