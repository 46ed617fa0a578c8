"""The table of impacts: none of ours gains energy in exact arithmetic; without the last step, and by
the printed formula, some do."""

from __future__ import annotations

import numpy as np
import pytest

from iapb import resolve_impact
from reference.exact import relative_energy_gain
from verification.certificate import judge_gains
from verification.finding import NOT_TESTABLE, REFUTED, REPRODUCED
from verification.impacts import ADVERSE_FAMILIES, ANY_RANK, Impacts, draw_impacts
from verification.laws import ImpactCase, bulk
from verification.laws.bounds import FACTORED
from verification.laws.bulk import GAIN, NO_CLAMP, PRINTED, SHARE, TABLE, by_engine, judged_impacts
from verification.table import HOLDS


def test_the_clamp_is_what_keeps_the_bound() -> None:
    """An impact of written numbers and a resolver without BLAS: the same gain on every
    processor."""
    T = np.array([[1.0, 0.0, 0.0], [-2.0, 1.0, 0.0], [-2.0, 1.0, 1.0]])
    D = np.array([1e-3, 1e-11, 1e-11])
    M = np.sum(T[:, None, :] * D * T[None, :, :], axis=2)
    J = np.array([[1.0, 0.0, 3.0]])
    v = np.array([0.0, -2.0, 2.0])
    bound = FACTORED.energy_gain(ImpactCase(M, J, v, 1.0))
    gains = [
        relative_energy_gain(M, v, resolve_impact(M, J, v, 1.0, clamp=clamp).velocity)
        for clamp in (False, True)
    ]
    assert gains[0] > 10.0 * bound and gains[1] <= bound


def test_impacts_of_any_rank_never_gain_and_other_methods_do() -> None:
    assert judged_impacts(ANY_RANK, 2000)["gains"] == 0
    for method in (NO_CLAMP, PRINTED):
        found = judged_impacts(ANY_RANK, 1000, method)
        assert found["gains"] > 50 and found[GAIN] > 0.0 and found[HOLDS] is None
    assert found[SHARE] > 1e3


def test_impacts_of_any_rank_have_all_sizes_and_are_often_redundant() -> None:
    rng = np.random.default_rng(1)
    redundant = 0
    for _ in range(40):
        given = draw_impacts(rng, ANY_RANK, 2, 6, 5)
        redundant += int(np.linalg.matrix_rank(given.columns[0]) < 5)
        assert given.condition.max() <= 1e12
    assert redundant > 10


@pytest.mark.parametrize("family", ADVERSE_FAMILIES)
def test_no_impact_of_the_family_gains_energy(family: str) -> None:
    found = judged_impacts(family, 1000)
    assert found["gains"] == 0 and found["impacts"] == 1000
    # 0 gains of impacts that leave v as it is would say nothing
    assert found["moved"] > 0.95 and found[HOLDS] is True
    assert found["cancelled"] <= (100 if family == "subnormal velocities" else 0)


@pytest.mark.parametrize("family", ADVERSE_FAMILIES[:4])
def test_without_the_last_step_the_judge_finds_gains(family: str) -> None:
    given = draw_impacts(np.random.default_rng(1), family, 2000, 4, 3)
    bare = by_engine(given, scale=False, clamped=False)[0]
    assert judge_gains(given.mass, given.v, bare).gained.sum() > 50


def test_a_family_whose_impacts_do_not_move_is_not_reproduced(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def idle(given: Impacts, scale: bool) -> tuple[np.ndarray, np.ndarray]:
        return given.v.copy(), np.ones(len(given.v))

    moved = judged_impacts("ordinary", 100)
    monkeypatch.setitem(bulk.METHODS, bulk.OURS, idle)
    still = judged_impacts("ordinary", 100)
    assert still["gains"] == 0 and still["moved"] == 0.0 and still[HOLDS] is None
    gaining = moved | {"gains": 1, HOLDS: False}
    for rows, verdict in (
        ([moved], REPRODUCED),
        ([moved, still], NOT_TESTABLE),
        ([moved, still, gaining], REFUTED),
    ):
        (part,) = TABLE.judge(TABLE.table_of(rows))
        assert part.verdict == verdict
