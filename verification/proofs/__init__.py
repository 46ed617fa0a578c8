"""Machine-checked proofs: every statement is text in the folder `statements`, in the layout that `layout` describes.

    >>> from verification.proofs import all_proofs, check
    >>> for name in all_proofs():
    ...     record = check(name)
    ...     print(record.name, record.verdict)

A small kernel reads the formulas (`words`), finds and checks certificates (`steps`) and exact cases (`cases`); SymPy
reads the same text by itself (`by_sympy`). To add a proof, write its text; no code names it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from verification.finding import (
    NOT_COMPUTED,
    NOT_TESTABLE,
    REFUTED,
    REPRODUCED,
    Failure,
    Finding,
    Part,
    counted,
    finding_of,
    of_each,
)
from verification.proofs import layout
from verification.proofs.coq_development import ARGUED, NO_ANSWER, Theorem, statements
from verification.proofs.prove import checked
from verification.proofs.show import NO, NOT_APPLICABLE, YES, ProofRecord
from verification.table import titled


def all_proofs() -> tuple[str, ...]:
    """Return the names of all statements, in reading order, without checking them."""
    return layout.all_names()


def check(name: str) -> ProofRecord:
    """Check one statement.

    Raises
    ------
    ArgumentError
        If there is no statement of this name.
    """
    return checked(layout.block(name))


def check_all(progress: Callable[[int, int], None], failures: list[Failure]) -> tuple[ProofRecord, ...]:
    """Check all statements; a statement that raises an exception gives a Failure and no record."""
    found = of_each(counted(all_proofs(), progress), lambda name: [check(name)], failures)
    in_coq = {name: theorem.coq for name, theorem in statements().items()}
    return tuple(replace(record, coq=in_coq.get(record.name, record.coq)) for record in found)


def on_proofs(records: Sequence[ProofRecord], failures: Sequence[Failure] = (),
              development: Sequence[Theorem] = ()) -> Finding:  # fmt: skip
    """Return the Finding on proofs: proved statements, checking tools, refuted false variants, and Coq's theorems."""
    table = titled(("statement", "holds", "own kernel", "SymPy", "Coq", "wrong twins"), [
        (one.name, one.holds, YES if all(step.accepted for step in one.steps) else NO, one.sympy, one.coq,
         len(one.twins)) for one in records])  # fmt: skip
    proved, twins = sum(table.column("holds")), sum(table.column("wrong twins"))
    confirmed = sum(one.sympy == YES for one in records)
    sentence = (f"{proved} of {len(records)} statements about the formulas are proved: a program checks "
                f"every step. SymPy confirms {'all ' * (confirmed == proved)}{confirmed}. To test the "
                f"program, we also wrote {twins} false variants; it refutes each by an exact counterexample.")
    parts = [Part(sentence, REPRODUCED if proved == len(records) else REFUTED)]
    tables = {"statements": table}
    if development:
        tables["theorems about the code"] = titled(
            ("theorem", "says", "holds", "own kernel", "SymPy", "Coq", "assumes"),
            [(one.name, one.says, one.holds, NOT_APPLICABLE, NOT_APPLICABLE, one.coq, ", ".join(one.axioms))
             for one in development])  # fmt: skip
        asked = [one for one in development if one.holds is not None]
        lost = [one for one in development if one.coq == NO_ANSWER]
        accepted = sum(one.holds is True for one in asked)
        told = (f"Coq proves {sum(one.coq == YES for one in records)} of the statements too, and {accepted} of "
                f"{len(development)} theorems about code: a checker of impacts in exact integers, and the last step of "
                "the engine's impact in floating point. Axioms: those of the real numbers, and classical logic, "
                f"which Coq's library for floating point, Flocq, uses. {ARGUED}" if asked or lost else
                f"Another {len(development)} theorems, about the code, need Coq, which is not installed; they were not "
                "checked here.")  # fmt: skip
        if lost:
            told = f"{told} Of {len(lost)} theorems Coq did not compile the file: {lost[0].error}"
        whole = REPRODUCED if accepted == len(development) else NOT_COMPUTED
        parts.append(Part(told, whole if accepted == len(asked) else REFUTED) if asked or lost else
                     Part(told, NOT_TESTABLE, optional=True))
        sentence = f"{sentence} {told}"
    return finding_of("proofs", "Proofs", "Which statements are proved?", sentence, tuple(parts), tables, failures)
