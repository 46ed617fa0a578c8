"""The topic of the scenes and its figure: sentences from records, strips."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import pytest

from iapb import find_scene, load_scene
from iapb.run import Run
from iapb.simulation import simulate
from reports.figures import scenes
from verification.finding import MIXED, REFUTED, REPRODUCED, Finding, finding_of
from verification.scenes import ledger
from verification.scenes.books import residual_row

SPACE = ("peg_hole_space", "arm_obstacles", "tumbling_body")
NAMES = ("peg_corner", *SPACE)


@pytest.fixture(scope="module")
def runs() -> tuple[Run, ...]:
    return tuple(simulate(load_scene(find_scene(name)), world="IAPB") for name in NAMES)


def _topic(runs: tuple[Run, ...], order: float = 1.0) -> Finding:
    """The topic made from these runs, and from residuals of this order."""
    shares = {1: 0.04, 2: 0.02, 4: 0.01}
    rows = {"contact": map(ledger.contact_row, runs), "energy ledger": map(ledger.book_row, runs),
            "what the books leave open": (residual_row(name, 1e-3, shares, 1, order) for name in NAMES),
            "books over time": (row for run in runs for row in ledger.over_time(run))}
    tables = {check.key: check.table_of(rows[check.key]) for check in ledger.scene_ledger.checks}
    parts = [part for check in ledger.scene_ledger.checks for part in check.sentences(tables[check.key])]
    answer = str(ledger.scene_ledger.says(tables, parts))
    return finding_of("scene-ledger", "The scenes", "", answer, parts, tables)


@pytest.fixture(scope="module")
def topic(runs: tuple[Run, ...]) -> Finding:
    return _topic(runs)


def test_sentences_say_the_numbers(topic: Finding) -> None:
    deepest = max(topic.tables["contact"].records(), key=lambda row: row["most penetration"])
    assert f"{deepest['most penetration']:.2f} mm ({deepest['scene']})" in topic.parts[0].sentence
    assert all(part.sentence.endswith(".") for part in topic.parts)
    assert {part.verdict for part in topic.parts} <= {REPRODUCED, MIXED}
    assert "4 scenes, 3 of them three-dimensional" in topic.answer


def test_worse_records_are_judged_worse(runs: tuple[Run, ...]) -> None:
    impacts = replace(runs[0].impacts, energy_lost=-runs[0].impacts.energy_lost)
    gaining = replace(runs[0], impacts=impacts, complete=False, stopped="a fault")
    outcomes = [part.verdict for part in _topic((gaining, *runs[1:]), order=0.1).parts]
    assert outcomes[1] == outcomes[2] == REFUTED and outcomes[3] == MIXED


def test_strips_show_every_joule(topic: Finding) -> None:
    strips = scenes.strips(topic.tables["books over time"])
    impacts = topic.tables["contact"].column("impacts")
    for strip, found, struck in zip(strips, topic.tables["energy ledger"].records(), impacts, strict=True):
        gap = strip.layers.sum(axis=0)[-1] - strip.line[-1]
        left_open = found["residual: motion"] + found["residual: springs"]
        assert gap == pytest.approx(left_open, abs=1e-9 * found["energy exchanged"])
        assert strip.struck.any() == (struck > 0)
        assert not strip.at_rest


def test_the_figure_is_drawn_and_can_stand_in_a_page(topic: Finding) -> None:
    inputs = {f"scene-ledger/{name}": table for name, table in topic.tables.items()}
    for panel in scenes.scenes_ledger.draw(inputs).panels:
        ElementTree.fromstring(panel.svg)
        assert panel.alt and not re.search("nan", panel.svg)
