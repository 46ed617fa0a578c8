"""SymPy expands every certificate to zero, and refuses each one that is altered."""

from __future__ import annotations

from dataclasses import replace

import pytest

from verification.proofs import all_proofs, load
from verification.proofs.algebra import matrix, scalar, vector
from verification.proofs.checking import checked
from verification.proofs.statement import Statement
from verification.proofs.steps import Identity, Positivity, identity
from verification.proofs.sympy_kernel import remainder, sympy_opinion


@pytest.mark.parametrize("name", all_proofs())
def test_sympy_accepts_every_certificate(name: str) -> None:
    opinion = sympy_opinion(load(name))
    assert opinion.verdict == "accepted", opinion.words


def altered(statement: Statement, index: int) -> Statement:
    """One certificate of the statement, wrong: a cofactor or a square counts twice."""
    step = statement.steps[index]
    if isinstance(step, Identity):
        first, *rest = step.cofactors
        wrong = replace(step, cofactors=(replace(first, left=2 * first.left), *rest))
    else:
        assert isinstance(step, Positivity)
        term, *others = step.terms
        wrong = replace(step, terms=(replace(term, weight=2 * term.weight), *others))
    return replace(statement, steps=(*statement.steps[:index], wrong, *statement.steps[index + 1 :]))


@pytest.mark.parametrize("name", [
    "theorem_1", "theorem_2", "independent_subset", "projector_form", "resting_contact", "resting_energy"])  # fmt: skip
def test_sympy_refuses_every_altered_certificate_and_so_does_the_kit(name: str) -> None:
    statement, tried = load(name), 0
    for index, step in enumerate(statement.steps):
        if getattr(step, "cofactors", ()) or getattr(step, "terms", ()):
            wrong = altered(statement, index)
            opinion = sympy_opinion(wrong)
            assert opinion.verdict == "refused" and "SymPy leaves" in opinion.words
            assert checked(wrong).verdict == "not proved"
            tried += 1
    assert tried >= 2


def test_a_wrong_certificate_makes_a_proof_fail_by_sympy_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """The kit's own expansion is switched off: the proof still does not pass."""
    monkeypatch.setattr("verification.proofs.steps._require_zero", lambda *told: None)
    record = checked(altered(load("theorem_1"), 0))
    assert record.sympy == "no" and record.verdict == "not proved"
    assert any("SymPy" in problem for problem in record.problems)


def test_a_number_is_its_own_transpose_and_a_matrix_is_not() -> None:
    x, y, scale = vector("x", "d"), vector("y", "d"), scalar("e")
    step = identity("numbers", scale * x.T * y, scale * y.T * x)
    assert remainder(step) == 0
    a, b = matrix("A", "d", "d"), matrix("B", "d", "d")
    wrong = replace(step, claim=replace(step.claim, lhs=a * b, rhs=b * a))
    assert remainder(wrong) != 0
    turned = replace(step, claim=replace(step.claim, lhs=(a * b).T, rhs=b.T * a.T))
    assert remainder(turned) == 0
