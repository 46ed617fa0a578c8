"""Both kernels refuse what does not follow: corrupted statements, corrupted certificates, facts
nobody established."""

import re
from dataclasses import replace
from fractions import Fraction

import pytest

from iapb.errors import ArgumentError
from verification.proofs import all_proofs, by_sympy, check, layout
from verification.proofs.cases import definite, holds, matrix_of, read_case
from verification.proofs.numbers import BY_STATEMENT, comparisons_of
from verification.proofs.prove import checked
from verification.proofs.statement import Statement
from verification.proofs.steps import Known, Refused, Step, infer, prove
from verification.proofs.steps import check as check_step
from verification.proofs.words import Expression, Reader, letter, product

NAMES = {
    "A": letter("A", "m", "n"),
    "B": letter("B", "n", "m"),
    "C": letter("C", "n", "n"),
    "x": letter("x", "n", "1"),
    "y": letter("y", "n", "1"),
    "s": letter("s"),
    "q": letter("q"),
}
READER = Reader(NAMES)
FACT = READER.fact
VALUE = READER.expression
DROPPED = ""  # the whole hypothesis

CORRUPTED = [
    ("theorem_1", "v⁺ = v − (1 + e)", "v⁺ = v + (1 + e)"),
    ("theorem_2", "given   M is positive definite", DROPPED),
    ("single_contact_complementarity", "lemma   −s² ≥ 0", "lemma   s² ≥ 0"),
    ("resting_contact", ":: k = K h + B", ":: k = K h − B"),
    ("spectral_filter", "sᵀ (I − E²) s ≥ 0", "sᵀ (E² − I) s ≥ 0"),
    ("any_truncation", "given   Q₁ᵀ Q₂ = 0", DROPPED),
    ("poisson_two_lcps", "given   contacts open", DROPPED),
    ("erratum_hypothesis", "given   e is not −1", DROPPED),
    ("fp_clamp", "x ≤ (1 − u) X + h @", "x ≤ (1 − u) X − h @"),
    ("fp_promise", ":: bound + 55/32 ≤ 20 d k", ":: bound + 55/32 ≤ 19 d k"),
    ("resting_contact", ":: 8/9 = 8 (1 − 8/9)", ":: 8/9 = 8 (1 − 7/9)"),
]


def certificates(name: str) -> list[list[str]]:
    return [list(step.products) for step in check(name).steps]


def corrupted(name: str, old: str, new: str) -> layout.Block:
    given = rf"  {re.escape(old)}.*?\n(?=  \w)" if new == DROPPED else re.escape(old)
    changed, times = re.subn(given, new, layout.text_of(name), flags=re.DOTALL)
    assert times == 1
    return layout.read(name, changed)


