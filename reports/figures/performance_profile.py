"""Dolan and Moré's performance profile: the share of problems that a solver solves within a factor of the fastest."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from reports.figures.energy_gains import plain_powers
from reports.figures.figure import Figure, Panel, Recipe
from reports.figures.style import CYCLE, line_arguments, series_legend, styled
from reports.figures.svg import to_svg
from verification.finding import Table, titled

KEY, TITLE = "performance-profile", "Which solver solves what, and how fast"
INPUT = "complementarity/profile"
COLLECTION, KIND, SOLVER, FACTOR, SHARE = "collection", "kind", "solver", "factor", "share solved"
KINDS = ("frictionless", "friction")
CAPTION = (
    "How high a curve starts: the share of problems on which the solver is the fastest. How high it ends: the "
    "share that it solves at all, by residuals recomputed from the problem; refusals, wrong answers and what was "
    "left out for time count as unsolved. Times are of the solve alone, each solver warmed before: for Siconos "
    "its compiled solve, for the others their call from Python."
)
_SIZE = (4.4, 3.2)


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw a panel for each collection and kind of problem."""
    numbers: Table = inputs[INPUT]
    rows = numbers.records()
    kinds = {kind: _solvers(rows, kind) for kind in KINDS}
    places = dict.fromkeys((row[COLLECTION], row[KIND]) for row in rows)
    panels = tuple(
        Panel(_steps(rows, kinds[kind], (collection, kind)), _words(rows, (collection, kind)), f"{collection}, {kind}")
        for kind in KINDS for collection, found in places if found == kind
    )  # fmt: skip
    legend = tuple(entry for kind in KINDS for entry in series_legend(kinds[kind]))
    return Figure(KEY, "", TITLE, CAPTION, panels, _ends(rows), legend, (INPUT,))


def _solvers(rows: list[dict[str, Any]], kind: str) -> tuple[str, ...]:
    """Solvers of a kind of problem: the two kinds share none, and are numbered apart."""
    return tuple(dict.fromkeys(row[SOLVER] for row in rows if row[KIND] == kind))


def _steps(rows: list[dict[str, Any]], solvers: tuple[str, ...], place: tuple[str, str]) -> str:
    with styled() as new_figure:
        drawing = new_figure(figsize=_SIZE, layout="constrained")
        axes = drawing.add_subplot()
        for number, solver in enumerate(solvers):
            curve = [(row[FACTOR], row[SHARE]) for row in _at(rows, place) if row[SOLVER] == solver]
            if curve:
                look = {**line_arguments(CYCLE[number % len(CYCLE)]), "markevery": (number % 5, 9)}
                axes.step(*zip(*curve, strict=True), where="post", **look)
        axes.set(xscale="log", xlabel="factor of the fastest solver's time", ylabel="share of problems solved")
        plain_powers(axes)
        axes.set_yticks([0.0, 0.25, 0.5, 0.75, 1.0], ["0", "0.25", "0.5", "0.75", "1"])
        axes.set_ylim(-0.02, 1.03)
        return to_svg(drawing, f"{KEY}-{'-'.join(place).replace(' ', '-')}")


def _at(rows: list[dict[str, Any]], place: tuple[str, str]) -> list[dict[str, Any]]:
    return [row for row in rows if (row[COLLECTION], row[KIND]) == place]


def _ends(rows: list[dict[str, Any]]) -> Table:
    """Where each curve starts and ends."""
    curves: dict[tuple[str, str, str], list[float]] = {}
    for row in rows:
        curves.setdefault((row[COLLECTION], row[KIND], row[SOLVER]), []).append(row[SHARE])
    return titled((COLLECTION, KIND, SOLVER, "share as the fastest", "share solved at all"),
                   tuple((*name, shares[0], shares[-1]) for name, shares in curves.items()), 3,
                   timed=("share as the fastest", "share solved at all"))  # fmt: skip


def _words(rows: list[dict[str, Any]], place: tuple[str, str]) -> str:
    last = {row[SOLVER]: row[SHARE] for row in _at(rows, place)}
    return "Shares solved at all: " + ", ".join(f"{solver} {share:.0%}" for solver, share in last.items()) + "."


RECIPE = Recipe(KEY, "", TITLE, (INPUT,), draw, section="complementarity")
