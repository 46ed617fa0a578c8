"""Check of the mechanics: impacts of touching balls.

The outcomes of the impacts are labelled with the changes of energy and momentum. All treatments
except per-body rows conserve both, but their outcomes differ nevertheless, because the choice of
rows decides the outcome.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.plot import Plot, arrow, note
from reports.figures.style import FORCE, INK, MUTED, PAPER, STYLES, LineStyle
from verification.table import Table

# start of a treatment's name -> its look
TREATMENTS = {
    "simultaneous, relative": STYLES["relative rows (12)"],
    "simultaneous, per-body": STYLES["per-body rows (13)-(14)"],
    "event-driven": STYLES["event by event"],
}
CRADLE, BERNOULLI = "cradle of 5", "Bernoulli"
ROUNDING = 1e-12  # smaller changes count as none
_ORDERS = {"contact 0, then 1": "the upper ball first", "contact 1, then 0": "the lower ball first"}


class Outcome(NamedTuple):
    """One treatment of one problem: velocities after the impact [m/s], and relative changes of
    energy and momentum."""

    treatment: str
    rows: str
    velocity: tuple[tuple[float, float], ...]
    energy: float
    momentum: float

    @property
    def look(self) -> LineStyle:
        """Return the colour and marker of the treatment."""
        return next(look for start, look in TREATMENTS.items() if self.treatment.startswith(start))

    @property
    def label(self) -> str:
        """Return the name of the treatment in a picture."""
        if self.treatment.startswith("event"):
            return _ORDERS.get(self.rows, self.rows)
        return f"{self.treatment.split(', ')[1].split(' (')[0]}:\n{self.rows}"


def outcomes(numbers: Table, problem: str) -> list[Outcome]:
    """Return the outcomes of one problem from the table, which has a row per ball."""
    found: dict[tuple[str, str], list[Any]] = {}
    for row in numbers.where(problem=problem).records():
        found.setdefault((row["treatment"], row["rows or order"]), []).append(row)
    return [
        Outcome(
            *names,
            tuple((r["v_x after"], r["v_y after"]) for r in rows),
            rows[0]["energy change"],
            rows[0]["momentum change"],
        )
        for names, rows in found.items()
    ]


@recipe("linked-impacts", "mechanics/linked impacts")
def linked_impacts(numbers: Table) -> Drawn:
    """Draw both problems, and the velocity of the last ball of cradles of several lengths."""
    panels = []
    for problem, title in (
        (CRADLE, "Newton's cradle of five"),
        (BERNOULLI, "Bernoulli's three balls"),
    ):
        found: dict[Any, Outcome] = {}
        for outcome in outcomes(
            numbers, problem
        ):  # one picture of a treatment and its velocities for both choices
            key = (
                outcome.treatment,
                tuple(round(v, 9) + 0.0 for ball in outcome.velocity for v in ball),
            )
            rows = (
                f"{found[key].rows.split()[0]} or {outcome.rows}" if key in found else outcome.rows
            )
            found[key] = outcome._replace(rows=rows)
        lost = sum(abs(outcome.momentum) > ROUNDING for outcome in found.values())
        words = (
            f"{len(found)} outcomes of one impact; {len(found) - lost} conserve energy and "
            f"momentum, {lost} by "
            "per-body rows conserve energy only."
        )
        panels.append(
            Panel(
                _balls(problem, list(found.values())),
                words,
                f"{title}: velocities after",
                wide=True,
            )
        )
    panels.append(
        Panel(
            _last_ball(numbers),
            "Velocity of the last ball of cradles of 2 to 7 balls, by treatment.",
            "Cradles of two to seven balls: what the last ball gets",
        )
    )
    return Drawn(panels, numbers, {look.name: look for look in TREATMENTS.values()})


# problem -> places of its balls, width and height of a picture (in radii, about the first ball),
# pictures in a row
_PLACES = {
    CRADLE: ([(k, 0.0) for k in range(5)], (-1.6, 6.2), (-1.5, 1.6), 3),
    BERNOULLI: ([(0.0, 0.0), (0.75**0.5, 0.5), (0.75**0.5, -0.5)], (-2.0, 3.2), (-1.9, 2.1), 4),
}


def _balls(problem: str, found: Sequence[Outcome]) -> str:
    """Draw the balls of each outcome with their velocities, its name above, and what it changes
    below."""
    from matplotlib.patches import Circle

    centers, across, up, columns = _PLACES[problem]
    rows = -(-len(found) // columns)
    height = 8.6 / columns * (up[1] - up[0]) / (across[1] - across[0])
    frames = [
        (k % columns / columns, 1 - (1 + k // columns) / rows, 1 / columns, 1 / rows)
        for k in range(len(found))
    ]
    with Plot(
        f"linked-impacts-{problem.split()[0].lower()}",
        (8.6, height * rows),
        bare=True,
        frames=frames,
    ) as plot:
        for axes, outcome in zip(plot.each, found, strict=True):
            axes.set(xlim=across, ylim=up)
            color, middle = outcome.look.color, sum(across) / 2
            for center, velocity in zip(centers, outcome.velocity, strict=True):
                axes.add_patch(
                    Circle(center, 0.5, facecolor=PAPER, edgecolor=MUTED, linewidth=1.0, zorder=2)
                )
                if max(abs(v) for v in velocity) > ROUNDING:
                    arrow(
                        axes, center, [1.6 * v for v in velocity], color=color, width=1.8, head=10.0
                    )
            note(axes, (middle, up[1] - 0.45), outcome.label, color=color, fontsize=8.5)
            changed = [
                f"{name} changed ×{change:.2g}"
                for name, change in zip(("energy", "momentum"), outcome[3:], strict=True)
                if abs(change) >= ROUNDING
            ]
            note(
                axes,
                (middle, up[0] + 0.3),
                ", ".join(changed) or "all kept",
                color=FORCE if changed else INK,
                fontsize=8.5,
                fontweight="bold" if changed else "normal",
            )
    return plot.svg


def _last_ball(numbers: Table) -> str:
    series: dict[tuple[str, str], list[Outcome]] = {}
    for problem in dict.fromkeys(numbers.column("problem")):
        for outcome in outcomes(numbers, problem) if problem.startswith("cradle") else ():
            # the LCP is as simultaneous with all rows, per-body with all rows as with the
            # approaching ones
            if "LCP" not in outcome.rows and not (
                "per-body" in outcome.treatment and "all" in outcome.rows
            ):
                series.setdefault(outcome[:2], []).append(outcome)
    with Plot("linked-impacts-last") as plot:
        for (treatment, rows), found in series.items():
            look, values = found[0].look, [outcome.velocity[-1][0] for outcome in found]
            words = rows.removesuffix(" contacts").removesuffix(" along the row")
            name = "per-body rows" if "per-body" in treatment else words
            mine = replace(look, name=name, filled=name != "approaching")
            plot.words[name] = ""
            plot.curve(zip([len(outcome.velocity) for outcome in found], values, strict=True), mine)
        plot.axes.set(
            xlabel="balls in the cradle",
            ylabel="velocity of the last ball [m/s]",
            ylim=(-0.18, 1.2),
        )
    return plot.svg
