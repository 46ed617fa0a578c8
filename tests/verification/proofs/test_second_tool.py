"""Coq, which shares no code with the kit, accepts the certificates and refuses corrupted ones."""

import shutil
from dataclasses import replace

import pytest

from verification.proofs import load
from verification.proofs.second_tool import CERTIFIED, coq_script, second_opinion
from verification.proofs.second_tool_prelude import NotExportable
from verification.proofs.statement import Statement
from verification.proofs.steps import Identity, Refused

needs_coq = pytest.mark.skipif(shutil.which("coqc") is None, reason="coqc is not installed")


def with_step(statement: Statement, index: int, step: Identity) -> Statement:
    return replace(statement, steps=(*statement.steps[:index], step, *statement.steps[index + 1 :]))


def doubled(statement: Statement, index: int) -> Statement:
    """The first cofactor of one certificate counts twice."""
    step = statement.steps[index]
    assert isinstance(step, Identity)
    first, *rest = step.cofactors
    return with_step(statement, index, replace(step, cofactors=(replace(first, left=2 * first.left), *rest)))


@needs_coq
@pytest.mark.parametrize("name", CERTIFIED)
def test_coq_accepts_the_certificates(name: str) -> None:
    opinion = second_opinion(load(name))
    assert opinion.verdict == "accepted", opinion.words


@needs_coq
@pytest.mark.parametrize(("name", "index"), [("independent_subset", 2), ("theorem_1", 0), ("theorem_2", 2)])
def test_coq_refuses_a_corrupted_certificate(name: str, index: int) -> None:
    opinion = second_opinion(doubled(load(name), index))
    assert opinion.verdict == "refused"
    assert "leaves a remainder" in opinion.words, "refused, but not because the expansion fails"


@needs_coq
def test_coq_refuses_a_certificate_with_a_term_left_out() -> None:
    statement = load("theorem_1")
    step = statement.steps[0]
    assert isinstance(step, Identity)
    opinion = second_opinion(with_step(statement, 0, replace(step, cofactors=step.cofactors[1:])))
    assert opinion.verdict == "refused" and "leaves a remainder" in opinion.words


def test_without_coq_the_check_is_skipped_with_a_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    opinion = second_opinion(load("theorem_1"))
    assert opinion.verdict == "skipped" and "coqc" in opinion.words


def test_an_equation_nobody_established_is_not_written_as_if_it_were() -> None:
    statement = load("independent_subset")
    with pytest.raises(Refused, match="no earlier step proves"):
        coq_script(replace(statement, given=statement.given[1:]))


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("single_contact_complementarity", "an inequality"),
        ("fp_promise", "only whole numbers"),
        ("exact_instances", "no step is an identity"),
    ],
)
def test_what_is_no_identity_in_whole_numbers_is_not_exported(name: str, reason: str) -> None:
    with pytest.raises(NotExportable, match=reason):
        coq_script(load(name))
