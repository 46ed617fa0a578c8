"""Where IAPB and the Newton LCP agree: exact statements on drawn impacts and on those of runs; a
faulty resolver."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.errors import IapbError
from iapb.scene import find_scene, load_scene
from reference.worlds import run_world
from verification.check import Study
from verification.complementarity import agreement as study
from verification.complementarity.families import random_cases, two_contacts
from verification.complementarity.landings import LANDINGS
from verification.complementarity.of_runs import equality_impacts
from verification.complementarity.piles import PILES
from verification.finding import REFUTED, REPRODUCED
from verification.impacts import ImpactCase

CASES = list(random_cases(6, seed=11))
FOUND = study.compare_cases(CASES)


def test_the_laws_agree_if_and_only_if_some_pushing_impulse_gives_the_motion() -> None:
    assert all(len(case.touching) for case in CASES if case.family == "with a neighbour")
    single = [c for c in FOUND if c["impacts"] == "one contact"]
    assert single and max(c["distance"] for c in single) <= 1e-12
    assert not any(c["contradicts"] for c in FOUND) and all(
        c["agrees"] == c["pushes"] for c in FOUND
    )
    assert {c["agrees"] for c in FOUND} == {True, False}  # both sides of the border were seen
    assert max(c["defect"] for c in FOUND) <= 1e-12 and max(c["outside"] for c in FOUND) <= 1e-10


def test_restitution_scales_the_distance_and_moves_no_border() -> None:
    """The same impacts with e = 0 and e = 1: twice the distance."""
    by_e = {
        e: [c for case, c in zip(CASES, FOUND, strict=True) if case.restitution == e]
        for e in (0.0, 1.0)
    }
    for plastic, elastic in zip(by_e[0.0], by_e[1.0], strict=True):
        assert elastic["distance"] == pytest.approx(2.0 * plastic["distance"], rel=1e-9, abs=1e-12)


def test_a_touching_contact_that_is_left_approaching_is_told() -> None:
    # the ends of a bar, of which the second only touches
    rows = np.array([[1.0, 0.5], [1.0, -0.5]])
    bar = ImpactCase(
        np.diag([1.0, 1.0 / 12.0]), rows[:1], np.array([-1.0, -2.0]), 0.5, touching=rows[1:]
    )
    assert study.compare_case(bar)["approaching"]


@given(st.floats(-0.95, 0.95), st.floats(0.05, 1.0), st.integers(0, 1000))
def test_two_contacts_agree_exactly_where_the_speed_ratio_exceeds_the_cosine(
    c: float, r: float, seed: int
) -> None:
    if abs(r - c) < 1e-6:  # on the border itself rounding decides
        return
    assert study.compare_case(two_contacts(c, r, np.random.default_rng(seed)))["agrees"] == (r > c)


def test_the_map_counts_all_cases_and_one_exception_refutes_it() -> None:
    row = study.map_row("one contact", FOUND)
    assert row["cases"] == len(FOUND) == row["agree"] + row["differ"]
    assert study.MAP.judge(study.MAP.table_of([row]))[0].verdict == REPRODUCED
    wrong = study.MAP.table_of([row, row | {"contradictions": 1}])
    assert study.MAP.judge(wrong)[0].verdict == REFUTED
    for key in ("defect", "momentum outside range(Jᵀ)"):
        assert study.MAP.table_of([row | {key: 1e-3}]).passed is False


def test_a_resolver_that_clips_its_impulses_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Clipping negative impulses one by one is neither IAPB nor the LCP."""
    original = study.resolve_impact

    def clipped(M: Any, J: Any, v: Any, e: Any) -> Any:
        p = np.maximum(original(M, J, v, e).impulses, 0.0)
        return SimpleNamespace(velocity=v + np.linalg.solve(M, J.T @ p))

    monkeypatch.setattr(study, "resolve_impact", clipped)
    found = study.compare_cases(
        case for case, c in zip(CASES, FOUND, strict=True) if not c["pushes"]
    )
    assert max(c["defect"] for c in found) > 1e-3


def test_piles_agree_only_where_they_are_small_and_pushing_is_the_lcp() -> None:
    table = PILES.table(Study(), [4, 16])
    small, large = table.records()
    assert small["piles"] == 48 and large["piles"] == 12
    assert small["agree"] > 0 == large["agree"]
    assert large["share of impulses that pull"] > 0.0
    assert PILES.judge(table)[0].verdict == REPRODUCED
    wrong = PILES.table_of([table.by_title()[0] | {"pushing only, from the LCP": 1e-3}])
    assert PILES.judge(wrong)[0].verdict == REFUTED


def test_a_bar_on_two_posts_pushes_and_pulls_as_the_condition_says() -> None:
    rows = {row["impact"]: row for row in LANDINGS.table(Study()).records()}
    for name, pulls in (("A", False), ("B", True)):
        row = rows[name]
        left, right = (row[f"impulse at the {side}"] for side in ("left", "right"))
        assert (right < 0.0) == pulls == (row["r"] < row["c"])
        assert left + right == pytest.approx(0.625)  # the momentum of the bar
    lifted = rows["B"]["right contact after pushing only"]
    assert lifted == pytest.approx(rows["B"]["c"] - rows["B"]["r"])
    assert rows["peg_corner"]["c"] == pytest.approx(0.9155, abs=1e-4)


def test_a_run_that_does_not_belong_to_its_scene_is_refused() -> None:
    scene = load_scene(find_scene("two_discs"))
    run = run_world(scene, "IAPB")
    wrong = replace(run, impacts=replace(run.impacts, v_plus=0.5 * run.impacts.v_plus))
    with pytest.raises(IapbError, match="rebuilt from its run"):
        equality_impacts(wrong, scene)


def test_per_body_rows_are_left_out() -> None:
    scene = load_scene(find_scene("two_discs")).with_values(
        {"contact.self_collision_rows": "per_body"}
    )
    run = run_world(scene, "IAPB")
    assert len(run.impacts.step) and equality_impacts(run, scene) == []
