"""The film of the peg in the corner: animated SVG that the browser plays; the page's script adds a
slider.

Each body is a group whose place and angle follow the poses of a run (`animateTransform`) at a few
hundred moments. The moments are evenly spaced in time; those around the first impacts are added.
Contacts and impulses are marks that are visible from one moment to the next. A picture has SIZE
units; as in the paper, x is to the left and y down.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from iapb.run import Run
from reports.figures.corner import UNLIMITED
from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.geometry import Floats, body_outlines, bounds, outline, wall_outlines, widened
from reports.figures.style import BLUE, FORCE, INK, PEG, WALL, css
from verification.table import titled

SIZE = (400, 300)
_MOMENTS, _IMPACTS, _MARKED = (
    160,
    30,
    60,
)  # moments of a film, first impacts that it adds, moments with marks
_MARGIN = 0.08  # of the picture
_REACH = 50.0  # the side of a half-plane that is drawn, in sizes of the bodies
_LASTS, _SLOWER = (
    5.0,
    (1, 2, 5, 10, 20, 50),
)  # seconds that a film takes at least; how much slower it can be
_BEFORE = 0.03  # a film begins so long before the first contact [s]
_STRONGEST = 12  # contacts marked at a moment


@recipe("film-corner", *UNLIMITED.values())
def film_corner(*runs: Run) -> Drawn:
    """Draw the runs of the peg in the corner side by side, at the same scale and speed."""
    end = max(float(run.time[-1]) for run in runs)
    slower = next((each for each in _SLOWER if each * end >= _LASTS), _SLOWER[-1])
    low, high = bounds_of(runs)
    touching = [
        run.time[np.flatnonzero(np.diff(run.contacts.offsets))[0]]
        for run in runs
        if len(run.contacts.gap)
    ]
    start = max(min(touching, default=0.0) - _BEFORE, 0.0)
    head = f'data-duration="{end:g}" data-slower="{slower}" data-start="{start:.4g}"'
    panels, rows = [], []
    for world, run in zip(UNLIMITED, runs, strict=True):
        film = Film(run, low, SIZE[0] / float(high[0] - low[0]), end, slower)
        alt = f"{run.scene_resolved['title']}, in the world {world}: a film of {end:.2f} s, {slower} times slower."
        svg = (
            f'<svg viewBox="0 0 {SIZE[0]} {SIZE[1]}" xmlns="http://www.w3.org/2000/svg" {head} '
            f'style="max-width: 620px">{film.walls()}{"".join(film.bodies())}{"".join(film.marks())}</svg>'
        )
        panels.append(Panel(svg, alt, world, film=True))
        rows.append(
            (world, float(run.time[-1]), run.steps, len(run.contacts.gap), len(run.impacts.step))
        )
    titles = ("world", "simulated [s]", "steps", "contacts, summed over the steps", "impacts")
    return Drawn(panels, titled(titles, rows, digits=3))


def bounds_of(runs: Sequence[Run]) -> tuple[Floats, Floats]:
    """Return the corners [m] of a picture that contains all bodies at all times, x to the left and
    y down."""
    points = [
        -corners
        for run in runs
        for step in _moments(run, _MARKED)
        for corners in body_outlines(run.scene_resolved, run.pose[step])
    ]
    return widened(*bounds(points, _MARGIN), SIZE[0] / SIZE[1])


def _moments(run: Run, count: int) -> Floats:
    """Return steps that are evenly spaced in time, and the steps around the first impacts."""
    even = np.linspace(0, run.steps, min(count, run.steps + 1)).round().astype(int)
    struck = np.unique(run.impacts.step)[:_IMPACTS]
    found = np.unique(np.concatenate([even, struck, struck + 1]))
    return found[found <= run.steps]


@dataclass(frozen=True)
class Film:
    """The SVG of one run: `corner` (2,) [m] is the picture's lower left, `scale` is in units per
    metre."""

    run: Run
    corner: Floats
    scale: float
    end: float
    slower: int

    def flat(self, points: Any) -> Floats:
        """Return the picture coordinates of points (..., 2) [m]."""
        x, y = np.moveaxis(-np.asarray(points, dtype=float)[..., :2] - self.corner, -1, 0)
        return np.stack([self.scale * x, SIZE[1] - self.scale * y], axis=-1)

    def walls(self) -> str:
        """Return the static world."""
        scene = self.run.scene_resolved
        reach = _REACH * float(max(np.ptp(np.vstack(body_outlines(scene)), axis=0)))
        rings = "".join(_ring(self.flat(ring)) for ring in wall_outlines(scene, reach))
        return f'<path fill="{css(WALL)}" d="{rings}"/>'

    def bodies(self) -> Iterator[str]:
        """Yield the bodies."""
        steps = _moments(self.run, _MOMENTS)
        shares = self.run.time[steps] / self.end
        shares[-1] = 1.0  # a run that ended early stays as it is
        times = [f"{share:.4f}".rstrip("0").rstrip(".") for share in shares]
        own = self.scale * np.array([-1.0, 1.0])
        look = f'fill="{css(PEG)}" stroke="{css(INK)}" stroke-width="1.6" fill-opacity="0.8"'
        for k, body in enumerate(self.run.scene_resolved["bodies"]):
            rings = [own * outline(shape) for shape in body["shapes"]]
            places = [f"{x:.1f} {y:.1f}" for x, y in self.flat(self.run.pose[steps, k, :2])]
            turns = [f"{angle:.1f}" for angle in -np.degrees(self.run.pose[steps, k, 2])]
            moved, turned = (
                self.animated("translate", places, times),
                self.animated("rotate", turns, times),
            )
            yield f'<g>{moved}<g><path {look} d="{"".join(map(_ring, rings))}"/>{turned}</g></g>'

    def animated(self, kind: str, values: Sequence[str], times: Sequence[str]) -> str:
        """Return the change of a transform; while it stands still, its first and last moments are
        enough."""
        kept = [
            k
            for k in range(len(values))
            if k in (0, len(values) - 1) or len({*values[k - 1 : k + 2]}) > 1
        ]
        listed = (";".join(each[k] for k in kept) for each in (values, times))
        return (
            f'<animateTransform attributeName="transform" type="{kind}" values="{next(listed)}" '
            f'keyTimes="{next(listed)}" dur="{self.slower * self.end:g}s" repeatCount="indefinite"/>'
        )

    def marks(self) -> Iterator[str]:
        """Yield the contacts at a moment and the impulses since the one before: of the strongest
        ones, a dot and a line for each contact, a cross for each impulse; the size is a root of the
        strength."""
        contacts, steps = self.run.contacts, _moments(self.run, _MARKED)
        for strengths, color in ((contacts.normal_force, BLUE), (contacts.impulse, FORCE)):
            drawn: list[
                tuple[str, int, int]
            ] = []  # marks, and the moments from and until which they are visible
            for k, step in enumerate(steps[:-1]):
                first = step if color == BLUE or k == 0 else steps[k - 1]
                begins, ends = int(contacts.offsets[first]), int(contacts.offsets[step + 1])
                chosen = begins + np.flatnonzero(strengths[begins:ends] > 0.0)
                strongest = chosen[np.argsort(-strengths[chosen], kind="stable")][:_STRONGEST]
                mark = "".join(
                    self.mark(row, np.sqrt(strengths[row] / strengths.max()), color)
                    for row in strongest
                )
                since = drawn.pop()[1] if drawn and drawn[-1][0] == mark else step
                drawn.append((mark, since, steps[k + 1]))
            shown = "".join(
                f'<path d="{mark}"><animate attributeName="display" values="none;inline;none" calcMode="discrete" '
                f'keyTimes="0;{max(self.run.time[begin] / self.end, 1e-4):.4f};{self.run.time[end] / self.end:.4f}" '
                f'dur="{self.slower * self.end:g}s" repeatCount="indefinite"/></path>'
                for mark, begin, end in drawn
                if mark
            )
            yield f'<g fill="none" stroke="{css(color)}" stroke-width="2" stroke-linejoin="round">{shown}</g>'

    def mark(self, row: int, size: float, color: str) -> str:
        """Return the path data of one contact or impulse, "" outside of the picture."""
        x, y = self.flat(self.run.contacts.point[row])
        if not (0.0 <= x <= SIZE[0] and 0.0 <= y <= SIZE[1]):
            return ""
        if color == FORCE:
            arm = round(6 + 8 * size)
            return f"M{x:.1f} {y:.1f}m-{arm} 0h{2 * arm}m-{arm}-{arm}v{2 * arm}"
        nx, ny = -(6 + 26 * size) * self.run.contacts.normal[row][:2]
        return f"M{x:.1f} {y:.1f}m-1-1h2v2h-2zm1 1l{nx:.0f} {-ny:.0f}"


def _ring(points: Floats) -> str:
    return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points) + "z"