@pytest.mark.parametrize(("name", "old", "new"), CORRUPTED)
def test_a_corrupted_statement_is_refused_by_each_kernel(
    name: str, old: str, new: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    block = corrupted(name, old, new)
    record = checked(block)
    assert record.verdict == "not proved" and any(not step.accepted for step in record.steps)
    number = len(Statement(block).tasks)
    assert by_sympy.refusal(block, certificates(name)[:number]), (
        "SymPy accepts the certificate of the true statement"
    )
    # the kernel's own expansion is switched off
    monkeypatch.setattr(Expression, "vanishes", lambda self: True)
    assert checked(block).sympy == "no"


def test_a_false_comparison_that_is_true_is_refused_by_each_kernel(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    block = corrupted("resting_contact", ":: 1/2 8² ≤ 4", ":: 1/2 8² ≤ 32")
    record = checked(block)
    assert record.verdict == "not proved" and record.sympy == "no"
    assert any(not twin.refuted for twin in record.twins)
    monkeypatch.setattr(by_sympy, "refusal", lambda *given: "")
    assert checked(block).verdict == "not proved"


@pytest.mark.parametrize("name", BY_STATEMENT)
def test_a_wrong_number_beside_computed_ones_is_refused_by_each_kernel(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    block = layout.read(name, layout.text_of(name) + "  numbers one is two :: 1 = 2\n")
    monkeypatch.setattr(by_sympy, "holds", lambda *given: True)  # its judgement of cases is slow
    record = checked(block)
    assert record.sympy == "no"
    assert "step refused: 'one is two' is false" in record.problems


@pytest.mark.parametrize(
    "formula", ["1 ≤ 2 < 1", "2 ≠ 2", "", "= 1", "1", "1 = I", "s = s", "1/0 = 1/0", "M = 1"]
)
def test_what_is_no_comparison_of_numbers_is_refused_in_a_sentence(formula: str) -> None:
    block = layout.read("planted", f"  letters s\n  numbers {formula}\n")
    with pytest.raises(ArgumentError):
        comparisons_of(block)
    if formula:  # a line without one stands for numbers that a program computes
        with pytest.raises(ArgumentError, match="a comparison of two numbers"):
            by_sympy.refusal(block, [])


# a fault of a kernel shows in any statement of its kind: some of them by default
STATEMENTS = [
    pytest.param(name, marks=[] if k % 6 == 0 else pytest.mark.thorough)
    for k, name in enumerate(all_proofs())
]


@pytest.mark.parametrize("name", STATEMENTS)
def test_a_corrupted_certificate_is_refused_by_each_kernel(name: str) -> None:
    statement = Statement(layout.block(name))
    lines = certificates(name)
    known = Known([*statement.given, *statement.definitions])
    sympy = by_sympy.Text(statement.block)
    for index, task in enumerate(statement.tasks):
        if task.method:
            for source in infer(task.claim, task.method, known).sources:
                with pytest.raises(Refused, match="matches"):
                    infer(
                        task.claim,
                        task.method,
                        Known(
                            [fact for fact in known.facts if fact.difference != source.difference]
                        ),
                    )
            known.facts.append(task.claim)
            continue
        step = prove(task.claim, known, task.terms, task.cofactors)
        for wrong in (
            *(replace(step, terms=(*step.terms, term)) for term in step.terms),
            *(replace(step, cofactors=(*step.cofactors, cofactor)) for cofactor in step.cofactors),
        ):
            if not remainder(
                wrong
            ).vanishes():  # what is twice a number minus its transpose is still zero
                with pytest.raises(Refused, match="remain after the certificate is expanded"):
                    check_step(wrong, known)
        for line in lines[index][:1]:
            doubled = [*lines[:index], [*lines[index], line], *lines[index + 1 :]][
                : len(statement.tasks)
            ]
            refusal = by_sympy.refusal(statement.block, doubled)
            assert "SymPy leaves" in refusal or sympy.same(sympy.read(line.replace(" · ", " ")), 0)
        known.facts.append(task.claim)


def remainder(step: Step) -> Expression:
    cofactors = (left * fact.difference * right for left, fact, right in step.cofactors)
    return step.claim.difference - sum(
        (*map(product, step.terms), *cofactors), product([VALUE("1 − 1")])
    )


def test_letters_do_not_commute_but_scalars_do() -> None:
    assert VALUE("s A") == VALUE("A s") and VALUE("(2 A + 1/2 A) x") == VALUE("5/2 A x")
    assert not (VALUE("B A C") - VALUE("C B A")).vanishes()
    assert (VALUE("xᵀ C x") - VALUE("xᵀ Cᵀ x")).vanishes(), "a 1 x 1 product equals its transpose"
    assert not (VALUE("C") - VALUE("Cᵀ")).vanishes()
    assert VALUE(str(VALUE("s² (A B)ᵀ − 1/3 Bᵀ Aᵀ"))) == VALUE("s² Bᵀ Aᵀ − 1/3 Bᵀ Aᵀ"), (
        "text is read again"
    )


@pytest.mark.parametrize("case", ["z=1", "s=1 rest", "q=1"])
def test_a_case_gives_its_letters_and_no_others(case: str) -> None:
    with pytest.raises(ArgumentError):
        holds(FACT("s = 0"), read_case(case, NAMES))


@pytest.mark.parametrize("formula", ["A B)", "A other", "A = B = C"])
def test_what_is_no_formula_is_refused(formula: str) -> None:
    with pytest.raises(ArgumentError):
        FACT(formula) if "=" in formula else VALUE(formula)


def test_definiteness_is_decided_exactly() -> None:
    tiny = Fraction(1, 10**40)
    assert definite(matrix_of([[1, 1], [1, 1 + tiny]]), strict=True)
    assert not definite(matrix_of([[1, 1], [1, 1 - tiny]]), strict=False)
    assert definite(matrix_of([[0, 0], [0, 1]]), strict=False)
    assert not definite(matrix_of([[0, 1], [1, 1]]), strict=False)
