"""A run as a film: the poses and contacts of its bodies at a few hundred moments, small enough for a page.

Positions and marks are 16-bit integers in base64. A picture has SIZE units, y down. The moments are evenly spaced in
time; the moments just before and after the first impacts are added. All impulses between two moments are included.

A film shows the rings and balls of the bodies, static walls, and lines between joints. Their coordinates are in the
right-handed frame of the view: x across the picture, y up, z towards the reader [m]. A planar scene is seen from above.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from iapb.run import Run
from reports.figures.canvas import is_turned, widened
from reports.figures.geometry import (
    WORLD,
    Floats,
    Placement,
    View,
    body_outlines,
    body_placements,
    cuboid_faces,
    cuboid_of_inertia,
    half_plane,
    is_spatial,
    outline,
    placement,
)
from reports.figures.scenes_space import Sight, pieces

SIZE = (400, 300)
LARGEST = 60_000  # bytes of one film in the page
_MOMENTS = (300, 220, 160, 120, 80, 50)  # as many as fit
_IMPACTS = 60  # the moments around this many first impacts are added
_STRONGEST = 12  # contacts shown at a moment
_MARGIN = 0.08  # of the picture
_WHOLE = 32_000  # largest whole number written
# steps of a mark per unit, per radian and per root of the strongest
_PLACE_STEPS, _ANGLE_STEPS, _STRENGTH_STEPS = 40, 10_000, 1000
_REACH = 50.0  # the side of a standing half-plane that is drawn, in sizes of the bodies


@dataclass(frozen=True)
class Ring:
    """A face with corners (n, 3) [m] in the frame of `body` (a number; -1 = world). `flat`: seen from both sides."""

    body: int
    corners: Floats
    flat: bool = False


@dataclass(frozen=True)
class Ball:
    """A ball or disc about a center (3,) [m]; `spoke`: a line from its center shows how it turns."""

    body: int
    center: Floats
    radius: float
    spoke: bool


@dataclass(frozen=True)
class Link:
    """A line from a point of one body to a point of another."""

    first: int
    start: Floats
    second: int
    end: Floats


@dataclass(frozen=True)
class Parts:
    """Everything that is drawn of a scene."""

    seen: View
    rings: tuple[Ring, ...]
    balls: tuple[Ball, ...]
    links: tuple[Link, ...]
    walls: tuple[Floats, ...]  # rings (n, 2) in the picture


def plan(scene: Mapping[str, Any]) -> View:
    """Return the view of a planar scene, turned in the same way as its drawing in the paper."""
    sign = -1.0 if is_turned(scene) else 1.0
    return View(np.array([sign, 0.0, 0.0]), np.array([0.0, sign, 0.0]), np.array([0.0, 0.0, 1.0]))


def frames(scene: Mapping[str, Any], seen: View, pose: Floats) -> tuple[Placement, ...]:
    """Return the placements of the bodies at a pose of the run, in the view's frame."""
    turn = Placement(np.array([seen.across, seen.up, seen.towards]), np.zeros(3))
    return tuple(turn @ place for place in body_placements(scene, pose).values())


def parts(scene: Mapping[str, Any], sight: Sight | None) -> Parts:
    """Return the drawn parts of a scene; a scene in space needs a `sight`, which gives the viewpoint."""
    number = {body["name"]: k for k, body in enumerate(scene["bodies"])} | {WORLD: -1}
    seen = sight.seen if sight else plan(scene)
    shapes = [shape for k, body in enumerate(scene["bodies"]) for shape in _shapes(k, body)]
    rings = tuple(shape for shape in shapes if isinstance(shape, Ring))
    balls = tuple(shape for shape in shapes if isinstance(shape, Ball))
    return Parts(seen, rings, balls, tuple(_links(scene, number)) if sight else (), tuple(_walls(scene, seen, sight)))


def _shapes(number: int, body: Mapping[str, Any]) -> Iterator[Ring | Ball]:
    for shape in body["shapes"] or _of_inertia(body):
        if shape["kind"] in ("circle", "sphere"):
            center = np.resize(np.append(shape["center"], 0.0), 3)
            yield Ball(number, center, shape["radius"], spoke=shape["kind"] == "circle")
        elif "rpy" in shape:
            own = placement(shape["center"], shape["rpy"])
            yield from (Ring(number, face) for face in cuboid_faces(own, shape["size"]))
        else:
            corners = outline(shape)
            yield Ring(number, np.column_stack([corners, np.zeros(len(corners))]), flat=True)


