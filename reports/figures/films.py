"""Runs played back: the four worlds of the corner side by side, and one scene after another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from iapb.run import Run
from reports.figures.figure import Figure, Numbers, Panel, Recipe
from reports.figures.film import Film, film
from reports.figures.filmstrip import still_times, strip
from reports.figures.scenes_space import SIGHTS
from reports.figures.worlds import UNLIMITED

SIGHT = {sight.run: sight for sight in SIGHTS}
MARKS = "Blue dots are contacts, with a line as long as the root of their force; red rays are impulses."


@dataclass(frozen=True)
class Playback:
    """A film's title, the runs in it by the label of their panel, and what to see."""

    title: str
    runs: Mapping[str, str]
    see: str
    section: str = "scene-ledger"


FILMS = {
    "film-corner": Playback(
        "The corner, played back", UNLIMITED,
        "The peg of Figure 7 in four worlds at once, slowed down. The rigid world stops at the walls in blows; IAPB "
        "does so at each new contact, then gives a little; penalties alone let a corner dive into the wall.",
        "figures"),
    "film-hole": Playback(
        "The tight hole, played back", {"IAPB": "hole/IAPB"},
        "The peg is in the hole with little air on either side; it meets both sides and the end."),
    "film-two-link-arm": Playback(
        "Two-link arm against an obstacle, played back", {"IAPB": "plane/two_link_arm"},
        "The arm of Figure 2, case A: it turns into the disc at its left, and is struck once, at the start."),
    "film-cradle": Playback(
        "A row of touching balls, played back", {"IAPB": "plane/cradle"},
        "One ball strikes four that stand 1 mm apart: the blow is handed on, and the last ball leaves alone."),
    "film-pushing": Playback(
        "An arm pushes what it holds, played back", {"IAPB": "group/IAPB"},
        "A linkage and loose bodies that touch one another answer an impact as one group."),
    "film-peg-hole-space": Playback(
        "Peg and plate in space, played back", {"IAPB": "space/peg_hole"},
        "A peg with a collar goes into a square hole among loose boxes and balls."),
    "film-obstacles": Playback(
        "Six-axis arm among obstacles, played back", {"IAPB": "space/arm_obstacles"},
        "The arm meets a post, a knob and a table, and knocks the loose block away."),
    "film-tumbling": Playback(
        "A tumbling body, played back", {"IAPB": "space/tumbling_body"},
        "Spun about its middle axis, it turns over again and again; nothing touches it."),
}  # fmt: skip


def recipe_of(key: str) -> Recipe:
    """Return the recipe of one film."""
    shown = FILMS[key]
    return Recipe(key, "", shown.title, tuple(shown.runs.values()), lambda inputs: _draw(key, inputs), shown.section)


def _draw(key: str, inputs: Mapping[str, Any]) -> Figure:
    shown, names = FILMS[key], FILMS[key].runs
    runs = [inputs[name] for name in names.values()]
    films = {label: film(inputs[name], SIGHT.get(name), runs) for label, name in names.items()}
    times = still_times(next(iter(films.values())))
    panels = tuple(_panel(f"{key}-{k}", label, made, times) for k, (label, made) in enumerate(films.items()))
    return Figure(key, "", shown.title, f"{shown.see} {MARKS}", panels, _numbers(films), (), tuple(names.values()))


def _panel(key: str, label: str, made: Film, times: Sequence[float]) -> Panel:
    run = made.run
    alt = f"{run.scene_resolved['title']}, in the world {label}: four moments between 0 and {run.time[-1]:.2f} s."
    return Panel(strip(made, key, times), alt, label, film=made.text)


def _numbers(films: Mapping[str, Film]) -> Numbers:
    columns = ("world", "simulated [s]", "steps", "moments shown", "contacts", "impacts", "in this page [kB]")
    return Numbers(columns, tuple(_row(label, made.run, made) for label, made in films.items()), digits=3)


def _row(label: str, run: Run, made: Film) -> tuple[Any, ...]:
    return (label, float(run.time[-1]), run.steps, len(made.steps), len(run.contacts.gap), len(run.impacts.step),
            len(made.text) / 1e3)  # fmt: skip


RECIPES = tuple(recipe_of(key) for key in FILMS)
