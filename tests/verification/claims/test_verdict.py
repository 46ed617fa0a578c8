"""The rule that turns trials into a verdict, the search for regions, and the words about them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from verification import check
from verification.check import Check, Study
from verification.finding import (
    BEYOND,
    DESIGN,
    FAILING,
    FAILS,
    FAILS_IN,
    FEW,
    HOLDS,
    KINDS,
    LEAST_DECIDED,
    MISPRINT,
    MISPRINTED,
    MIXED,
    NOT_COMPUTED,
    NOT_TESTABLE,
    REFUTED,
    REPRODUCED,
    WHERE,
    Part,
    failure_of,
    finding_of,
    judge_part,
    verdict_of,
    verdict_of_trials,
    with_failures,
)
from verification.region import LEAST_CONFIRMING, Region, search_region
from verification.table import Columns, table_from

YES = True
NO = False
UNKNOWN = None


TWO_CONDITIONS = Columns(conditions=("tilt", "width"))


def table(rows, holds, kinds=TWO_CONDITIONS):
    """A judged table of these rows, by default with two conditions."""
    return replace(table_from(rows, kinds=kinds), holds=tuple(holds))


@pytest.mark.parametrize(
    ("holds", "verdict"),
    [
        ([YES, YES, UNKNOWN], REPRODUCED),
        ([YES, NO], MIXED),
        ([YES, NO, NO], REFUTED),
        ([UNKNOWN, UNKNOWN], NOT_TESTABLE),
        ([], NOT_TESTABLE),
    ],
)
def test_verdict_follows_from_the_trials(holds, verdict):
    assert verdict_of_trials(holds) == verdict


def test_a_printed_range_never_exceeds_the_confirmed_one():
    assert str(Region((("jump", "", 1.0521, 1.4099), ("tilt", "rad", 0.00033331, 0.015)))) == (
        "1.06 ≤ jump ≤ 1.4 and 0.0191 ≤ tilt ≤ 0.859°"
    )


@pytest.mark.parametrize(
    ("verdicts", "verdict"),
    [
        ([REPRODUCED] * 2, REPRODUCED),
        ([REPRODUCED, WHERE], WHERE),
        ([REPRODUCED, NOT_TESTABLE], NOT_TESTABLE),
        ([WHERE, NOT_COMPUTED], NOT_COMPUTED),
        ([REPRODUCED] * 1000 + [REFUTED], REFUTED),
        ([], NOT_COMPUTED),
    ],
)
def test_a_finding_is_never_better_than_its_worst_part(verdicts, verdict):
    assert verdict_of(Part("", one) for one in verdicts) == verdict


@pytest.mark.parametrize(
    ("parts", "outcome", "kind"),
    [
        ([(REPRODUCED, ""), (REFUTED, MISPRINT), (REFUTED, BEYOND)], "holds, misprint", MISPRINTED),
        ([(REPRODUCED, ""), (REFUTED, BEYOND)], "holds", HOLDS),
        ([(WHERE, ""), (REFUTED, MISPRINT)], "holds where stated", "holds where stated"),
        ([(WHERE, ""), (REFUTED, "")], "fails in rotation", FAILS_IN),
        (
            [(REFUTED, ""), (MIXED, ""), (REPRODUCED, "")],
            "fails in x, and in some trials in rotation",
            FAILS_IN,
        ),
        ([(MIXED, "")], "fails in some trials", FAILS_IN),
    ],
)
def test_the_outcome_of_a_claim_follows_from_the_parts_that_the_paper_states(parts, outcome, kind):
    named = ("x", "rotation", "y")
    found = finding_of(
        "C",
        "C",
        "",
        [
            Part("", verdict, name, role=role)
            for name, (verdict, role) in zip(named, parts, strict=False)
        ],
    )
    assert (found.outcome, found.kind) == (outcome, kind) and kind in KINDS
    added = with_failures(found, [failure_of("one", ValueError("planted"))])
    assert added.outcome == (outcome if FAILS in outcome else "not computed")


@pytest.mark.parametrize(
    ("error", "statement", "verdict"),
    [(0.5, "theorem_1", REPRODUCED), (2.0, "theorem_1", REFUTED), (0.5, "unproved", REFUTED)],
)
def test_a_part_by_design_has_the_verdict_of_its_proof_and_hides_no_failure(
    monkeypatch, error, statement, verdict
):
    monkeypatch.setattr(
        check, "check_proof", lambda name: SimpleNamespace(holds=name == "theorem_1")
    )
    claim = replace(CLAIM, roles={"x": statement})
    rows = [{"part": "x", "error": error}, *({"part": "y", "error": 0.5} for _ in range(20))]
    found = claim.conclude(claim.table_of(rows))
    part, other = found.parts
    assert (part.role, part.proof, part.verdict) == (DESIGN, statement, verdict)
    assert found.verdict == verdict and other.verdict == REPRODUCED


CLAIM = Check(
    key="C99",
    question="?",
    cases=lambda study: (),
    row=lambda study, case: case,
    columns=Columns(parts=("part",), conditions=("tilt",)),
    holds=lambda row: row["error"] < 1.0,
)


def concluded(*trials, times=LEAST_DECIDED):
    rows = [
        dict(zip(("part", "tilt [rad]", "error"), trial, strict=True))
        for trial in trials
        for _ in range(times)
    ]
    return CLAIM.conclude(CLAIM.table_of(rows))


def test_failures_are_told_apart_by_part():
    found = concluded(("x", 0.0, 0.5), ("x", 0.3, 2.0), ("y", 0.0, 0.5), ("y", 0.3, 0.5))
    x, y = found.parts
    assert (found.verdict, x.verdict, y.verdict) == (MIXED, MIXED, REPRODUCED)
    assert (x.held, x.failed, y.held, y.failed) == (10, 10, 20, 0)


@pytest.mark.parametrize(
    ("held", "failed", "verdict"),
    [
        (LEAST_DECIDED - 1, 0, NOT_TESTABLE),
        (LEAST_DECIDED, 0, REPRODUCED),
        (0, LEAST_DECIDED - 1, NOT_TESTABLE),
        (9, 1, MIXED),
        (1, LEAST_DECIDED - 1, REFUTED),
    ],
)
def test_fewer_than_ten_trials_that_can_tell_decide_nothing(held, failed, verdict):
    outcomes = [YES] * held + [NO] * failed + [UNKNOWN] * 3
    part = judge_part("x", table([{"tilt [rad]": 0.0}] * len(outcomes), outcomes))
    few = held + failed < LEAST_DECIDED
    assert (part.verdict, part.role) == (verdict, FEW if few else "")
    assert verdict_of([part, Part("", REPRODUCED)]) == (REPRODUCED if few else verdict)
    assert verdict_of([part]) == verdict


def test_a_row_may_be_many_trials_of_which_some_fail():
    rows = [{"impacts": 8, FAILING: 0}, {"impacts": 7, FAILING: 2}, {"impacts": 5, FAILING: 0}]
    part = judge_part("x", table(rows, [YES, NO, UNKNOWN], Columns(counts=("impacts",))))
    assert (part.held, part.decided, part.unknown, part.verdict) == (13, 15, 5, MIXED)


def trials(holds, widths=(1.0, 2.0, 3.0, 4.0)):
    """The outcomes on a grid of 13 tilts and some widths."""
    rows = [{"tilt [rad]": n / 40, "width [m]": width} for n in range(13) for width in widths]
    return table(rows, ()).judged(holds)


def gentle(row):
    return row["tilt"] <= 0.2


def drawn_by(holds, count=20):
    """Fresh trials: `count` rows inside a region."""

    def draw(region):
        rng = np.random.default_rng(5)
        tilt = region.ends("tilt", (0.0, 0.3))
        width = region.ends("width", (1.0, 4.0))
        rows = [
            {"tilt [rad]": rng.uniform(*tilt), "width [m]": rng.uniform(*width)}
            for _ in range(count)
        ]
        drawn = table(rows, ()).judged(holds)
        assert all(region.contains(row) for row in drawn.records())
        return drawn

    return draw


def test_a_region_that_is_there_is_found_and_confirmed_with_its_counts():
    part = judge_part("x", trials(gentle), drawn_by(gentle))
    assert part.outcome == "holds where tilt ≤ 11.4°"
    assert part.region.share == pytest.approx(2 / 3) and part.region.fresh == 20
    assert part.region.searched + part.region.others == part.held
    half = judge_part(
        "x", trials(gentle), drawn_by(lambda row: None if row["width"] > 2.5 else gentle(row), 60)
    )
    assert LEAST_CONFIRMING <= half.region.fresh < 60


def test_a_region_may_bound_two_conditions():
    region = search_region(trials(lambda row: row["tilt"] >= 0.1 and 2.0 <= row["width"] <= 3.0))
    assert str(region) == "tilt ≥ 5.73° and 2 ≤ width ≤ 3 m"


def test_a_second_condition_must_pay():
    region = search_region(
        trials(lambda row: row["tilt"] <= 0.15 or (row["tilt"] <= 0.2 and row["width"] == 1.0))
    )
    assert str(region) == "tilt ≤ 8.59°"


def test_fresh_trials_that_fail_refute_a_region_that_the_grid_holds():
    part = judge_part("x", trials(gentle), drawn_by(lambda row: row["tilt"] <= 0.1))
    assert (part.verdict, part.region) == (MIXED, None)


@pytest.mark.parametrize("count", [LEAST_CONFIRMING - 1, LEAST_CONFIRMING])
def test_too_few_fresh_trials_confirm_nothing(count):
    part = judge_part("x", trials(gentle), drawn_by(gentle, count))
    assert (part.verdict == WHERE) == (count >= LEAST_CONFIRMING)


def test_without_fresh_trials_the_other_half_must_confirm():
    assert judge_part("x", trials(gentle, widths=(1.0,))).verdict == MIXED
    assert judge_part("x", trials(gentle)).verdict == WHERE


def test_a_half_without_a_failure_hides_no_range():
    sizes = table([{"tilt [rad]": float(n)} for n in range(1, 28)], ()).judged(
        lambda row: row["tilt"] > 2.0
    )
    assert str(judge_part("x", sizes).region) == "tilt ≥ 230°"


@pytest.mark.parametrize("share", [0.55, 0.75, 0.85])
def test_a_region_of_random_outcomes_is_not_confirmed(share):
    found = 0
    for seed in range(100):
        rng = np.random.default_rng(seed)
        outcomes = lambda row, rng=rng: bool(rng.random() < share)  # noqa: E731
        found += judge_part("x", trials(outcomes), drawn_by(outcomes)).verdict == WHERE
    assert found <= 5  # 0.85 ** 20 = 4 %


def test_a_part_that_fails_in_most_trials_may_hold_in_a_range():
    rare = lambda row: row["tilt"] <= 0.1  # noqa: E731
    part = judge_part("x", trials(rare), drawn_by(rare))
    assert (part.verdict, str(part.region)) == (WHERE, "tilt ≤ 5.72°")
    assert (part.held, part.decided) == (20, 52)


def test_a_range_may_be_a_single_value_and_fresh_trials_vary_the_others():
    limited = lambda row: row["width"] == 2.0 or row["tilt"] == 0.0  # noqa: E731
    found = trials(limited, widths=(1.0, 2.0))
    part = judge_part("x", found, drawn_by(limited))
    assert str(part.region) == "width = 2 m" and part.region.share == 0.0
    assert judge_part("x", found, drawn_by(lambda row: row["tilt"] <= 0.2)).verdict == MIXED


def test_a_part_that_decides_nothing_draws_no_fresh_trials():
    claim = replace(CLAIM, roles={"x": BEYOND}, draw=lambda study, region: pytest.fail("drawn"))
    rows = [{"part": "x", "tilt [rad]": n / 40, "error": float(n > 20)} for n in range(40)]
    assert claim.conclude(claim.table_of(rows), Study()).parts[0].held == 21