def _of_inertia(body: Mapping[str, Any]) -> Sequence[Mapping[str, Any]]:
    """Return a homogeneous box with a free body's mass and inertia; it represents a body without a shape."""
    if body["joint"] != "free_flyer":
        return ()
    return ({"kind": "box", "size": cuboid_of_inertia(body), "center": body["center_of_mass"], "rpy": (0, 0, 0)},)


def _links(scene: Mapping[str, Any], number: Mapping[str, int]) -> Iterator[Link]:
    """Yield lines from joint to joint, and from the last joints to the shapes."""
    for body in scene["bodies"]:
        if body["parent"] != WORLD:
            own = number[body["name"]]
            yield Link(number[body["parent"]], np.zeros(3), own, np.zeros(3))
            yield from (Link(own, np.zeros(3), own, np.asarray(s["center"], dtype=float)) for s in body["shapes"])


def _walls(scene: Mapping[str, Any], seen: View, sight: Sight | None) -> Iterator[Floats]:
    if sight:
        yield from (seen.flat(piece.points) for piece in pieces(sight, {**scene, "bodies": ()}, np.zeros((0, 7))))
        return
    corners = [corners for _, corners in body_outlines(scene)]
    reach = _REACH * float(max(np.ptp(np.vstack(corners), axis=0)))
    for wall in scene["walls"]:
        ring = half_plane(wall, reach) if wall["kind"] == "half_plane" else outline(wall)
        yield ring @ np.array([seen.across[:2], seen.up[:2]]).T


@dataclass(frozen=True)
class Film:
    """The data of the player (`text`, JSON), and the data of the still pictures."""

    run: Run
    parts: Parts
    scale: float  # units per metre
    corner: Floats  # (2,) [m] of the picture's lower left, in the view's frame
    steps: tuple[int, ...]
    text: str

    def flat(self, points: Any) -> Floats:
        """Return the picture coordinates of points (..., 2 or 3) [m] in the view's frame."""
        x, y = np.moveaxis(np.asarray(points, dtype=float)[..., :2] - self.corner, -1, 0)
        return np.stack([self.scale * x, SIZE[1] - self.scale * y], axis=-1)


def film(run: Run, sight: Sight | None = None, beside: Sequence[Run] = ()) -> Film:
    """Return a run as a film of at most LARGEST bytes; a run in space needs a `sight`.

    Films that are shown side by side get the same scale: pass the other runs (of the same scene) as `beside`.
    """
    drawn = parts(run.scene_resolved, sight if is_spatial(run.scene_resolved) else None)
    low, high = _bounds((run, *beside), drawn)
    scale = SIZE[0] / float(high[0] - low[0])
    for count in _MOMENTS:
        steps = moments(run, count)
        made = Film(run, drawn, scale, low, steps, "")
        text = json.dumps(_plain(made), separators=(",", ":"))
        if len(text) <= LARGEST:
            break
    return Film(run, drawn, scale, low, steps, text)


