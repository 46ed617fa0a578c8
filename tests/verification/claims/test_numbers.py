"""The numbers of the claims that pages quote: a broken table costs its own numbers alone."""

import pytest

from verification.claims import CLAIMS, peg, walls
from verification.claims.conditions import Condition
from verification.claims.numbers import LEFT_OPEN, claim_tables
from verification.claims.numbers import _limits as limits_of_tilt
from verification.finding import REFUTED, WHERE, Part, finding_of
from verification.numbers import NUMBERS
from verification.region import Region


def settling(threshold, ours, theirs):
    return {
        "part": peg.of_setting(peg.FEWER, Condition(collision_threshold=threshold)),
        **Condition(collision_threshold=threshold).row(),
        "IAPB": ours,
        "IAPB, limited": ours,
        "PB": theirs,
        "ahead": theirs - ours,
        "ahead, limited": theirs - ours,
    }


def wall(test, ours, theirs):
    return {
        "against": walls.BOTH,
        "test": test,
        "stiffness [N/m]": 1e3,
        "impulses settle after [s]": ours,
        "penalty settles after [s]": theirs,
    }


def concluded(key, rows):
    return CLAIMS[key].conclude(CLAIMS[key].table_of(rows))


def test_bounces_are_summed_by_threshold_and_walls_are_counted_by_law():
    bouncing = [settling(1e-6, 1.0, 5.0)] * 2 + [settling(1e-2, 7.0, 5.0)] * 2
    never = float("inf")
    settles = ((0.1, never), (never, 0.1), (0.2, 0.1))
    rows = [wall(walls.SETTLES, *pair) for pair in settles]
    rows += [wall(walls.SETTLES, 0.1, never) | {"against": walls.SAME_DAMPING}]
    rows += [wall(walls.SOONER, 0.2, 0.1)]
    lost = []
    tables = claim_tables([concluded("C15", bouncing), concluded("C21", rows)], lost)
    assert lost == [] and tables[LEFT_OPEN].rows
    found = dict(tables[NUMBERS].rows)
    assert found["C15 bounces at 0.001 mm/s"] == 2 and found["C15 bounces at 10 mm/s"] == 14
    assert [found[f"C21 {walls.BOTH} {law}"] for law in ("impulses", "springs")] == [2, 2]
    assert found[f"C21 {walls.SAME_DAMPING} impulses only"] == found["C21 sooner springs"] == 1


def test_a_table_that_lacks_a_column_costs_its_own_numbers_alone():
    lost = []
    broken = concluded("C15", [settling(1e-6, 1.0, 5.0)])
    broken.tables["C15"] = broken.tables["C15"].select(["part"])
    arm = concluded("C07", [{"expected": "part", "share lost": 0.5, "reading": "x"}])
    found = dict(claim_tables([broken, arm], lost)[NUMBERS].rows)
    assert found["C07 least share"] == 0.5 and "numbers of C15" in {one.case for one in lost}
    assert not any(key.startswith("C15") for key in found)


def test_the_limit_of_tilt_is_the_smaller_one_of_x_and_y():
    ends = (("x", 0.3), ("y", 0.1))
    parts = [Part("", WHERE, n, region=Region((("tilt", "rad", None, end),))) for n, end in ends]
    c10 = finding_of("C10", "", "", [*parts, Part("", REFUTED, "rotation")])
    found = limits_of_tilt({"C10": c10})
    assert found == {"C10 tilt limit deg": pytest.approx(5.73, abs=0.01), "C10 fails": 1}
