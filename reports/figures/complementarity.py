"""IAPB against complementarity: where their motions agree, and when every impulse pushes."""

from __future__ import annotations

from typing import Any

from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.plot import Plot, note
from reports.figures.style import (
    BLUE,
    BOUND,
    INK,
    MUTED,
    OUTCOMES,
    PAPER,
    VERMILION,
    line_arguments,
    looks_of,
)
from verification.table import Table

Rows = list[dict[str, Any]]

_BORDER = ("cosine", "speed ratio", "agreement predicted", "agreement found")
_SIZES = {0.0: 3.4, 0.5: 4.6, 1.0: 5.8}  # marker by restitution


@recipe("agreement-map", "complementarity/map", "complementarity/two contacts")
def agreement_map(numbers: Table, border: Table) -> Drawn:
    """Draw the share of impacts that agree, the distance in the other impacts, and the border r = c
    of two contacts."""
    rows = [row for row in numbers.records() if not row["impacts"].startswith("scene ")]
    kinds: dict[str, Rows] = {}
    for row in rows:
        kinds.setdefault(f"{row['impacts']}, {row['redundant rows']}", []).append(row)
    size = (4.6, 0.24 * len(kinds) + 0.7)
    with (
        Plot("agreement-map-share", size) as shares,
        Plot("agreement-map-distance", size) as distances,
    ):
        for y, members in enumerate(kinds.values()):
            found = [row["share that agrees"] for row in members]
            shares.axes.barh(y, 1.0, height=0.62, color=VERMILION, alpha=0.18, linewidth=0)
            shares.axes.barh(y, sum(found) / len(found), height=0.62, color=BLUE, linewidth=0)
            shares.axes.plot(found, [y] * len(found), "|", color=INK, markersize=7)
            apart = [row for row in members if row["median distance where they differ"] is not None]
            if not apart:
                distances.axes.plot(
                    0.0, y, "o", markersize=4, markerfacecolor=PAPER, markeredgecolor=MUTED
                )
            for row in apart:
                typical, shift = (
                    row["median distance where they differ"],
                    y + 0.22 * (2.0 * row["e"] - 1.0),
                )
                distances.axes.plot(
                    [typical, row["largest distance"]], [shift] * 2, color=VERMILION, linewidth=1.1
                )
                distances.axes.plot(
                    typical,
                    shift,
                    "X",
                    color=VERMILION,
                    markeredgecolor=PAPER,
                    markeredgewidth=0.4,
                    markersize=_SIZES.get(row["e"], 4.6),
                )
        for plot in (shares, distances):
            plot.axes.set_yticks(range(len(kinds)), list(kinds))
            plot.axes.set_ylim(len(kinds) - 0.5, -0.5)
            plot.axes.grid(False, axis="y")
        shares.axes.set(xlim=(0.0, 1.005), xlabel="share of impacts with one motion")
        distances.axes.set(xlim=(-0.03, 2.05), xlabel="distance of v⁺, of |v⁻| (ring: none differ)")
    with Plot("agreement-map-border", (4.1, 3.4)) as plot:
        plot.curve([(0.0, 0.0), (1.0, 1.0)], BOUND, marked=False)
        for cosine, ratio, predicted, agrees in border.select(_BORDER).rows:
            plot.axes.plot(
                cosine,
                ratio,
                "o" if agrees else "x",
                color=BLUE if agrees else VERMILION,
                markersize=6,
                markeredgewidth=1.4,
            )
            if predicted != agrees:
                plot.axes.plot(
                    cosine, ratio, "s", markersize=12, markerfacecolor="none", markeredgecolor=INK
                )
        plot.axes.set(
            xlim=(-1.02, 1.02),
            ylim=(0.0, 1.06),
            xlabel="cosine c of the two rows",
            ylabel="speed ratio r",
        )
    whole = sorted(
        {row["impacts"] for row in rows}
        - {row["impacts"] for row in rows if row["share that agrees"] < 1}
    )
    right = sum(predicted == agrees for predicted, agrees in border.select(_BORDER[2:]).rows)
    panels = (
        Panel(
            shares.svg,
            f"Shares of impacts with one motion, by kind; all of them for {', '.join(whole)}.",
            "share of impacts that agree",
        ),
        Panel(distances.svg, "Distances of the motions, by kind.", "distance where they differ"),
        Panel(
            plot.svg,
            f"Agreement of two contacts is as predicted by r >= c at {right} of {len(border.rows)} points.",
            "two contacts",
        ),
    )
    return Drawn(
        panels, numbers, {"agree": OUTCOMES["holds"], "differ": OUTCOMES["fails"], "r = c": BOUND}
    )


_COUNTS = (5, 10, 20, 50, 100, 200)  # ticks


@recipe("where-to-stop", "complementarity/piles")
def where_to_stop(numbers: Table) -> Drawn:
    """Draw over the contacts how often (21) is right, and how many of its impulses pull."""
    rows = numbers.records()
    looks = looks_of(f"(21) for all {given} contacts" for given in numbers.column("rows"))
    limit = max(row["most contacts that agree"] for row in rows)
    wrong = min(
        (row["contacts"] for row in rows if row["share that agrees"] < 1.0), default=limit + 1
    )
    prices = [row["time of pushing"] / row["time of (21)"] for row in rows]
    panels = list[Panel]()
    for key, alt, label, axis in (
        (
            "share that agrees",
            f"No pile of more than {limit} contacts agrees.",
            "how often (21) agrees with complementarity",
            "piles that agree [%]",
        ),
        (
            "share of impulses that pull",
            "Share of impulses that pull over contacts.",
            "impulses of (21) that pull",
            "impulses that pull [%]",
        ),
    ):
        with Plot(f"where-to-stop-{key.split()[-1]}") as plot:
            for name, look in looks.items():
                plot.marks(
                    [
                        (row["contacts"], 100.0 * row[key])
                        for row in rows
                        if f" {row['rows']} " in name
                    ],
                    look,
                )
            plot.axes.axvline(limit, **line_arguments(BOUND, marked=False))
            words = f"{limit}: the largest that ever agreed" if not panels else ""
            note(
                plot.axes,
                (limit, 0.97),
                words,
                (4, 0),
                ha="left",
                va="top",
                xycoords=plot.axes.get_xaxis_transform(),
            )
            plot.axes.set(xlabel="contacts at once", ylabel=axis, xscale="log", ylim=(-4.0, None))
            plot.axes.set_xticks(_COUNTS, [str(count) for count in _COUNTS])
            plot.axes.minorticks_off()
        panels.append(Panel(plot.svg, alt, label))
    return Drawn(
        panels,
        numbers,
        looks,
        {
            "limit": limit,
            "wrong": f"{wrong:.0f}",
            "pushed": max(row["pushing from the LCP"] for row in rows),
            "least": f"{min(prices):.2g}",
            "most": f"{max(prices):.2g}",
        },
    )