def moments(run: Run, count: int) -> tuple[int, ...]:
    """Return steps that are evenly spaced in time, and the steps around the first impacts."""
    even = np.linspace(0, run.steps, min(count, run.steps + 1)).round().astype(int)
    struck = np.unique(run.impacts.step)[: min(_IMPACTS, count // 4)]
    return tuple(int(step) for step in np.unique(np.concatenate([even, struck, struck + 1])) if step <= run.steps)


def _bounds(runs: Sequence[Run], drawn: Parts) -> tuple[Floats, Floats]:
    """Return the corners (2,) [m] of a picture that contains all bodies at all times."""
    points = [corner for run in runs for step in moments(run, _MOMENTS[-1]) for corner in _corners(run, drawn, step)]
    low, high = np.min(points, axis=0), np.max(points, axis=0)
    margin = _MARGIN * max(high - low)
    return widened(low - margin, high + margin, SIZE[0] / SIZE[1])


def _corners(run: Run, drawn: Parts, step: int) -> list[Floats]:
    places = frames(run.scene_resolved, drawn.seen, run.pose[step])
    corners = [point for ring in drawn.rings for point in places[ring.body].of(ring.corners)[:, :2]]
    for ball in drawn.balls:
        center = places[ball.body].of(ball.center)[:2]
        corners += [center - ball.radius, center + ball.radius]
    return corners + [places[link.second].of(link.end)[:2] for link in drawn.links]


def _plain(made: Film) -> dict[str, Any]:
    """Return the film as plain values; lengths are in units of the picture."""
    run, scale = made.run, made.scale
    turns, origins = _poses(made)
    factor = _WHOLE / max(float(np.abs(origins).max()), float(max(SIZE)))
    poses = np.concatenate([origins * factor, turns * _WHOLE], axis=-1)

    def lengths(values: Any) -> list[float]:
        return [round(scale * float(value), 2) for value in np.ravel(values)]

    return {
        "times": [round(float(run.time[step]), 5) for step in made.steps],
        "bodies": len(run.scene_resolved["bodies"]), "factor": factor, "poses": _encoded(poses),
        "rings": [[ring.body, int(ring.flat), *lengths(ring.corners)] for ring in made.parts.rings],
        "balls": [[ball.body, int(ball.spoke), *lengths([*ball.center, ball.radius])] for ball in made.parts.balls],
        "links": [[link.first, link.second, *lengths([*link.start, *link.end])] for link in made.parts.links],
        "marks": _encoded(_marks(made)),
    }  # fmt: skip


def _poses(made: Film) -> tuple[Floats, Floats]:
    """Return quaternions (moments, bodies, 4) and origins (moments, bodies, 3).

    Origins are in picture units from the lower left corner, y up.
    """
    from scipy.spatial.transform import Rotation

    corner = np.append(made.corner, 0.0)
    each = [frames(made.run.scene_resolved, made.parts.seen, made.run.pose[step]) for step in made.steps]
    origins = np.array([[made.scale * (place.origin - corner) for place in places] for places in each])
    turns = np.array([Rotation.from_matrix([place.rotation for place in places]).as_quat() for places in each])
    for k in range(1, len(turns)):  # the nearer sign of ±q, so that the player can interpolate linearly
        turns[k] *= np.where(np.sum(turns[k] * turns[k - 1], axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    return turns, origins


def _marks(made: Film) -> Floats:
    """Return rows (moment, x, y, angle, strength): contacts at a moment, and impulses (strength < 0) since the one
    before."""
    contacts, offsets = made.run.contacts, made.run.contacts.offsets
    rows: list[list[float]] = []
    for k, step in enumerate(made.steps):
        now = slice(int(offsets[min(step, made.run.steps - 1)]), int(offsets[min(step, made.run.steps - 1) + 1]))
        since = slice(int(offsets[made.steps[k - 1]] if k else 0), int(offsets[step]))
        rows += _rows(made, k, now, contacts.normal_force, 1.0) + _rows(made, k, since, contacts.impulse, -1.0)
    return np.array(rows).reshape(-1, 5)


def _rows(made: Film, moment: int, part: slice, strengths: Floats, sign: float) -> list[list[float]]:
    """Return rows for the strongest of some contacts; strength is the square root of the share of the run's largest."""
    contacts, seen = made.run.contacts, made.parts.seen
    largest = float(strengths.max(initial=0.0))
    chosen = np.arange(part.start, part.stop)[strengths[part] > 0.0]
    chosen = chosen[np.argsort(-strengths[chosen], kind="stable")][:_STRONGEST]
    points = made.flat(seen.flat(contacts.point[chosen]))
    normals = seen.flat(contacts.normal[chosen])
    angles = _ANGLE_STEPS * np.arctan2(-normals[:, 1], normals[:, 0])
    sizes = np.ceil(_STRENGTH_STEPS * np.sqrt(strengths[chosen] / largest)) if largest else strengths[chosen]
    limit = 2.0 * max(SIZE)  # what is farther out is not seen
    shown = np.all(np.abs(points) < limit, axis=1)
    columns = np.column_stack([np.full(len(chosen), moment), _PLACE_STEPS * points, angles, sign * sizes])
    return [list(row) for row in columns[shown]]


def _encoded(values: Floats) -> str:
    """Return 16-bit little-endian integers in base64."""
    return base64.b64encode(np.rint(values).astype("<i2").tobytes()).decode()
