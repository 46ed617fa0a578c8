"""What the books of the scenes say, in sentences made from the records."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from reports.evidence.scenes_tables import YARDSTICK, pace_of
from verification.finding import LIMITED, NOT_COMPUTED, REFUTED, REPRODUCED, Failure, Part, attempt

if TYPE_CHECKING:
    from iapb.run import Run
    from verification.scenes.open_books import OpenBooks
    from verification.scenes.scene_measures import SceneMeasure

DEEP = 0.5  # share of the thinnest moving shape from where a contact would be pushed out on the wrong side
WORTH_NAMING = 0.01  # share of the energy turned over from which open books are named one by one
ROUNDING = 1e-12  # share of the energy turned over: sums of some thousand terms in double precision


def findings_of(
    runs: Sequence[Run], measures: Sequence[SceneMeasure], books: Sequence[OpenBooks],
    failures: list[Failure] | None = None,
) -> tuple[Part, ...]:
    """Return every finding; `failures` receives those that cannot be made, as without the scene that is the unit."""
    judges = {
        "overlap": partial(_penetration, runs, measures), "impacts": partial(_impacts, runs, measures),
        "order": partial(_order, books), "open books": partial(_open, measures), "gains": partial(_gains, measures),
        "endings": partial(_endings, measures), "time": partial(_time, measures),
    }  # fmt: skip
    tried = (attempt(f"sentence on {name}", judge, failures) for name, judge in judges.items())
    return tuple(finding for finding in tried if finding is not None)


def verdict_of(measures: Sequence[SceneMeasure], books: Sequence[OpenBooks]) -> str:
    """Return the sentence of the first page."""
    deepest, widest = _deepest(measures), max(measures, key=lambda m: abs(m.book.open_share))
    falls = sum(each.falls_as_declared for each in books)
    return (
        f"{len(measures)} scenes, {sum(m.dimensions == 3 for m in measures)} of them in space: at most "
        f"{1e3 * deepest.penetration:.2f} mm of overlap; the energy books close to rounding or to the integrator's "
        f"order in {falls}, and leave {abs(widest.book.open_share):.1%} open at worst ({widest.scene})."
    )


def _deepest(measures: Sequence[SceneMeasure]) -> SceneMeasure:
    return max(measures, key=lambda m: m.penetration)


def _penetration(runs: Sequence[Run], measures: Sequence[SceneMeasure]) -> Part:
    touching = [(m, thinnest(run)) for run, m in zip(runs, measures, strict=True) if m.most_contacts]
    m, size = max(touching, key=lambda pair: pair[0].penetration / pair[1])
    deepest, ratio = _deepest(measures), m.penetration / size
    median = float(np.median([each.penetration for each, _ in touching]))
    sentence = (
        f"Bodies overlap by at most {1e3 * deepest.penetration:.2f} mm ({deepest.scene}); the median of the "
        f"{len(touching)} scenes with contacts is {1e3 * median:.2f} mm. "
        f"Measured by the thinnest moving shape of its scene, {m.scene} goes deepest: {ratio:.0%} of it. "
        "Nothing passes through anything."
    )  # fmt: skip
    return Part(sentence if ratio < DEEP else sentence.removesuffix(" Nothing passes through anything."),
                   REPRODUCED if ratio < DEEP else LIMITED)


def thinnest(run: Run) -> float:
    """Return the smallest thickness [m] of a moving shape."""
    shapes = [shape for body in run.scene_resolved["bodies"] for shape in body["shapes"]]
    return min(_thickness(shape) for shape in shapes)


def _thickness(shape: dict[str, object]) -> float:
    if "radius" in shape:
        return 2.0 * float(shape["radius"])  # type: ignore[arg-type]
    if "size" in shape:
        return min(shape["size"])  # type: ignore[call-overload]
    return float(np.ptp(np.array(shape["vertices"]), axis=0).min())


def _impacts(runs: Sequence[Run], measures: Sequence[SceneMeasure]) -> Part:
    gained = max(
        float(-run.impacts.energy_lost.min(initial=0.0)) / m.book.turned_over
        for run, m in zip(runs, measures, strict=True) if m.impacts
    )  # fmt: skip
    most = max(measures, key=lambda m: m.most_rows)
    sentence = (
        f"Of {sum(m.impacts for m in measures)} impacts, with up to {most.most_rows} rows at once ({most.scene}), the "
        f"one that adds most energy adds {gained:.0e} of what its scene turns over: rounding."
    )
    return Part(sentence if gained <= ROUNDING else sentence.removesuffix(": rounding.") + ".",
                   REPRODUCED if gained <= ROUNDING else REFUTED)


def _order(books: Sequence[OpenBooks]) -> Part:
    tried = [each for each in books if each.order is not None]
    short = [each for each in tried if not each.falls_as_declared]
    orders = sorted(float(each.order) for each in tried)  # type: ignore[arg-type]
    sentence = (
        f"What the books leave open is rounding in {len(books) - len(tried)} scenes. In the other {len(tried)} it "
        f"falls as the step is shortened, at measured orders from {orders[0]:.2f} to {orders[-1]:.2f} (median "
        f"{float(np.median(orders)):.2f}); the integrator declares {max(each.declared_order for each in tried)}."
    )
    if short:
        names = ", ".join(f"{each.scene} ({each.order:.2f})" for each in short)
        sentence += f" Below the declared order: {names}."
    return Part(sentence, LIMITED if short else REPRODUCED)


def _open(measures: Sequence[SceneMeasure]) -> Part:
    wide = [m for m in measures if abs(m.book.open_share) > WORTH_NAMING]
    wide.sort(key=lambda m: -abs(m.book.open_share))
    if not wide:
        return Part(f"No books leave more than {WORTH_NAMING:.0%} open at the scene's own step.", REPRODUCED)
    words = ", ".join(f"{m.scene} {m.book.open_share:+.1%}".replace("-", "−") for m in wide)
    sentence = (
        f"At the scene's own step {len(wide)} of {len(measures)} books leave more than {WORTH_NAMING:.0%} of the "
        f"energy turned over open: {words}. Minus is energy swallowed by the steps, plus made up."
    )
    return Part(sentence, LIMITED)


def _gains(measures: Sequence[SceneMeasure]) -> Part:
    made = [m for m in measures if m.book.gain_share > ROUNDING and m.book.largest_gain > _floor(m)]
    made.sort(key=lambda m: -m.book.gain_share)
    words = ", ".join(f"{m.scene} {m.book.gain_share:.1%}" for m in made)
    if not made:
        return Part("No scene ever holds more energy than it started with and was given.", REPRODUCED)
    return Part(
        f"{len(measures) - len(made)} of {len(measures)} scenes never hold more energy than they started with and were "
        f"given. The others do at some time, as a share of what they turn over: {words}. No impact adds it: the steps "
        "in time do.", LIMITED,
    )  # fmt: skip


def _floor(m: SceneMeasure) -> float:
    return ROUNDING * max(abs(m.book.start), abs(m.book.end))


def _endings(measures: Sequence[SceneMeasure]) -> Part:
    ends = Counter(m.ending for m in measures)
    words = "; ".join(f"{count} {_plural(ending, count)}" for ending, count in sorted(ends.items()))
    complete = sum(m.complete for m in measures)
    return Part(f"{complete} of {len(measures)} runs go to their end: {words}.",
                   REPRODUCED if complete == len(measures) else REFUTED)


def _plural(ending: str, count: int) -> str:
    first, _, rest = ending.partition(" ")
    return f"{first.removesuffix('s')} {rest}" if count != 1 else ending


def _time(measures: Sequence[SceneMeasure]) -> Part:
    unit, slow = pace_of(measures), max(measures, key=lambda m: m.seconds_per_step)
    near = min(measures, key=lambda m: m.realtime_factor)
    if unit is None:
        return Part(f"Times are not compared: {YARDSTICK} failed, whose step is the unit.", NOT_COMPUTED, timed=True)
    sentence = (
        f"A step of {slow.scene}, the dearest, takes {slow.seconds_per_step / unit:.0f} times as long as one of "
        f"{YARDSTICK} ({1e6 * unit:.1f} µs on this machine). Nearest to real time is {near.scene}: "
        f"a step is computed {near.realtime_factor:.1f} times as fast as it lasts."
    )
    return Part(sentence, REPRODUCED if near.realtime_factor > 1.0 else LIMITED, timed=True)
