"""The README's second picture is the figure `energy-gains` of a report; its words are those of today's figure.

To draw it again: ``iapb reproduce --figure energy-gains``, then copy ``out/energy-gains.svg``.
"""

from __future__ import annotations

import re
from pathlib import Path

from reports.figures import energy_gains
from reports.figures.figure import Figure, draw
from reports.figures.standalone import standalone
from tests.reports.figure_inputs import tables

PICTURE = Path(__file__).parents[2] / "docs" / "pictures" / "energy_gains.svg"


def words(svg: str) -> set[str]:
    """Return the words of a picture that are not its measured numbers: titles, axes, curves and their legend."""
    return {text for text in re.findall(r">([^<>]+)</(?:text|title)>", svg) if not text.startswith("10")}


def test_the_words_and_curves_of_the_picture_are_those_of_the_figure_today() -> None:
    figure = draw(energy_gains.energy_gains, tables())
    assert isinstance(figure, Figure)
    kept, today = PICTURE.read_text(encoding="utf-8"), standalone(figure)
    assert words(kept) == words(today) and len(words(kept)) > 7
    assert re.findall(r'data-curve="[^"]+"', kept) == re.findall(r'data-curve="[^"]+"', today)
    assert words(kept.replace("factored, no clamp", "no clamp")) != words(today)
