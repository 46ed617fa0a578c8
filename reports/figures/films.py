"""Films of runs: the four worlds of the corner side by side, and films of single scenes.

Without JavaScript the page shows four moments of a run, in one SVG with the size of the player's picture.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from iapb.run import Run
from reports.figures.corner import UNLIMITED
from reports.figures.figure import Drawn, Panel, Recipe, recipe
from reports.figures.film import SIZE, Film, film, frames
from reports.figures.geometry import Floats, is_spatial
from reports.figures.scenes_space import SIGHTS
from reports.figures.style import FORCE, INK, LINK, MUTED, PEG, RULE, VARIABLES, WALL
from verification.finding import Table, titled

SIGHT = {sight.run: sight for sight in SIGHTS}
MARKS = "Blue dots are contacts; the line at a dot grows with its force; red rays are impulses."


@dataclass(frozen=True)
class Playback:
    """A film: its title, its runs by the label of their panel, and its caption."""

    title: str
    runs: Mapping[str, str]
    see: str
    section: str = "scene-ledger"


FILMS = {
    "film-corner": Playback(
        "The corner, played back", UNLIMITED,
        "The peg of Figure 7 in four worlds, slowed down. In the ideal world impulses stop the peg at the walls. In "
        "IAPB an impulse stops it at each new contact, and the springs then yield slightly. With penalties alone (PB) "
        "a corner penetrates the wall.",
        "hero"),
    "film-hole": Playback(
        "The tight hole, played back", {"IAPB": "hole/IAPB"},
        "The peg is in the hole with little clearance. It touches both sides and the end."),
    "film-two-link-arm": Playback(
        "Two-link arm against an obstacle, played back", {"IAPB": "plane/two_link_arm"},
        "The arm of Figure 2, case A: it turns into the disc at its left and collides once, at the start."),
    "film-cradle": Playback(
        "A row of touching balls, played back", {"IAPB": "plane/cradle"},
        "One ball strikes a row of four with gaps of 1 mm. Each ball passes its momentum on, and the last ball leaves "
        "alone."),
    "film-pushing": Playback(
        "An arm pushes what it holds, played back", {"IAPB": "group/IAPB"},
        "A linkage and free bodies that touch one another form one contact group and resolve an impact together."),
    "film-peg-hole-space": Playback(
        "Peg and plate in space, played back", {"IAPB": "space/peg_hole"},
        "A peg with a collar goes into a square hole among loose boxes and balls."),
    "film-obstacles": Playback(
        "Six-axis arm among obstacles, played back", {"IAPB": "space/arm_obstacles"},
        "The arm meets a post, a knob and a table, and knocks the loose block away."),
    "film-tumbling": Playback(
        "A tumbling body, played back", {"IAPB": "space/tumbling_body"},
        "The body spins about its axis of middle inertia and turns over again and again. Nothing touches it."),
}  # fmt: skip


def recipe_of(key: str) -> Recipe:
    """Return the recipe of one film."""
    shown = FILMS[key]
    made = recipe(key, shown.title, *shown.runs.values(), caption=f"{shown.see} {MARKS}", section=shown.section)
    return made(partial(_film, key))


def _film(key: str, *runs: Run) -> Drawn:
    films = {label: film(run, SIGHT.get(name), runs)
             for (label, name), run in zip(FILMS[key].runs.items(), runs, strict=True)}  # fmt: skip
    times = still_times(next(iter(films.values())))
    panels = tuple(_panel(f"{key}-{k}", label, made, times) for k, (label, made) in enumerate(films.items()))
    return Drawn(panels, _numbers(films))


def _panel(key: str, label: str, made: Film, times: Sequence[float]) -> Panel:
    run = made.run
    alt = f"{run.scene_resolved['title']}, in the world {label}: four moments between 0 and {run.time[-1]:.2f} s."
    return Panel(strip(made, key, times), alt, label, film=made.text)


def _numbers(films: Mapping[str, Film]) -> Table:
    columns = ("world", "simulated [s]", "steps", "moments shown", "contacts", "impacts", "in this page [kB]")
    return titled(columns, tuple(_row(label, made.run, made) for label, made in films.items()), digits=3)


def _row(label: str, run: Run, made: Film) -> tuple[Any, ...]:
    return (label, float(run.time[-1]), run.steps, len(made.steps), len(run.contacts.gap), len(run.impacts.step),
            len(made.text) / 1e3)  # fmt: skip


_CELLS = (2, 2)


def strip(film: Film, key: str, times: Sequence[float]) -> str:
    """Return a film at four `times` [s] as an SVG; each layer is a group whose content the player can replace."""
    steps = np.searchsorted(film.run.time, times).clip(0, film.run.steps)
    cells = [_cell(film, key, int(step), k % _CELLS[0], k // _CELLS[0]) for k, step in enumerate(steps)]
    return (
        f'<svg viewBox="0 0 {SIZE[0]} {SIZE[1]}" xmlns="http://www.w3.org/2000/svg" '
        f'xmlns:xlink="http://www.w3.org/1999/xlink" style="max-width: 620px">'
        f'<defs><path id="{key}-walls" d="{"".join(_ring(film.flat(wall)) for wall in film.parts.walls)}"/></defs>'
        f"{''.join(cells)}</svg>"
    )


def still_times(film: Film) -> tuple[float, ...]:
    """Return four times [s] from start to end, evenly spaced along the path of the bodies rather than in time."""
    steps, count = list(film.steps), _CELLS[0] * _CELLS[1]
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(film.run.q[steps], axis=0), axis=1))])
    between = np.searchsorted(way, np.linspace(0.0, way[-1], count)[1:-1])
    return tuple(float(film.run.time[steps[k]]) for k in (0, *between, -1))


def _cell(film: Film, key: str, step: int, column: int, row: int) -> str:
    width, height = SIZE[0] / _CELLS[0], SIZE[1] / _CELLS[1]
    layers = {"walls": f'<use xlink:href="#{key}-walls"/>', "links": "".join(_links(film, step)),
              "bodies": "".join(bodies_markup(film, step)), "marks": ""}  # fmt: skip
    looks = _looks(is_spatial(film.run.scene_resolved))
    groups = "".join(f'<g data-layer="{name}" {looks[name]}>{inside}</g>' for name, inside in layers.items())
    text = f'font-size="22" font-family="var(--sans, sans-serif)" {_paint("fill", INK)}'
    return (
        f'<svg class="cell" x="{column * width:g}" y="{row * height:g}" width="{width:g}" height="{height:g}" '
        f'viewBox="0 0 {SIZE[0]} {SIZE[1]}"><rect width="100%" height="100%" fill="none" {_paint("stroke", RULE)}/>'
        f'{groups}<text x="10" y="288" {text}>{film.run.time[step]:.2f} s</text></svg>'
    )


def _looks(spatial: bool) -> dict[str, str]:
    """Return the fill and stroke of each layer; walls in space are transparent with edges, planar walls are solid."""
    edge = f'{_paint("stroke", MUTED)} stroke-width="0.8" fill-opacity="0.5"' if spatial else ""
    return {
        "walls": f"{_paint('fill', WALL)} {edge}",
        "links": f'fill="none" {_paint("stroke", LINK)} stroke-width="6" stroke-linecap="round"',
        "bodies": f'{_paint("fill", PEG)} {_paint("stroke", INK)} stroke-width="1.6" stroke-linejoin="round" '
                  'fill-opacity="0.8"',
        "marks": f'fill="none" {_paint("stroke", FORCE)} stroke-width="2"',
    }  # fmt: skip


def _paint(what: str, color: str) -> str:
    return f'{what}="var(--{VARIABLES[color]}, {color})"'


def _ring(points: Floats) -> str:
    return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points) + "z"


def bodies_markup(film: Film, step: int) -> Iterator[str]:
    """Yield the faces and discs of the bodies at a step as SVG, the most distant first."""
    places = frames(film.run.scene_resolved, film.parts.seen, film.run.pose[step])
    drawn: list[tuple[float, str]] = []
    for ring in film.parts.rings:
        corners = places[ring.body].of(ring.corners)
        if ring.flat or _area(corners) > 0.0:
            drawn.append((corners[:, 2].mean(), f'<path d="{_ring(film.flat(corners))}"/>'))
    for ball in film.parts.balls:
        center = places[ball.body].of(ball.center)
        (x, y), r = film.flat(center), film.scale * ball.radius
        drawn.append((center[2], f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{r:.1f}"/>'))
    yield from (markup for _, markup in sorted(drawn, key=lambda piece: piece[0]))


def _area(corners: Floats) -> float:
    """Return twice the area of a ring in the picture; it is positive if the ring is seen from outside."""
    (x, y), (u, v) = corners[:, :2].T, np.roll(corners[:, :2], -1, axis=0).T
    return float(np.sum(x * v - u * y))


def _links(film: Film, step: int) -> Iterator[str]:
    places = frames(film.run.scene_resolved, film.parts.seen, film.run.pose[step])
    for link in film.parts.links:
        ends = film.flat([places[link.first].of(link.start), places[link.second].of(link.end)])
        yield "<path d=\"M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in ends) + '"/>'


RECIPES = tuple(recipe_of(key) for key in FILMS)
