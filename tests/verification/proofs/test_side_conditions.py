"""Each row of the table in docs/proofs.md: both kernels refuse the statement that lacks a side
condition, and accept it once the condition holds."""

import re
from collections.abc import Sequence
from pathlib import Path

import pytest
from sympy import SympifyError

from iapb.errors import ArgumentError
from verification.proofs import by_sympy, layout, numbers, prove
from verification.proofs.layout import Block
from verification.proofs.show import products_of
from verification.proofs.statement import Statement
from verification.proofs.steps import Known, Step

PAGE = Path(__file__).parents[3] / "docs/proofs.md"
ROWS = re.findall(
    r"^\| (.+?) \| (.+?) \| `(.+)` \| `(.+)` \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE
)
CASES = {"`case`", "`given`", "`twin`"}
RULES = [row for row in ROWS if row[0] not in CASES]
EXACT = [row for row in ROWS if row[0] in CASES]


def block_of(entries: str) -> Block:
    lines = ("title a", "source a", "says a", *entries.split(" / "))
    return layout.read("planted", "".join(f"  {line}\n" for line in lines))


def changed(entries: str, changes: str, *, strict: bool = True) -> str:
    for change in changes.split(" & "):
        old, new = (each.strip() for each in change.split("→"))
        assert old in entries or not strict
        entries = entries.replace(old, new) if old else entries
    return entries


def own_kernel_refuses(block: Block) -> bool:
    try:
        statement = Statement(block)
        known = Known([*statement.given, *statement.definitions])
        steps = prove.checked_steps(statement, known)
        shown, false = numbers.comparisons_of(block)
    except ArgumentError:
        return True
    accepted = all(step.accepted for step in steps) and all(each.is_true for each in shown)
    return not accepted or any(claim.is_true for _, claim, _ in false)


def problems(entries: str) -> set[str]:
    """What is wrong with a whole statement; an unreadable one has its own problem."""
    try:
        return set(prove.checked(block_of(entries)).problems)
    except ArgumentError as error:
        return {str(error)}


def certificates(block: Block) -> list[list[str]]:
    """What an own kernel would print that trusts every step: the products as the text gives
    them."""
    return [
        products_of(Step(task.claim, tuple(task.terms), tuple(task.cofactors)))
        for task in Statement(block).tasks
    ]


def sympy_refuses(block: Block, lines: Sequence[Sequence[str]]) -> bool:
    try:
        return bool(by_sympy.refusal(block, lines))
    except (ArgumentError, SympifyError):
        return True


@pytest.mark.parametrize(
    ("rule", "condition", "planted", "changes"),
    RULES,
    ids=[f"{rule} {condition}" for rule, condition, *_ in RULES],
)
def test_each_kernel_needs_each_side_condition(
    rule: str, condition: str, planted: str, changes: str
) -> None:
    mended = changed(planted, changes)
    assert own_kernel_refuses(block_of(planted))
    assert not own_kernel_refuses(block_of(mended)), "the change brings the condition about"
    try:
        lines = certificates(block_of(planted))
    except ArgumentError:  # unreadable: the certificate of the mended one, changed back
        back = " & ".join("→".join(each.split("→")[::-1]) for each in changes.split(" & "))
        lines = [
            [changed(line, back, strict=False) for line in step]
            for step in certificates(block_of(mended))
        ]
    assert sympy_refuses(block_of(planted), lines)
    assert not sympy_refuses(block_of(mended), certificates(block_of(mended)))


@pytest.mark.parametrize(
    ("rule", "condition", "planted", "changes"),
    EXACT,
    ids=[condition for _, condition, *_ in EXACT],
)
def test_each_condition_of_a_statement_is_needed(
    rule: str, condition: str, planted: str, changes: str
) -> None:
    assert problems(planted) - problems(changed(planted, changes))


def test_sympy_judges_the_exact_cases_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """The own kernel's judgement is switched off."""
    planted = {row[1]: row[2] for row in EXACT}
    monkeypatch.setattr(prove, "all_hold", lambda facts, case: True)
    monkeypatch.setattr(prove, "holds", lambda fact, case: False)
    without = problems(planted["a case satisfies all hypotheses"])
    assert "no exact case satisfies the hypotheses and the conclusions" in without
    assert "not shown: s is 0" not in without
    assert any("not shown" in each for each in problems(planted["it is false in its case"]))


def test_the_table_names_every_rule() -> None:
    named = {row[0].strip("`") for row in ROWS}
    assert named == {
        *("formula", "letters", "let", "where", "sum", "by", "sum`, `by"),
        *("cancelling", "dividing", "dominating", "numbers", "false", "case", "given", "twin"),
    }
