"""Checks of a statement: its steps, its witness, the need for each hypothesis, and its false
variants (twins)."""

from __future__ import annotations

import time

from verification.proofs import by_sympy, numbers
from verification.proofs.cases import all_hold, holds
from verification.proofs.layout import Block, Entry
from verification.proofs.show import (
    NO,
    YES,
    ProofRecord,
    Refutation,
    StepRecord,
    case_lines,
    fact_line,
    number_line,
    step_lines,
)
from verification.proofs.statement import Statement, Task
from verification.proofs.steps import Known, Refused, infer, prove
from verification.proofs.words import Fact


def checked(block: Block) -> ProofRecord:
    """Check everything about a statement; the verdict is "proved" only if no problem is open."""
    started = time.perf_counter()
    statement = Statement(block)
    known = Known([*statement.given, *statement.definitions])
    steps = checked_steps(statement, known)
    comparisons, false_ones = numbers.comparisons_of(block)
    needed = tuple(_needed(entry, facts, statement) for entry, facts in statement.hypotheses)
    twins = (
        *(_twin(entry, statement) for entry in block.all("twin")),
        *(
            Refutation(title, number_line(*claim), (), note, not claim.is_true)
            for title, claim, note in false_ones
        ),
    )
    second = by_sympy.refusal(block, [[line.text for line in step.certificate] for step in steps])
    steps += [
        StepRecord(number_line(*each), refusal="" if each.is_true else f"'{each.says}' is false")
        for each in comparisons
    ]
    problems = [f"step refused: {step.refusal}" for step in steps if not step.accepted]
    problems += [
        f"not shown: {refutation.title}"
        for refutation in (*needed, *twins)
        if not refutation.refuted
    ]
    problems += [f"SymPy refuses a step: {second}"] if second else []
    problems += [
        f"hypothesis never used: {fact.name}"
        for fact in statement.given
        if fact.name not in known.used
    ]
    problems += [] if twins else ["no wrong twin"]
    if statement.given and not _witnessed(statement):
        problems.append("no exact case satisfies the hypotheses and the conclusions")
    (title,), (source,), (says,) = (block.prose(key) for key in ("title", "source", "says"))
    return ProofRecord(
        name=block.name,
        title=title,
        source=source,
        statement=says,
        hypotheses=tuple(map(fact_line, statement.given)),
        definitions=tuple(map(fact_line, statement.definitions)),
        steps=tuple(steps),
        conclusions=tuple(map(fact_line, statement.conclusions)),
        needed=needed,
        twins=twins,
        remarks=block.prose("remark"),
        assumed=block.prose("assumed"),
        measured=block.prose("measured"),
        problems=tuple(problems),
        seconds=time.perf_counter() - started,
        sympy=NO if second else YES,
    )


def checked_steps(statement: Statement, known: Known) -> list[StepRecord]:
    """Check the steps in their order, and add what each one proves to `known`."""
    return [_checked(task, known) for task in statement.tasks]


def _checked(task: Task, known: Known) -> StepRecord:
    claim = fact_line(task.claim)
    because = task.entry.note
    try:
        step = (
            infer(task.claim, task.method, known)
            if task.method
            else prove(task.claim, known, task.terms, task.cofactors)
        )
    except Refused as error:
        return StepRecord(claim, because, refusal=str(error))
    lines = step_lines(step, known)
    known.facts.append(step.claim)
    return StepRecord(claim, because, lines)


def _witnessed(statement: Statement) -> bool:
    """Return whether the hypotheses and the conclusions hold in the case without a name, as the
    kernel and SymPy read them."""
    case = statement.case("")
    block = statement.block
    formulas = [each for entry in block.all("given", "show") for each in entry.formula.split(";")]
    return all_hold([*statement.given, *statement.conclusions], case) and all(
        by_sympy.holds(block, formula, case) for formula in formulas
    )


def _needed(entry: Entry, dropped: list[Fact], statement: Statement) -> Refutation:
    """Check the exact case which shows that the theorem fails without this hypothesis."""
    case = statement.case(entry.case)
    others = [fact for fact in statement.given if fact not in dropped]
    false = [fact for fact in statement.conclusions if not holds(fact, case)]
    refuted = bool(entry.case and false) and all_hold(others, case) and not all_hold(dropped, case)
    title = "false without " + " and ".join(f"'{fact.name}'" for fact in dropped)
    return Refutation(
        title,
        fact_line([*false, *statement.conclusions][0]),
        case_lines(case, statement.names),
        entry.note,
        refuted,
    )


def _twin(entry: Entry, statement: Statement) -> Refutation:
    """Check that the case satisfies every hypothesis and breaks the twin's claim, as the kernel and
    SymPy read it."""
    title, _, words = entry.words.partition(" :: ")
    claim = statement.reader.fact(entry.formula, words)
    case = statement.case(entry.case)
    refuted = (
        all_hold(statement.given, case)
        and not holds(claim, case)
        and not by_sympy.holds(statement.block, entry.formula, case)
    )
    return Refutation(
        title, fact_line(claim), case_lines(case, statement.names), entry.note, refuted
    )
