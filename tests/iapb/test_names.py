"""A name that nothing has: the nearest one is offered, and nothing where none is near."""

from __future__ import annotations

import pytest

from iapb.names import nearest, one_of

SCENES = ("peg_corner", "peg_hole", "two_discs")


@pytest.mark.parametrize(("wrong", "right"), [
    ("peg_cornr", "peg_corner"), ("PEG_HOLE", "peg_hole"), ("twodiscs", "two_discs"), ("submarine", ""), ("", ""),
    (3, ""), (None, ""),
])
def test_the_nearest_name_is_found_whatever_its_capitals(wrong, right):
    assert nearest(wrong, SCENES) == right


def test_all_names_are_listed_and_the_guess_comes_last():
    assert one_of("peg_cornr", SCENES) == "one of peg_corner, peg_hole, two_discs; did you mean peg_corner?"
    assert one_of("submarine", SCENES, "a file, or: ") == "a file, or: peg_corner, peg_hole, two_discs"


def test_a_guess_is_spelt_as_it_is_known():
    assert nearest("iapb", ["ideal", "IAPB", "PB"]) == "IAPB"
