"""Shapes and candidate pairs: what is refused, what is turned around, which shape comes first."""

from __future__ import annotations

import math

import numpy as np
import pytest

from iapb.contact.geometry import Circle, HalfPlane, Polygon, box, candidate_pairs, make_shapes
from iapb.errors import ArgumentError


def test_pairs_put_the_moving_shape_first_and_the_half_plane_last():
    shapes = make_shapes([HalfPlane((0, 0), (0, 1)), box((1, 1), body=1), Circle(1.0, body=0), Circle(1.0)])
    pairs = {tuple(map(int, pair)) for pair in candidate_pairs(shapes)}
    assert pairs == {(1, 0), (2, 0), (2, 1), (1, 3), (2, 3)}
    assert {tuple(map(int, p)) for p in candidate_pairs(shapes, lambda a, b: b == -1)} == pairs - {(2, 1)}


@pytest.mark.parametrize(
    ("shape", "argument"),
    [
        (Circle(0.0), "shapes[0].radius"),
        (Circle(1.0, (math.nan, 0.0)), "shapes[0].center"),
        (HalfPlane((0, 0), (0, 0)), "shapes[0].normal"),
        (Polygon([[0, 0], [1, 0]]), "shapes[0].vertices"),
        (Polygon([[0, 0], [2, 0], [1, 0.5], [1, 2]]), "shapes[0].vertices"),
        (Polygon([[0, 0], [1, 1], [1, 0], [0, 1]]), "shapes[0].vertices"),
    ],
)
def test_shapes_that_are_none_are_refused_by_name(shape, argument):
    with pytest.raises(ArgumentError) as caught:
        make_shapes([shape])
    assert caught.value.argument == argument


def test_a_clockwise_polygon_is_turned_around():
    corners = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]]
    assert np.array_equal(make_shapes([Polygon(corners)]).vertices, corners[::-1])
