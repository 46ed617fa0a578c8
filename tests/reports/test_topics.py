"""Two topics from their runs to their sentences: the hard cases, and the energy books of the
scenes."""

from dataclasses import replace

import pytest

from iapb import find_scene, load_scene
from iapb.simulation import simulate
from reports.figures import scenes
from reports.runner import Runner
from verification.finding import MIXED, REFUTED, REPRODUCED, finding_of
from verification.hard_cases import catalogue, findings
from verification.scenes import ledger
from verification.scenes.books import residual_row

NAMES = ("peg_corner", "peg_hole_space", "arm_obstacles", "tumbling_body")


def test_every_hard_case_is_a_record_with_a_row_for_each_method(tmp_path, monkeypatch):
    keys = ["grazing", "nearly_parallel_normals", "chatter"]
    monkeypatch.setattr(findings, "HARD_CASES", {name: catalogue.HARD_CASES[name] for name in keys})
    runner = Runner(tmp_path)
    cases = findings.hard_cases(runner, lambda done, total: None, [])
    assert any("chatter" in label for label in runner.used)  # its runs are stored, and listed
    assert [case.key for case in cases] == keys
    outcomes = [{part.name: part.sentence for part in case.parts} for case in cases]
    assert outcomes[0]["factored"] == "stable" and outcomes[1]["gram_cholesky"] == "gains energy"
    assert (cases[2].details["kind"], outcomes[2]["IAPB"]) == ("motion", "stable")
    assert len(findings.on_hard_cases(cases).tables["every method"].rows) == sum(
        len(case.parts) for case in cases
    )


def topic(runs, order=1.0):
    """The topic of the scenes made from these runs, and from residuals of this order."""
    shares = {1: 0.04, 2: 0.02, 4: 0.01}
    rows = {
        "contact": map(ledger.contact_row, runs),
        "energy ledger": map(ledger.book_row, runs),
        "what the books leave open": (residual_row(name, 1e-3, shares, order) for name in NAMES),
        "books over time": (row for run in runs for row in ledger.over_time(run)),
    }
    tables = {check.key: check.table_of(rows[check.key]) for check in ledger.scene_ledger.checks}
    parts = [
        part for check in ledger.scene_ledger.checks for part in check.sentences(tables[check.key])
    ]
    answer = str(ledger.scene_ledger.says(tables, parts))
    return finding_of("scene-ledger", "The scenes", "", answer, parts, tables)


def test_sentences_say_the_numbers_worse_records_are_judged_worse_and_strips_show_every_joule():
    runs = tuple(simulate(load_scene(find_scene(name)), world="IAPB") for name in NAMES)
    found = topic(runs)
    deepest = max(found.tables["contact"].records(), key=lambda row: row["most penetration"])
    assert f"{deepest['most penetration']:.2f} mm ({deepest['scene']})" in found.parts[0].sentence
    assert all(part.sentence.endswith(".") for part in found.parts)
    assert {part.verdict for part in found.parts} <= {REPRODUCED, MIXED}
    assert "4 scenes, 3 of them three-dimensional" in found.answer
    impacts = found.tables["contact"].column("impacts")
    strips = scenes.strips(found.tables["books over time"])
    for strip, book, struck in zip(
        strips, found.tables["energy ledger"].records(), impacts, strict=True
    ):
        gap = strip.layers.sum(axis=0)[-1] - strip.line[-1]
        left_open = book["residual: motion"] + book["residual: springs"]
        assert gap == pytest.approx(left_open, abs=1e-9 * book["energy exchanged"])
        assert strip.struck.any() == (struck > 0) and not strip.at_rest
    impacts = replace(runs[0].impacts, energy_lost=-runs[0].impacts.energy_lost)
    gaining = replace(runs[0], impacts=impacts, complete=False, stopped="a fault")
    outcomes = [part.verdict for part in topic((gaining, *runs[1:]), order=0.1).parts]
    assert outcomes[1] == outcomes[2] == REFUTED and outcomes[3] == MIXED
