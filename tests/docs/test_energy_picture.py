"""The README's second picture is the figure `energy-gains` of the kept tables, drawn anew."""

from __future__ import annotations

import re
from pathlib import Path

from reports.figures import energy_gains
from reports.figures.figure import Figure, draw
from reports.figures.standalone import standalone
from tests.reports.figure_inputs import ENERGY_PICTURE, tables

_NUMBER = re.compile(r"-?\d+\.?\d*")
# Points. Another version of matplotlib lays out by a little more or less; a decade of the axes is 6 points or more, and
# a panel 216.
NEAR = 0.5


def apart(picture: str, other: str) -> float | None:
    """Return by how much the largest number of two pictures differs; None where more than numbers differs."""
    if _NUMBER.sub("#", picture) != _NUMBER.sub("#", other):
        return None
    pairs = zip(_NUMBER.findall(picture), _NUMBER.findall(other), strict=True)
    return max(abs(float(one) - float(two)) for one, two in pairs)


def test_the_picture_is_what_the_figure_is_today() -> None:
    """Where it is not: ``python -m tests.reports.figure_inputs out`` after ``iapb reproduce`` draws it again."""
    figure = draw(energy_gains.energy_gains, tables())
    assert isinstance(figure, Figure)
    found = apart(ENERGY_PICTURE.read_text(encoding="utf-8"), standalone(figure))
    assert found is not None and found <= NEAR


def test_an_older_picture_is_noticed() -> None:
    picture = Path(ENERGY_PICTURE).read_text(encoding="utf-8")
    assert apart(picture, picture) == 0.0
    assert apart(picture, picture.replace("factored, no clamp", "no clamp")) is None
    moved = re.sub(r'd="M([\d.]+) ', lambda found: f'd="M{float(found[1]) + 1.0} ', picture, count=1)
    assert (apart(picture, moved) or 0.0) > NEAR
