"""Where IAPB and the Newton LCP agree: exact statements on drawn impacts and on those of runs; a
faulty resolver."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.errors import IapbError
from iapb.scene import find_scene, load_scene
from reference.worlds import run_world
from tests.reference.fclib_files import local_file
from verification.check import Study
from verification.complementarity import agreement as study
from verification.complementarity.families import FAMILIES, random_cases, two_contacts
from verification.complementarity.of_runs import impacts_of_run
from verification.complementarity.piles import groups_of, piles, recorded_piles
from verification.finding import REFUTED, REPRODUCED
from verification.impacts import ImpactCase

CASES = list(random_cases(6, seed=11))
FOUND = study.compare_cases(CASES)


def test_the_laws_agree_if_and_only_if_some_pushing_impulse_gives_the_motion() -> None:
    single = [c for c in FOUND if c["impacts"] == "one contact"]
    assert single and max(c["distance"] for c in single) <= 1e-12
    assert not any(c["contradicts"] for c in FOUND) and all(
        c["agrees"] == c["pushes"] for c in FOUND
    )
    assert {c["agrees"] for c in FOUND} == {True, False}  # both sides of the border were seen
    assert max(c["defect"] for c in FOUND) <= 1e-12 and max(c["outside"] for c in FOUND) <= 1e-10


def test_restitution_scales_the_distance_and_moves_no_border() -> None:
    """The same impacts with e = 0 and e = 1: twice the distance."""
    by_e = {e: [c for c in FOUND if c["e"] == e] for e in (0.0, 1.0)}
    for plastic, elastic in zip(by_e[0.0], by_e[1.0], strict=True):
        assert elastic["distance"] == pytest.approx(2.0 * plastic["distance"], rel=1e-9, abs=1e-12)


def test_a_touching_contact_that_is_left_approaching_is_told() -> None:
    rows = np.array(
        [[1.0, 0.5], [1.0, -0.5]]
    )  # the ends of a bar, of which the second only touches
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
    rows = list(study.map_rows(FOUND))
    assert sum(row["cases"] for row in rows) == len(FOUND)
    assert len(FOUND) == 6 * 3 * sum(len(redundancies) for _, redundancies in FAMILIES.values())
    statements, touching = study.MAP.sentences(study.MAP.table_of(rows))
    assert statements.verdict == REPRODUCED and touching.name == "touching"
    for name, wrong in (
        ("contradictions", 1),
        ("defect", 10 * study.PUSHED),
        ("momentum outside range(Jᵀ)", 1e-3),
    ):
        assert (
            study.MAP.sentences(study.MAP.table_of([{**rows[0], name: wrong}, *rows[1:]]))[
                0
            ].verdict
            == REFUTED
        )


def test_a_resolver_that_clips_its_impulses_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Clipping negative impulses one by one is neither IAPB nor the LCP."""

    def clipped(case: ImpactCase, iapb: Any = study.iapb) -> tuple[np.ndarray, np.ndarray]:
        p = np.maximum(iapb(case)[1], 0.0)
        return case.velocity + np.linalg.solve(case.mass_matrix, case.contact_jacobian.T @ p), p

    monkeypatch.setattr(study, "iapb", clipped)
    found = study.compare_cases(
        case for case, c in zip(CASES, FOUND, strict=True) if c["adhesion"] == "adhesive"
    )
    assert any(c["distance"] > study.SAME and c["adhesion"] == "none" for c in found)
    assert max(c["defect"] for c in found) > 1e-3


def test_piles_agree_only_where_they_are_small_and_pushing_is_the_lcp() -> None:
    check, groups = piles(()), list(groups_of("quick", ()))
    assert len(groups) == 15 and len(groups[0][1]) == 16
    table = check.table(
        Study(), [(name, found[:3]) for name, found in groups if name.startswith(("4 ", "16 "))]
    )
    small, large = (
        [row for row in table.records() if row["pile"].startswith(f"{n} spheres")] for n in (4, 16)
    )
    assert any(row["share that agrees"] for row in small) and not any(
        row["share that agrees"] for row in large
    )
    assert (
        not any(table.column("contradicted by least squares"))
        and max(table.column("largest change of KE")) <= 0.0
    )
    assert max(table.column("pushing from the LCP")) <= 1e-12
    assert all(row["share of impulses that pull"] > 0.0 for row in large) and any(
        row["redundant"] for row in large
    )
    (said,) = check.sentences(table)
    limit = max(table.column("most contacts that agree"))
    assert said.verdict == REFUTED and f"more than {limit} contacts" in said.miss


def test_recorded_piles_are_their_normal_rows(tmp_path: Path) -> None:
    rows = np.random.default_rng(0).normal(size=(60, 12))
    local_file(tmp_path / "pile.hdf5", rows @ rows.T, rows @ np.ones(12), np.full(20, 0.4))
    (tmp_path / "broken.lcp").write_text("3 1 2")
    (case,) = recorded_piles(tmp_path, 100)
    assert case.contacts == 20 and case.family == "recorded: pile.hdf5"
    normals = case.contact_jacobian
    assert normals @ normals.T == pytest.approx((rows @ rows.T)[::3, ::3])
    assert normals @ case.velocity == pytest.approx((rows @ np.ones(12))[::3])
    assert not list(recorded_piles(tmp_path, 19))


def test_a_run_that_does_not_belong_to_its_scene_is_refused() -> None:
    scene = load_scene(find_scene("two_discs"))
    run = run_world(scene, "IAPB")
    wrong = replace(run, impacts=replace(run.impacts, v_plus=0.5 * run.impacts.v_plus))
    with pytest.raises(IapbError, match="rebuilt from its run"):
        impacts_of_run(wrong, scene)


def test_per_body_rows_are_counted_as_left_out() -> None:
    scene = load_scene(find_scene("two_discs")).with_values(
        {"contact.self_collision_rows": "per_body"}
    )
    assert impacts_of_run(run_world(scene, "IAPB"), scene) == ((), 1)
