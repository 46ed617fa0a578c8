"""Scenes in space: each in its first and last state, drawn from its run alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from iapb.run import Run
from reports.figures.canvas import Canvas, hand
from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.geometry import (
    Floats,
    Placement,
    View,
    body_placements,
    cuboid,
    cuboid_of_inertia,
    links,
    placement,
    placement_of,
    plane_frame,
    view,
)
from reports.figures.style import FORCE, INK, LINK, MUTED, PANEL, PEG, RULE, WALL

_MARGIN = 0.06
_LINK_WIDTH = 4.0  # points
_MARK = 0.04  # radius of the marked corner, as a share of the box's longest side
_BODY_SHOWS, _WALL_SHOWS = 0.7, 0.35  # how much of what lies behind them they hide


@dataclass(frozen=True)
class Sight:
    """The viewpoint of a scene, and the `moments` of its run that are drawn, as fractions of its duration."""

    run: str
    seen: View
    moments: tuple[float, ...]
    floor: float = 0.0  # half side [m] of the piece of a half-space that is drawn; 0 = none
    walls_around: float = 0.0  # half side [m] to which boxes of the static world are cut; 0 = whole


SIGHTS = (
    Sight("space/peg_hole", view(-1.2, 0.2), (0.0, 0.07, 1.0), walls_around=0.075),
    Sight("space/arm_obstacles", view(-0.75, 0.5), (0.0, 0.4, 1.0), floor=0.5),
    Sight("space/tumbling_body", view(-1.0, 0.4), (0.0, 0.45, 1.0)),
)


@dataclass(frozen=True)
class Piece:
    """A ring or line of points (n, 3) [m] to draw."""

    points: Floats
    face: str
    edge: str = INK
    width: float = 0.9
    nearness: float = 0.0  # what is nearer to the reader is drawn later
    alpha: float = 1.0


@recipe(
    "scenes-space", "The scenes in space", *(sight.run for sight in SIGHTS), section="scene-ledger",
    caption="Each scene at its start, midway and at its end; bodies and walls are transparent. First: a peg with a "
    "collar goes into a square hole in a plate and strikes loose boxes and balls around it. Second: a six-axis arm is "
    "pulled at its tool along the red arrow, touches a post, a knob and a table, and pushes a loose block away (there "
    "is no gravity). Third: a free body spins about its axis of middle inertia and turns over again and again. It has "
    "no shape; the picture shows the uniform box with its mass and inertia, with one corner marked.",
)  # fmt: skip
def scenes_space(*runs: Run) -> Drawn:
    """Draw every scene at the moments of its `Sight`."""
    panels = []
    for sight, run in zip(SIGHTS, runs, strict=True):
        scene = run.scene_resolved
        steps = [round(share * run.steps) for share in sight.moments]
        drawn = [sorted(pieces(sight, scene, run.pose[step]), key=lambda piece: piece.nearness) for step in steps]
        # all pictures of a scene have the same scale
        corners = np.vstack([sight.seen.flat(piece.points) for each in drawn for piece in each])
        margin = _MARGIN * np.ptp(corners, axis=0).max()
        low, high = corners.min(axis=0) - margin, corners.max(axis=0) + margin
        for step, each in zip(steps, drawn, strict=True):
            with Canvas(f"scenes-space-{run.scene_name}-{step}", low, high, PANEL) as canvas:
                for order, piece in enumerate(each):
                    flat, over = sight.seen.flat(piece.points), {"zorder": 2 + 1e-3 * order}
                    if len(flat) == 2:
                        canvas.axes.plot(*flat.T, color=piece.edge, linewidth=piece.width, **over)
                        continue
                    canvas.axes.fill(*flat.T, facecolor=piece.face, edgecolor="none", alpha=piece.alpha, **over)
                    canvas.axes.fill(*flat.T, facecolor="none", edgecolor=piece.edge, linewidth=piece.width,
                                     joinstyle="round", **over)  # fmt: skip
                if scene["hand"]:
                    place = body_placements(scene, run.pose[step])[scene["hand"]["body"]]
                    hand(canvas.axes, scene, place, 0.16 * float(max(high - low)), sight.seen.flat)
            moment = f"{run.time[step]:.2f} s"
            alt = f"{scene['title']}, from aside, after {moment}."
            panels.append(Panel(canvas.svg, alt, f"{run.scene_name}, {moment}"))
    return Drawn(tuple(panels))


def pieces(sight: Sight, scene: Mapping[str, Any], pose: Floats) -> Iterator[Piece]:
    """Yield the faces, discs and lines of a scene at a pose that face the reader."""
    seen = sight.seen
    for wall in scene["walls"]:
        if wall["kind"] != "half_space":
            yield from _shape(seen, placement(), _cut(wall, sight.walls_around), WALL, MUTED, _WALL_SHOWS)
        elif sight.floor:  # a square, moved to the reach of an arm, x > 0
            square = np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]])
            yield Piece(plane_frame(wall).of(sight.floor * square) + [0.7 * sight.floor, 0.0, 0.0], RULE, MUTED, 0.6,
                        -np.inf)  # fmt: skip
    places = body_placements(scene, pose)
    for line in links(scene, pose):
        yield Piece(np.array(line), "none", LINK, _LINK_WIDTH, seen.depth(line))
    for body in scene["bodies"]:
        frame = places[body["name"]]
        for shape in body["shapes"]:
            yield from _shape(seen, frame, shape)
        if not body["shapes"] and body["joint"] == "free_flyer":
            size, center = cuboid_of_inertia(body), np.asarray(body["center_of_mass"], dtype=float)
            yield from _shape(seen, frame, {"kind": "box", "size": size, "center": center})
            yield Piece(seen.disc(frame.of(center + size / 2.0), _MARK * max(size)), FORCE, FORCE, 0.5, np.inf)


def _cut(wall: Mapping[str, Any], reach: float) -> Mapping[str, Any]:
    """Return a static box, cut to a square with half side `reach` about the origin."""
    if not reach or wall["kind"] != "box":
        return wall
    half, center = np.asarray(wall["size"]) / 2.0, np.asarray(wall["center"], dtype=float)
    low, high = center - half, center + half
    low[:2], high[:2] = np.maximum(low[:2], -reach), np.minimum(high[:2], reach)
    return {**wall, "size": high - low, "center": (low + high) / 2.0}


def _shape(seen: View, frame: Placement, shape: Mapping[str, Any], face: str = PEG, edge: str = INK,
           alpha: float = _BODY_SHOWS) -> Iterator[Piece]:  # fmt: skip
    own = frame @ placement_of(shape)
    rings = [seen.disc(own.origin, shape["radius"])] if shape["kind"] == "sphere" else [
        ring for ring in cuboid("", own, shape["size"]).sides if seen.faces_reader(ring)]  # fmt: skip
    for ring in rings:
        yield Piece(ring, face, edge, 0.9, seen.depth(own.origin), alpha)
