"""The algebraic claims on the engine itself, and on resolvers with a planted fault."""

import numpy as np
import pytest

from iapb.contact.impact import resolve_impact
from verification.check import Study
from verification.claims import CLAIMS, algebraic, check_claims
from verification.finding import REPRODUCED
from verification.impacts import Family, draw_of_rank


class Faulty:
    """An impact whose velocity was tampered with."""

    def __init__(self, impact, velocity, impulses=None):
        self.velocity = velocity
        self.impulses = impact.impulses if impulses is None else impulses


def energetic(mass, rows, velocity, e, **options):
    """Gains: restitution of 1.2."""
    impact = resolve_impact(mass, rows, velocity, 0.0, **options)
    return Faulty(impact, velocity + 2.2 * (impact.velocity - velocity))


def lossy(mass, rows, velocity, e, **options):
    """Takes a little too much, wherever the velocity points."""
    impact = resolve_impact(mass, rows, velocity, e, **options)
    return Faulty(impact, impact.velocity * (1.0 - 1e-6), impact.impulses * (1.0 + 1e-6))


def last_rows_only(mass, rows, velocity, e, **options):
    """Forgets a contact."""
    return resolve_impact(mass, rows[1:], velocity, e, **options)


def test_the_algebraic_claims_of_the_engine():
    """Theorems 1 and 2 hold; the printed factor is wrong."""
    for found in check_claims(ids=["C01", "C02", "C03", "C04", "C05"]):
        wrong = {algebraic.AS_PRINTED} if found.key in ("C01", "C02") else set()
        assert {part.name for part in found.parts if part.verdict != REPRODUCED} == wrong
        assert (
            found.outcome == ("holds, misprint" if wrong else "holds")
            and found.verdict == REPRODUCED
        )


@pytest.mark.parametrize("fault", [energetic, lossy])
def test_losses_notice_a_wrong_energy(monkeypatch, fault):
    monkeypatch.setattr(algebraic, "resolve_impact", fault)
    claim = algebraic.losses("C01", "", "theorem_1", [Family(3, 1, 1, 1e2)], {"quick": 4})
    table = claim.table(Study(seed=1))
    wrong = table.only(holds is False for holds in table.holds)["part"]
    assert algebraic.WITH_HALF in wrong
    assert (algebraic.PASSIVE in wrong) == (fault is energetic)


@pytest.mark.parametrize(
    ("claim", "fault"), [("C03", last_rows_only), ("C04", lossy), ("C05", lossy)]
)
def test_a_planted_fault_is_noticed(monkeypatch, claim, fault):
    monkeypatch.setattr(algebraic, "resolve_impact", fault)
    assert False in CLAIMS[claim].table(Study()).holds


def test_an_error_that_is_no_number_is_a_failure_and_failing_impacts_are_counted():
    assert algebraic.finite([1.0, np.nan]).tolist() == [1.0, np.inf]
    measure = algebraic.Measure(lambda batch: np.arange(len(batch.impacts)), lambda batch: 1.0)
    claim = algebraic.batches(
        "C99",
        "",
        families=[Family(1, 1, 1, 1e0)],
        restitutions=(0.0,),
        impacts={"quick": 5},
        parts={"x": measure},
    )
    (row,) = claim.table(Study()).records()
    assert (row["impacts"], row["failing"], claim.table(Study()).holds) == (5, 3, (False,))


def test_instances_repeat_and_have_the_rank_they_say():
    family = Family(6, 12, 4, 1e4)
    first = list(draw_of_rank(family, 3, seed=7))
    second = list(draw_of_rank(family, 3, seed=7))
    for one, other in zip(first, second, strict=True):
        assert np.array_equal(one.mass_matrix, other.mass_matrix)
        assert np.linalg.matrix_rank(one.contact_jacobian) == one.rank == 4
        assert np.linalg.cond(one.mass_matrix) == pytest.approx(1e4, rel=1e-6)
