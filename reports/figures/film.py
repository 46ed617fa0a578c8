"""Films of planar runs: animated SVG that the browser plays; the page's script adds a slider.

Each body is a group whose place and angle follow the poses of a run (`animateTransform`) at a few hundred moments. The
moments are evenly spaced in time; those around the first impacts are added. Contacts and impulses are marks that are
visible from one moment to the next. A picture has SIZE units, y down.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from iapb.run import Run
from reports.figures.canvas import is_turned, widened
from reports.figures.corner import UNLIMITED
from reports.figures.figure import Drawn, Panel, Recipe, recipe
from reports.figures.geometry import Floats, body_outlines, half_plane, outline
from reports.figures.style import BLUE, FORCE, INK, PEG, WALL, css
from verification.table import titled

SIZE = (400, 300)
_MOMENTS, _IMPACTS, _MARKED = 160, 30, 60  # moments of a film, first impacts that it adds, moments with marks
_MARGIN = 0.08  # of the picture
_REACH = 50.0  # the side of a half-plane that is drawn, in sizes of the bodies
_LASTS, _SLOWER = 5.0, (1, 2, 5, 10, 20, 50)  # seconds that a film takes at least; how much slower it can be
_BEFORE = 0.03  # a film begins so long before the first contact [s]
_STRONGEST = 12  # contacts marked at a moment
MARKS = "Blue dots are contacts; the line at a dot grows with its force; red crosses are impulses."


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
}  # fmt: skip


def recipe_of(key: str) -> Recipe:
    """Return the recipe of one film."""
    shown = FILMS[key]
    made = recipe(key, shown.title, *shown.runs.values(), caption=f"{shown.see} {MARKS}", section=shown.section)
    return made(partial(_film, key))


def _film(key: str, *runs: Run) -> Drawn:
    """Draw the runs of a film side by side, at the same scale and speed."""
    end = max(float(run.time[-1]) for run in runs)
    slower = next((each for each in _SLOWER if each * end >= _LASTS), _SLOWER[-1])
    low, high = _bounds(runs)
    touching = [run.time[np.flatnonzero(np.diff(run.contacts.offsets))[0]] for run in runs if len(run.contacts.gap)]
    start = max(min(touching, default=0.0) - _BEFORE, 0.0)
    head = f'data-duration="{end:g}" data-slower="{slower}" data-start="{start:.4g}"'
    panels, rows = [], []
    for label, run in zip(FILMS[key].runs, runs, strict=True):
        film = Film(run, low, SIZE[0] / float(high[0] - low[0]), end, slower)
        alt = f"{run.scene_resolved['title']}, in the world {label}: a film of {end:.2f} s, {slower} times slower."
        svg = (f'<svg viewBox="0 0 {SIZE[0]} {SIZE[1]}" xmlns="http://www.w3.org/2000/svg" {head} '
               f'style="max-width: 620px">{film.walls()}{"".join(film.bodies())}{"".join(film.marks())}</svg>')
        panels.append(Panel(svg, alt, label, film=True))
        rows.append((label, float(run.time[-1]), run.steps, len(run.contacts.gap), len(run.impacts.step)))
    return Drawn(tuple(panels), titled(("world", "simulated [s]", "steps", "contacts", "impacts"), rows, digits=3))


def _bounds(runs: Sequence[Run]) -> tuple[Floats, Floats]:
    """Return the corners [m] of a picture that contains all bodies at all times, turned as the scene's drawing is."""
    points = [corners for run in runs for step in moments(run, _MARKED)
              for _, corners in body_outlines(run.scene_resolved, run.pose[step])]
    every = _sign(runs[0]) * np.vstack(points)
    low, high = every.min(axis=0), every.max(axis=0)
    margin = _MARGIN * max(high - low)
    return widened(low - margin, high + margin, SIZE[0] / SIZE[1])


def _sign(run: Run) -> float:
    return -1.0 if is_turned(run.scene_resolved) else 1.0


def moments(run: Run, count: int) -> Floats:
    """Return steps that are evenly spaced in time, and the steps around the first impacts."""
    even = np.linspace(0, run.steps, min(count, run.steps + 1)).round().astype(int)
    struck = np.unique(run.impacts.step)[:_IMPACTS]
    found = np.unique(np.concatenate([even, struck, struck + 1]))
    return found[found <= run.steps]


