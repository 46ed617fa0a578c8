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
    case_line,
    lines_of,
    number_line,
    plain,
    products_of,
    reasons_of,
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
    second = by_sympy.refusal(block, [step.products for step in steps])
    comparisons, false_ones = numbers.comparisons_of(block)
    for each in comparisons:
        steps.append(
            StepRecord(number_line(each), refusal="" if each.is_true else f"'{each.says}' is false")
        )
    needed = [_needed(entry, facts, statement) for entry, facts in statement.hypotheses]
    twins = [_twin(entry, statement) for entry in block.all("twin")]
    for title, claim, note in false_ones:
        twins.append(Refutation(title, number_line(claim), "", note, not claim.is_true))
    problems = [f"step refused: {step.refusal}" for step in steps if not step.accepted]
    problems += [f"not shown: {each.title}" for each in (*needed, *twins) if not each.refuted]
    problems += [f"SymPy refuses a step: {second}"] if second else []
    unused = [fact.name for fact in statement.given if fact.name not in known.used]
    problems += [f"hypothesis never used: {name}" for name in unused]
    problems += [] if twins else ["no wrong twin"]
    if statement.given and not _witnessed(statement):
        problems.append("no exact case satisfies the hypotheses and the conclusions")
    (title,), (source,), (says,) = (block.prose(key) for key in ("title", "source", "says"))
    proof = (line for number, step in enumerate(steps, 1) for line in step.lines(number))
    sections = {
        "STATEMENT": (plain(says),),
        "HYPOTHESES": lines_of(statement.given),
        "NOTATION": lines_of(statement.definitions),
        "CONCLUSIONS": lines_of(statement.conclusions),
        "PROOF": tuple(proof),
        "EACH HYPOTHESIS IS NEEDED": tuple(line for case in needed for line in case.lines),
        "FALSE VARIANTS": tuple(line for twin in twins for line in twin.lines),
        "ASSUMED ABOUT ROUNDING": tuple(map(plain, block.prose("assumed"))),
        "MEASURED ON THE COMPILED CODE": tuple(map(plain, block.prose("measured"))),
        "REMARKS": tuple(map(plain, block.prose("remark"))),
    }
    return ProofRecord(
        name=block.name,
        title=title,
        source=source,
        statement=says,
        steps=tuple(steps),
        needed=tuple(needed),
        twins=tuple(twins),
        problems=tuple(problems),
        sympy=NO if second else YES,
        sections=sections,
        seconds=time.perf_counter() - started,
    )


def checked_steps(statement: Statement, known: Known) -> list[StepRecord]:
    """Check the steps in their order, and add what each one proves to `known`."""
    return [_checked(task, known) for task in statement.tasks]


def _checked(task: Task, known: Known) -> StepRecord:
    (claim,) = lines_of([task.claim])
    because = task.entry.note
    try:
        step = (
            infer(task.claim, task.method, known)
            if task.method
            else prove(task.claim, known, task.terms, task.cofactors)
        )
    except Refused as error:
        return StepRecord(claim, because, refusal=str(error))
    record = StepRecord(claim, because, products_of(step), reasons_of(step, known))
    known.facts.append(step.claim)
    return record


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
    claims = lines_of([*false, *statement.conclusions])
    return Refutation(title, claims[0], case_line(case, statement.names), entry.note, refuted)


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
    (line,) = lines_of([claim])
    return Refutation(title, line, case_line(case, statement.names), entry.note, refuted)
