"""Shapes as points and half-spaces, for the questions that advice asks: how thin, how high above,
passed through."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.linalg import norm

from iapb.contact.geometry import ENDLESS, Shapes
from iapb.numerics.schema import Booleans, Floats, Integers

GRAZED = 0.1  # of a shape's thickness: a path that enters it by less does not pass through it


class Solid(NamedTuple):
    """A convex shape in the frame of its body (-1: the world): a ball or circle, or what faces n·x
    <= offset bound."""

    body: int
    points: Floats  # (p, 3) its centre, then its corners
    normals: Floats  # (e, 3) unit, outward; none for a ball
    offsets: Floats  # (e,)
    radius: float
    thin: float  # smallest extent
    reach: float  # greatest distance from the body's origin, or from the wall's centre

    @classmethod
    def of(cls, shapes: Shapes, i: int) -> Solid:
        """Return shape number i of a scene, which must not be endless."""
        body = shapes.body[i]
        radius = float(shapes.radius[i])
        rows = slice(shapes.first[i], shapes.first[i] + shapes.count[i])
        corners = np.pad(shapes.vertices[rows], ((0, 0), (0, 1)))
        centre = corners.mean(axis=0) if len(corners) else shapes.center[i]
        middle = centre if body < 0 else np.zeros(3)
        if radius > 0.0:
            far = radius + float(norm(centre - middle))
            flat = np.zeros((0, 3))
            return cls(body, centre[None], flat, flat[:, 0], radius, 2.0 * radius, far)
        if len(corners):
            edges = np.roll(corners, -1, axis=0) - corners
            normals = np.cross(edges, [0.0, 0.0, 1.0]) / norm(edges, axis=1)[:, None]
        else:
            signs = np.array([*itertools.product((-1, 1), repeat=3)])
            corners = centre + (signs * shapes.half_size[i]) @ shapes.axes[i].T
            normals = np.vstack([shapes.axes[i].T, -shapes.axes[i].T])
        points = np.vstack([centre, corners])
        over = points @ normals.T
        far = float(norm(points - middle, axis=1).max())
        thin = float(np.ptp(over, axis=0).min())
        return cls(body, points, normals, over.max(axis=0), 0.0, thin, far)

    def height(self, points: Floats) -> Floats:
        """Return a height (n,) of points (n, 2 or 3) over the surface: zero on it, negative
        inside."""
        if self.radius > 0.0:
            return norm(points - self.points[0, : points.shape[1]], axis=1) - self.radius
        return (points @ self.normals[:, : points.shape[1]].T - self.offsets).max(axis=1)

    def crossed(self, before: Floats, after: Floats, arc: Floats, radius: float) -> Booleans:
        """Whether straight paths enter and leave the shape's core, what is deeper than `GRAZED` and
        a path's `arc`.

        radius : of the ball about the moving point, or 0. Two balls cross if they overlap by half
            of the smaller one.
        """
        arc = arc + GRAZED * self.thin
        if self.radius > 0.0:
            core = self.radius - arc
            if radius > 0.0:
                core = max(self.radius, radius) + GRAZED * self.thin - arc
            start = before - self.points[0]
            end = after - self.points[0]
            way = after - before
            square = np.maximum((way * way).sum(axis=-1), 1e-300)
            share = np.clip(-(start * way).sum(axis=-1) / square, 0.0, 1.0)
            nearest = start + share[..., None] * way
            first, last, least = (norm(x, axis=-1) for x in (start, end, nearest))
            return (least < core) & (first >= core) & (last >= core)
        before, after = (at @ self.normals.T - self.offsets for at in (before, after))
        before += arc[..., None]
        after += arc[..., None]
        share = before / np.where(before == after, 1.0, before - after)
        enters = np.where((before > 0.0) & (after <= 0.0), share, 0.0).max(axis=-1)
        leaves = np.where((before <= 0.0) & (after > 0.0), share, 1.0).min(axis=-1)
        stays_out = ((before > 0.0) & (after > 0.0)).any(axis=-1)
        outside = (before.max(axis=-1) > 0.0) & (after.max(axis=-1) > 0.0)
        return outside & ~stays_out & (leaves > enters)


def solids_of(shapes: Shapes) -> dict[int, Solid]:
    """Return the solid of each shape that is not endless."""
    return {i: Solid.of(shapes, i) for i in np.flatnonzero(~np.isin(shapes.kind, ENDLESS)).tolist()}


def joined(count: int, pairs: Iterable[tuple[int, int]]) -> Integers:
    """Return a number for each of `count` things; things that pairs connect have the same one."""
    group = np.arange(count)
    for a, b in pairs:
        group[group == group[b]] = group[a]
    return group
