"""Checks of a statement: its steps, its witness, the need for each hypothesis, and its false variants (twins)."""

from __future__ import annotations

import time

from verification.proofs.algebra import names_in
from verification.proofs.exact import FlintBackend, Instance, SympyBackend, all_hold, completed, holds
from verification.proofs.notation import case_lines, fact_line, step_claim, step_lines
from verification.proofs.statement import ProofRecord, Refutation, Statement, StepRecord, Twin, Without
from verification.proofs.steps import Exact, Known, Refused, Step
from verification.proofs.sympy_kernel import sympy_opinion


def checked(statement: Statement, started: float | None = None) -> ProofRecord:
    """Check everything about a statement; the verdict is "proved" only if no problem is open.

    `started` (time.perf_counter) lets the caller include the time to build the statement.
    """
    started = time.perf_counter() if started is None else started
    known = Known((*statement.given, *statement.definitions))
    steps = tuple(_checked_step(step, known) for step in statement.steps)
    needed = tuple(_needed(without, statement) for without in statement.needed)
    twins = tuple(_twin(twin, statement) for twin in statement.twins)
    second = sympy_opinion(statement)
    problems = tuple(
        [f"step refused: {step.refusal}" for step in steps if not step.accepted]
        + [f"not shown: {refutation.title}" for refutation in (*needed, *twins) if not refutation.refuted]
        + ([f"SymPy refuses a certificate: {second.words}"] if second.verdict == "refused" else [])
        + _loose_ends(statement, known)
    )
    return ProofRecord(
        name=statement.name,
        title=statement.title,
        source=statement.source,
        statement=statement.statement,
        hypotheses=tuple(fact_line(fact) for fact in statement.given),
        definitions=tuple(fact_line(fact) for fact in statement.definitions),
        steps=steps,
        conclusions=tuple(fact_line(fact) for fact in statement.conclusions),
        needed=needed,
        twins=twins,
        remarks=statement.remarks,
        assumed=statement.assumed,
        measured=statement.measured,
        verdict="not proved" if problems else "proved",
        problems=problems,
        seconds=time.perf_counter() - started,
        sympy=second.answer,
    )


def _checked_step(step: Step, known: Known) -> StepRecord:
    refusal = ""
    try:
        step.verify(known)
    except Refused as error:
        refusal = str(error)
    else:
        if step.claim is not None:
            known.add(step.claim)
    return StepRecord(step_claim(step), step.because, step_lines(step), not refusal, refusal)


def _needed(without: Without, statement: Statement) -> Refutation:
    """Check the exact case which shows that the theorem fails without this hypothesis."""
    case = completed(without.instance, statement.definitions)
    names = [fact.name for fact in statement.given]
    others = [fact for fact in statement.given if fact.name not in without.names]
    dropped = [fact for fact in statement.given if fact.name in without.names]
    false = [fact for fact in statement.conclusions if not holds(fact, case)]
    refuted = (
        set(without.names) <= set(names) and all_hold(others, case) and not all_hold(dropped, case) and bool(false)
    )
    shown = false[0] if false else statement.conclusions[0]
    title = "without " + " and ".join(f"'{name}'" for name in without.names)
    return Refutation(title, fact_line(shown), case_lines(case), without.note, refuted)


def _twin(twin: Twin, statement: Statement) -> Refutation:
    """Check that the twin's instance satisfies every hypothesis and breaks the twin's claim, on both exact backends."""
    if isinstance(twin.claim, Exact):
        return Refutation(twin.title, step_claim(twin.claim), (), twin.note, not twin.claim.is_true)
    case = completed(twin.instance, statement.definitions)
    refuted = all_hold(statement.given, case) and not any(
        holds(twin.claim, case, backend) for backend in (FlintBackend, SympyBackend)
    )
    return Refutation(twin.title, fact_line(twin.claim), case_lines(case), twin.note, refuted)


def _loose_ends(statement: Statement, known: Known) -> list[str]:
    """Return problems that weaken the theorem, such as unused, unneeded or contradictory hypotheses."""
    shown = {name for without in statement.needed for name in without.names}
    open_ends = [f"hypothesis never used: {f.name}" for f in statement.given if f.name not in known.used]
    open_ends += [f"hypothesis not shown to be needed: {f.name}" for f in statement.given if f.name not in shown]
    names = {fact.name for fact in statement.conclusions}
    open_ends += [f"conclusion never reached: {name}" for name in statement.concludes if name not in names]
    open_ends += _circular_definitions(statement)
    if not statement.twins:
        open_ends.append("no wrong twin")
    if statement.given and not _speaks_of_something(statement, statement.witness):
        open_ends.append("no exact case satisfies the hypotheses and the conclusions")
    return open_ends


def _circular_definitions(statement: Statement) -> list[str]:
    """Return the invalid definitions: each must name one letter that its right side and earlier definitions lack."""
    taken: set[str] = set()
    found = []
    for definition in statement.definitions:
        new = names_in(definition.lhs)
        taken |= names_in(definition.rhs)
        if len(definition.lhs.terms) != 1 or len(new) != 1 or new & taken:
            found.append(f"not a definition: {definition.name}")
        taken |= new
    return found


def _speaks_of_something(statement: Statement, witness: Instance | None) -> bool:
    facts = (*statement.given, *statement.conclusions)
    return witness is not None and all_hold(facts, completed(witness, statement.definitions))