@dataclass(frozen=True)
class Film:
    """The SVG of one run: `corner` (2,) [m] is the picture's lower left, `scale` is in units per metre."""

    run: Run
    corner: Floats
    scale: float
    end: float
    slower: int

    def flat(self, points: Any) -> Floats:
        """Return the picture coordinates of points (..., 2) [m]."""
        x, y = np.moveaxis(_sign(self.run) * np.asarray(points, dtype=float)[..., :2] - self.corner, -1, 0)
        return np.stack([self.scale * x, SIZE[1] - self.scale * y], axis=-1)

    def walls(self) -> str:
        """Return the static world."""
        scene = self.run.scene_resolved
        reach = _REACH * float(max(np.ptp(np.vstack([corners for _, corners in body_outlines(scene)]), axis=0)))
        rings = [half_plane(wall, reach) if wall["kind"] == "half_plane" else outline(wall) for wall in scene["walls"]]
        return f'<path fill="{css(WALL)}" d="{"".join(_ring(self.flat(ring)) for ring in rings)}"/>'

    def bodies(self) -> Iterator[str]:
        """Yield the bodies; a circle has a spoke that shows how it turns."""
        steps = moments(self.run, _MOMENTS)
        times = self._times(steps)
        own = self.scale * _sign(self.run) * np.array([1.0, -1.0])
        look = f'fill="{css(PEG)}" stroke="{css(INK)}" stroke-width="1.6" fill-opacity="0.8"'
        for k, body in enumerate(self.run.scene_resolved["bodies"]):
            rings = [own * outline(shape) for shape in body["shapes"]]
            spokes = [own * np.array([ring_center(shape), ring_center(shape) + [shape["radius"], 0.0]])
                      for shape in body["shapes"] if shape["kind"] == "circle"]
            places = ";".join(f"{x:.1f} {y:.1f}" for x, y in self.flat(self.run.pose[steps, k, :2]))
            turns = ";".join(f"{angle:.1f}" for angle in -np.degrees(self.run.pose[steps, k, 2]))
            drawn = "".join(map(_ring, rings)) + "".join(map(_ring, spokes))
            yield (f'<g>{self._moved("translate", places, times)}<g><path {look} d="{drawn}"/>'
                   f"{self._moved('rotate', turns, times)}</g></g>")

    def _times(self, steps: Floats) -> str:
        """Return the moments as shares of the film; a run that ended early stays as it is."""
        shares = self.run.time[steps] / self.end
        shares[-1] = 1.0
        return ";".join(f"{share:.4f}".rstrip("0").rstrip(".") for share in shares)

    def _moved(self, kind: str, values: str, times: str) -> str:
        return (f'<animateTransform attributeName="transform" type="{kind}" values="{values}" keyTimes="{times}" '
                f'dur="{self.slower * self.end:g}s" repeatCount="indefinite"/>')

    def marks(self) -> Iterator[str]:
        """Yield the contacts at a moment and the impulses since the one before."""
        contacts, steps = self.run.contacts, moments(self.run, _MARKED)
        for k, step in enumerate(steps[:-1]):
            now = slice(int(contacts.offsets[step]), int(contacts.offsets[step + 1]))
            since = slice(int(contacts.offsets[steps[k - 1]] if k else 0), now.stop)
            span = self.run.time[step] / self.end, self.run.time[steps[k + 1]] / self.end
            for strengths, part, color in ((contacts.normal_force, now, BLUE), (contacts.impulse, since, FORCE)):
                if drawn := "".join(self._mark(strengths, part, cross=color == FORCE)):
                    yield (f'<path fill="none" stroke="{css(color)}" stroke-width="2" d="{drawn}">'
                           f'<animate attributeName="display" values="none;inline;none" calcMode="discrete" '
                           f'keyTimes="0;{max(span[0], 1e-4):.4f};{span[1]:.4f}" dur="{self.slower * self.end:g}s" '
                           'repeatCount="indefinite"/></path>')

    def _mark(self, strengths: Floats, part: slice, *, cross: bool) -> Iterator[str]:
        """Yield a dot and a line for each of the strongest contacts, or a cross; its size is a root of the strength."""
        largest = float(strengths.max(initial=0.0))
        chosen = np.arange(part.start, part.stop)[strengths[part] > 0.0]
        for row in chosen[np.argsort(-strengths[chosen], kind="stable")][:_STRONGEST]:
            (x, y), size = self.flat(self.run.contacts.point[row]), float(np.sqrt(strengths[row] / largest))
            if not (0.0 <= x <= SIZE[0] and 0.0 <= y <= SIZE[1]):
                continue
            if cross:
                arm = 6 + 8 * size
                yield f"M{x - arm:.1f} {y:.1f}h{2 * arm:.1f}M{x:.1f} {y - arm:.1f}v{2 * arm:.1f}"
            else:
                nx, ny = (6 + 26 * size) * _sign(self.run) * self.run.contacts.normal[row][:2]
                yield f"M{x - 3:.1f} {y:.1f}a3 3 0 1 0 6 0a3 3 0 1 0 -6 0M{x:.1f} {y:.1f}l{nx:.1f} {-ny:.1f}"


def ring_center(shape: Mapping[str, Any]) -> Floats:
    """Return the center (2,) [m] of a shape in the frame of its body."""
    return np.asarray(shape["center"], dtype=float)[:2]


def _ring(points: Floats) -> str:
    return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points) + "z"


RECIPES = tuple(recipe_of(key) for key in FILMS)
