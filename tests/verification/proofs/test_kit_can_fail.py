"""The kit refuses what does not follow: corrupted certificates, facts nobody established, wrong shapes."""

from dataclasses import replace
from fractions import Fraction

import pytest

from iapb.errors import ArgumentError
from verification.proofs import all_proofs, load
from verification.proofs.algebra import Definite, Entrywise, NonNegative, equation, matrix, scalar, vector
from verification.proofs.checking import checked
from verification.proofs.exact import FlintBackend, SympyBackend, evaluate, instance, signature_allows
from verification.proofs.statement import Statement
from verification.proofs.steps import (
    Cancelling,
    Cofactor,
    Dominating,
    Exact,
    Identity,
    Known,
    Pairing,
    Positivity,
    Refused,
    Square,
    Term,
    identity,
)

A, B = matrix("A", "m", "n"), matrix("B", "n", "m")
x = vector("x", "n")


def corrupted(statement: Statement, index: int) -> Statement:
    """The same statement with one term of one certificate doubled (or one number changed)."""
    step = statement.steps[index]
    if isinstance(step, Exact):
        bad = replace(
            step, relation={"=": "≠", "≠": "=", "<": "≥", "≥": "<", ">": "≤", "≤": ">"}[step.relation]
        )
    elif isinstance(step, Identity) and step.cofactors:
        first, *rest = step.cofactors
        bad = replace(step, cofactors=(replace(first, left=2 * first.left), *rest))
    elif isinstance(step, Positivity):
        first, *rest = step.terms
        bad = replace(step, terms=(replace(first, weight=first.weight * 2), *rest))
    elif isinstance(step, Dominating):
        bad = replace(step, claim=replace(step.claim, value=2 * step.claim.value))
    elif hasattr(step, "claim") and not isinstance(step, Identity):
        bad = replace(
            step, claim=equation(step.claim.name, 3 * step.claim.lhs + step.claim.difference, step.claim.rhs)
        )
    else:
        bad = replace(step, claim=equation(step.claim.name, 2 * step.claim.lhs, step.claim.rhs))
    return replace(statement, steps=(*statement.steps[:index], bad, *statement.steps[index + 1 :]))


@pytest.mark.parametrize("name", all_proofs())
def test_every_step_is_refused_when_its_certificate_is_corrupted(name: str) -> None:
    statement = load(name)
    for index in range(len(statement.steps)):
        record = checked(corrupted(statement, index))
        assert not record.steps[index].accepted, statement.steps[index]
        assert record.verdict == "not proved"


@pytest.mark.parametrize("name", all_proofs())
def test_dropping_a_hypothesis_breaks_the_proof(name: str) -> None:
    statement = load(name)
    for dropped in statement.given:
        rest = tuple(fact for fact in statement.given if fact.name != dropped.name)
        record = checked(replace(statement, given=rest))
        assert any(not step.accepted for step in record.steps), dropped.name


def test_products_and_sums_of_wrong_shape_are_refused() -> None:
    with pytest.raises(ArgumentError, match="inner sizes"):
        A * A
    with pytest.raises(ArgumentError, match="equal shapes"):
        A + B
    with pytest.raises(ArgumentError, match="equal shapes"):
        A + 1
    with pytest.raises(ArgumentError, match="floats"):
        A * 0.5  # type: ignore[operator]


def test_letters_do_not_commute_but_scalars_do() -> None:
    s, square = scalar("s"), matrix("C", "n", "n")
    assert s * A == A * s
    assert not (B * A * square - square * B * A).vanishes()
    assert (x.T * square * x - x.T * square.T * x).vanishes(), "a 1 x 1 product equals its transpose"
    assert not (square - square.T).vanishes()


def test_a_fact_nobody_established_is_refused() -> None:
    orthogonal = equation("A B = I", A * B, 1)
    step = identity("A B A = A", A * B * A, A, (orthogonal,))
    step.verify(Known([orthogonal]))
    with pytest.raises(Refused, match="no earlier step proves"):
        step.verify(Known([]))


def test_an_equation_of_the_same_name_but_other_content_is_refused() -> None:
    orthogonal = equation("A B = I", A * B, 1)
    step = identity("A B A = A", A * B * A, A, (orthogonal,))
    with pytest.raises(Refused):
        step.verify(Known([equation("A B = I", A * B, 2)]))


def test_negative_weights_and_wrong_squares_are_refused() -> None:
    claim = NonNegative("−xᵀx ≥ 0", -(x.T * x))
    with pytest.raises(Refused, match="not positive"):
        Positivity(claim, (Term(-1, (), Square(x)),)).verify(Known([]))
    with pytest.raises(Refused, match="remain after the certificate"):
        Positivity(claim, (Term(1, (), Square(x)),)).verify(Known([]))


def test_a_matrix_may_not_serve_as_a_scalar_factor() -> None:
    square = matrix("C", "n", "n")
    fact = NonNegative("C ⪰ 0", square)
    claim = NonNegative("C C ⪰ 0", square * square)
    with pytest.raises(Refused, match="commuting scalar"):
        Positivity(claim, (Term(1, (fact, fact)),)).verify(Known([fact]))


def test_entrywise_products_say_nothing_about_matrices() -> None:
    """[0 1; 1 0] is entrywise non-negative but not positive semi-definite."""
    square = Entrywise("C ≥ 0 entrywise", matrix("C", "n", "n"))
    claim = NonNegative("Cᵀ C ⪰ 0", square.value.T * square.value)
    with pytest.raises(Refused, match="entrywise"):
        Positivity(claim, (Term(1, (), Pairing(square, square)),)).verify(Known([square]))


def test_cancelling_needs_the_matching_square() -> None:
    core = Definite("C ≻ 0", matrix("C", "n", "n"))
    product = equation("x x' = 0", x.T * 2 * x, 0)
    with pytest.raises(Refused, match="square does not match"):
        Cancelling(equation("x = 0", x, 0), product, core).verify(Known([product, core]))


def test_rewriting_cannot_make_a_false_identity() -> None:
    orthogonal = equation("A B = I", A * B, 1)
    with pytest.raises(Refused, match="remain after rewriting"):
        identity("B A = I", B * A, 1, (orthogonal,))
    by_hand = Identity(equation("B A = I", B * A, 1), (Cofactor(B * A * 0 + 1, orthogonal, A * B * 0 + 1),))
    with pytest.raises((Refused, ArgumentError)):
        by_hand.verify(Known([orthogonal]))


def test_both_exact_backends_agree() -> None:
    case = instance({"A": [[1, "1/2"], [3, 4]], "B": [[2, 0], ["-1/3", 5]], "x": [1, -1]}, s="2/7")
    value = scalar("s") * A * B + 1
    assert evaluate(value, case, FlintBackend) == evaluate(value, case, SympyBackend)


def test_definiteness_is_decided_exactly() -> None:
    tiny = Fraction(1, 10**40)
    assert signature_allows(((Fraction(1), Fraction(1)), (Fraction(1), 1 + tiny)), strict=True)
    assert not signature_allows(((Fraction(1), Fraction(1)), (Fraction(1), 1 - tiny)), strict=False)
    assert signature_allows(((Fraction(0), Fraction(0)), (Fraction(0), Fraction(1))), strict=False)
    assert not signature_allows(((Fraction(0), Fraction(1)), (Fraction(1), Fraction(1))), strict=False)
