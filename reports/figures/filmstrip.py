"""Still pictures of a film: a few moments of a run, in one SVG of the size of the player's picture."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from reports.figures.film import SIZE, Film
from reports.figures.film_parts import frames, is_spatial
from reports.figures.spatial import Floats
from reports.figures.style import FORCE, INK, LINK, MUTED, PEG, RULE, VARIABLES, WALL

_CELLS = (2, 2)


def strip(film: Film, key: str, times: Sequence[float]) -> str:
    """Return a film at four `times` [s], in rows; each layer is a group that the player can fill anew."""
    steps = np.searchsorted(film.run.time, times).clip(0, film.run.steps)
    cells = [_cell(film, key, int(step), k % _CELLS[0], k // _CELLS[0]) for k, step in enumerate(steps)]
    return (
        f'<svg viewBox="0 0 {SIZE[0]} {SIZE[1]}" xmlns="http://www.w3.org/2000/svg" '
        f'xmlns:xlink="http://www.w3.org/1999/xlink" style="max-width: 620px">'
        f'<defs><path id="{key}-walls" d="{"".join(_ring(film.flat(wall)) for wall in film.parts.walls)}"/></defs>'
        f"{''.join(cells)}</svg>"
    )


def still_times(film: Film) -> tuple[float, ...]:
    """Return four times [s] from start to end, even along the way of the bodies rather than in time."""
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
    """Return the paint of each layer. Walls in space are see-through and have edges; those in the plane are one."""
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
    """Yield the faces and discs of the bodies at a step as SVG, the farthest first."""
    places = frames(film.run.scene_resolved, film.parts.seen, film.run.q[step])
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
    """Return twice the area of a ring in the picture, positive where it is seen from outside."""
    (x, y), (u, v) = corners[:, :2].T, np.roll(corners[:, :2], -1, axis=0).T
    return float(np.sum(x * v - u * y))


def _links(film: Film, step: int) -> Iterator[str]:
    places = frames(film.run.scene_resolved, film.parts.seen, film.run.q[step])
    for link in film.parts.links:
        ends = film.flat([places[link.first].of(link.start), places[link.second].of(link.end)])
        yield "<path d=\"M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in ends) + '"/>'
