"""What makes energy: our impacts, the printed formula and the scenes, on one axis."""

from __future__ import annotations

from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.plot import Plot, note
from reports.figures.style import BLUE, BOUND, INK, MUTED, VERMILION, line_arguments
from verification.laws.bulk import GAIN, MEDIAN, PRINTED, ours
from verification.scenes.books import OPEN
from verification.scenes.ledger import WORTH_NAMING
from verification.table import Table

ROWS = ("our impacts", "printed formula", "scenes: steps and springs")
_NOTHING = 1e-18  # no gain at all is drawn here: below what double precision can show


@recipe("what-makes-energy", "energy/impacts", "energy/scenes")
def energy(impacts: Table, scenes: Table) -> Drawn:
    """Draw three rows: the gain of each family of our impacts, the gains of the printed formula,
    and what each scene leaves open."""
    told = ours(impacts)
    printed = impacts.where(method=PRINTED).records()[0]
    shares = {row["scene"]: row[OPEN] / 100.0 for row in scenes.records()}
    with Plot("what-makes-energy", (6.2, 2.6)) as plot:
        axes = plot.axes
        found = [max(gain, _NOTHING) for gain in told[GAIN]]
        axes.plot(found, [2.0] * len(found), "o", color=BLUE, markersize=7)
        words = f"none of {sum(told['impacts']):,} gains" if not sum(told["gains"]) else ""
        note(axes, (_NOTHING, 2.0), words, (14, 0), ha="left", color=BLUE)
        axes.plot([printed[MEDIAN], printed[GAIN]], [1.0] * 2, color=VERMILION, linewidth=2.0)
        axes.plot([printed[MEDIAN], printed[GAIN]], [1.0] * 2, "X", color=VERMILION, markersize=7)
        for place, words in (
            (printed[MEDIAN], "median of those that gain"),
            (printed[GAIN], "largest"),
        ):
            note(axes, (place, 1.0), words, (0, 12), fontsize=8.5, color=VERMILION)
        places = [max(share, _NOTHING) for share in shares.values()]
        axes.plot(places, [0.0] * len(places), "|", color=INK, markersize=13, markeredgewidth=1.4)
        axes.axvline(WORTH_NAMING / 100.0, **line_arguments(BOUND, marked=False))
        note(axes, (WORTH_NAMING / 100.0, 2.6), "1 %", (13, 0), fontsize=8.5, color=MUTED)
        plot.log("energy made or lost without a cause, as a share of the energy", "", "x")
        axes.set(ylim=(-0.6, 2.75), xlim=(2e-19, 1e4), yticks=(2.0, 1.0, 0.0), yticklabels=ROWS)
        axes.grid(False, axis="y")
    words = f"{ROWS[0]}: no gain. {ROWS[1]}: up to {printed[GAIN]:.2g}. {ROWS[2]}: up to {max(places):.2g}."
    return Drawn([Panel(plot.svg, words)])
