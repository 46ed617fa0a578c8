"""The picture of the README is what the runs of today show."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from blocks import ROOT
from comparing import differs

from reports.cli import main

PICTURE = "docs/pictures/peg_in_the_corner.svg"


def description(svg: str) -> str:
    """What the picture says of itself in words and numbers: how far each world ends from the ideal one."""
    found = re.search(r"<desc>(.*?)</desc>", svg, flags=re.S)
    assert found is not None
    return found.group(1)


def test_picture_is_of_today(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reproduce", "--figure", "hero", "--out", str(tmp_path)]) == 0
    drawn = (tmp_path / "hero.svg").read_text(encoding="utf-8")
    kept = (ROOT / PICTURE).read_text(encoding="utf-8")
    difference = differs(description(drawn), description(kept))
    assert not difference, f"{difference}; draw it again: iapb reproduce --figure hero, copy out/hero.svg to {PICTURE}"
    assert "distance of the hand" in description(kept).lower()
