"""Newton's cradle and Bernoulli's three balls: one impact solved with relative rows, per-body rows, or event by event.

Each outcome is labelled with the changes of energy and momentum. All treatments except per-body rows conserve both, but
their outcomes differ nevertheless, because the choice of rows decides the outcome.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from reports.figures.canvas import arrow, note
from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.plot import Plot
from reports.figures.style import FORCE, INK, MUTED, PAPER, STYLES, LineStyle, line_arguments, styled
from reports.figures.svg import to_svg
from verification.table import Table

# start of a treatment's name -> its look
TREATMENTS = {
    "simultaneous, relative": STYLES["relative rows (12)"],
    "simultaneous, per-body": STYLES["per-body rows (13)-(14)"],
    "event-driven": STYLES["event by event"],
}
LEGEND = tuple((look.name, look) for look in TREATMENTS.values())
CRADLE, BERNOULLI = "cradle of 5", "Bernoulli"
ROUNDING = 1e-12  # smaller changes count as none
_RADIUS = 0.5
_ORDERS = {"contact 0, then 1": "the upper ball first", "contact 1, then 0": "the lower ball first"}


class Outcome(NamedTuple):
    """One treatment of one problem: velocities after the impact [m/s], and relative changes of energy and momentum."""

    treatment: str
    rows: str
    velocity: tuple[tuple[float, float], ...]
    energy: float
    momentum: float

    @property
    def look(self) -> LineStyle:
        """Return the colour and marker of the treatment."""
        return next(look for start, look in TREATMENTS.items() if self.treatment.startswith(start))


def outcomes(numbers: Table, problem: str) -> list[Outcome]:
    """Return the outcomes of one problem from the table, which has a row per ball."""
    found: dict[tuple[str, str], list[Any]] = {}
    for row in numbers.where(problem=problem).records():
        found.setdefault((row["treatment"], row["rows or order"]), []).append(row)
    return [Outcome(*names, tuple((r["v_x after"], r["v_y after"]) for r in rows), rows[0]["energy change"],
                    rows[0]["momentum change"]) for names, rows in found.items()]  # fmt: skip


@recipe(
    "linked-impacts", "An impact on touching balls", "mechanics/linked impacts", section="mechanics",
    caption="A ball strikes from the left at 1 m/s, elastically; arrows are velocities after the impact. With relative "
    "rows (12), solved at once or event by event, energy and momentum are conserved, yet the outcomes differ: they "
    "depend on which contacts enter the collision. With per-body rows (13)-(14) the striking ball rebounds as from a "
    "wall and the other balls stay at rest: energy is conserved, momentum is not. The last panel shows cradles of two "
    "to seven balls.",
)  # fmt: skip
def linked_impacts(numbers: Table) -> Drawn:
    """Draw both problems, and the velocity of the last ball of cradles of several lengths."""
    cradle, bernoulli = outcomes(numbers, CRADLE), _without_twins(outcomes(numbers, BERNOULLI))
    panels = (
        Panel(_cradle(cradle), _words(cradle), "Newton's cradle of five: velocities after", wide=True),
        Panel(_bernoulli(bernoulli), _words(bernoulli), "Bernoulli's three balls: velocities after", wide=True),
        Panel(_last_ball(numbers), "Velocity of the last ball of cradles of 2 to 7 balls, by treatment.",
              "Cradles of two to seven balls: what the last ball gets"),
    )  # fmt: skip
    return Drawn(panels, numbers, LEGEND)


def _without_twins(found: Sequence[Outcome]) -> list[Outcome]:
    """Merge outcomes of the same treatment with equal velocities into one, under the names of both row choices."""
    kept: dict[Any, Outcome] = {}
    for outcome in found:
        key = (outcome.treatment, tuple(round(v, 9) + 0.0 for ball in outcome.velocity for v in ball))
        twin = kept.get(key)
        kept[key] = outcome if twin is None else twin._replace(rows=f"{twin.rows.split()[0]} or {outcome.rows}")
    return list(kept.values())


def _cradle(found: Sequence[Outcome]) -> str:
    pitch, step = 1.02, 1.35
    with Plot("linked-impacts-cradle", (8.6, 0.52 * (len(found) + 1) + 0.3), bare=True) as plot:
        axes = plot.axes
        axes.set(xlim=(-8.6, 12.4), ylim=(-step * len(found) + 0.4, 2.5))
        for x, text in ((-8.4, "rows taken, or order"), (9.0, "energy"), (11.0, "momentum")):
            note(axes, (x, 2.2), text, ha="left" if x < 0 else "center", color=MUTED, fontsize=8.5)
        note(axes, (-8.4, step), "before the impact", ha="left")
        before = tuple((1.0 if ball == 0 else 0.0, 0.0) for ball in range(len(found[0].velocity)))
        _balls(axes, [(pitch * k, step) for k in range(len(before))], before, INK, 1.7)
        for number, outcome in enumerate(found):
            y = -step * number
            note(axes, (-8.4, y), _label(outcome), ha="left", color=outcome.look.color)
            _balls(axes, [(pitch * k, y) for k in range(len(before))], outcome.velocity, outcome.look.color, 1.7)
            _kept(axes, (9.0, y), outcome.energy)
            _kept(axes, (11.0, y), outcome.momentum)
    return plot.svg


def _label(outcome: Outcome) -> str:
    if outcome.treatment.startswith("event"):
        return _ORDERS.get(outcome.rows, outcome.rows)
    return f"{outcome.treatment.split(', ')[1].split(' (')[0]}: {outcome.rows}"


def _balls(axes: Any, centers: Sequence[tuple[float, float]], velocities: Sequence[tuple[float, float]], color: str,
           scale: float) -> None:  # fmt: skip
    from matplotlib.patches import Circle

    for center, velocity in zip(centers, velocities, strict=True):
        axes.add_patch(Circle(center, _RADIUS, facecolor=PAPER, edgecolor=MUTED, linewidth=1.0, zorder=2))
        if max(abs(v) for v in velocity) > ROUNDING:
            arrow(axes, center, [scale * v for v in velocity], color=color, width=1.8, head=10.0)


def _kept(axes: Any, place: tuple[float, float], change: float, kept: str = "kept", **how: Any) -> None:
    """Write that a quantity is kept, or its relative change."""
    if abs(change) < ROUNDING:
        note(axes, place, kept, color=INK, **how)
    else:
        what = "momentum " if kept != "kept" else ""
        note(axes, place, f"{what}changed ×{change:.2g}", color=FORCE, fontweight="bold", **how)


def _bernoulli(found: Sequence[Outcome]) -> str:
    half = 0.75**0.5
    centers = ((0.0, 0.0), (2 * _RADIUS * half, _RADIUS), (2 * _RADIUS * half, -_RADIUS))
    with styled() as new_figure:
        drawing = new_figure(figsize=(8.6, 4.3))
        columns = -(-len(found) // 2)
        for number, outcome in enumerate(found):
            row, column = divmod(number, columns)
            axes = drawing.add_axes((column / columns, 0.5 * (1 - row), 1.0 / columns, 0.5))
            axes.set(xlim=(-2.0, 3.2), ylim=(-1.9, 2.1), aspect="equal")
            axes.set_axis_off()
            _balls(axes, centers, outcome.velocity, outcome.look.color, 1.6)
            note(axes, (0.6, 1.65), _label(outcome).replace(": ", ":\n"), color=outcome.look.color, fontsize=8.5)
            _kept(axes, (0.6, -1.6), outcome.momentum, "all kept", fontsize=8.5)
        return to_svg(drawing, "linked-impacts-bernoulli")


def _last_ball(numbers: Table) -> str:
    with Plot("linked-impacts-last") as plot:
        axes = plot.axes
        series: dict[tuple[str, str], list[tuple[int, Outcome]]] = {}
        for problem in dict.fromkeys(numbers.column("problem")):
            for outcome in outcomes(numbers, problem):
                # the LCP is as simultaneous with all rows, per-body with all rows as with the approaching ones
                twin = "LCP" in outcome.rows or "per-body" in outcome.treatment and "all" in outcome.rows
                if problem.startswith("cradle") and not twin:
                    series.setdefault(outcome[:2], []).append((len(outcome.velocity), outcome))
        for (treatment, rows), found in series.items():
            values = [outcome.velocity[-1][0] for _, outcome in found]
            axes.plot([n for n, _ in found], values, **line_arguments(found[0][1].look))
            words = rows.removesuffix(" contacts").removesuffix(" along the row")
            mine = "per-body rows" if "per-body" in treatment else words
            falling = 0.1 < values[-1] < values[0]  # its name stands clear of it below
            lift = (0, -9) if "per-body" in treatment or falling else (0, 8)
            note(axes, (found[-1][0], values[-1]), mine, lift, ha="right", color=found[0][1].look.color, fontsize=8)
        axes.set(xlabel="balls in the cradle", ylabel="velocity of the last ball [m/s]", ylim=(-0.18, 1.2))
    return plot.svg


def _words(found: Sequence[Outcome]) -> str:
    lost = [outcome for outcome in found if abs(outcome.momentum) > ROUNDING]
    return (f"{len(found)} outcomes of one impact; {len(found) - len(lost)} conserve energy and momentum, "
            f"{len(lost)} by per-body rows conserve energy only.")  # fmt: skip
