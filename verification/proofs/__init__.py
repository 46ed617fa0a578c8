"""Machine-checked proofs: every statement is text in the folder `statements`, in the layout that
`layout` describes.

    >>> from verification.proofs import all_proofs, check
    >>> for name in all_proofs():
    ...     record = check(name)
    ...     print(record.name, record.verdict)

A small kernel reads the formulas (`words`), finds and checks certificates (`steps`) and exact cases
(`cases`); SymPy reads the same text by itself (`by_sympy`). To add a proof, write its text; no code
names it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from verification.finding import (
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
from verification.proofs.coq.checked import Development
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


def check_all(
    progress: Callable[[int, int], None], failures: list[Failure]
) -> tuple[ProofRecord, ...]:
    """Check all statements; a statement that raises an exception gives a Failure and no record."""
    return tuple(of_each(counted(all_proofs(), progress), lambda name: [check(name)], failures))


def on_proofs(
    records: Sequence[ProofRecord], failures: Sequence[Failure] = (), *, development: Development
) -> Finding:
    """Return the Finding on proofs: proved statements, checking tools, refuted false variants, and
    Coq's theorems."""
    in_coq = development.statements
    table = titled(
        ("statement", "holds", "own kernel", "SymPy", "Coq", "wrong twins"),
        [
            (
                one.name,
                one.holds,
                YES if all(step.accepted for step in one.steps) else NO,
                one.sympy,
                in_coq[one.name].coq if one.name in in_coq else NOT_APPLICABLE,
                len(one.twins),
            )
            for one in records
        ],
    )
    proved, twins = sum(table.column("holds")), sum(table.column("wrong twins"))
    confirmed = sum(one.sympy == YES for one in records)
    sentence = (
        f"{proved} of {len(records)} statements about the formulas are proved: a program checks "
        f"every step. SymPy confirms {'all ' * (confirmed == proved)}{confirmed}. To test the "
        f"program, we also wrote {twins} false variants; it refutes each by an exact "
        f"counterexample."
    )
    part = Part(sentence, REPRODUCED if proved == len(records) else REFUTED)
    about_code = titled(
        ("theorem", "says", "holds", "own kernel", "SymPy", "Coq", "assumes"),
        [
            (
                one.name,
                one.says,
                one.holds,
                NOT_APPLICABLE,
                NOT_APPLICABLE,
                one.coq,
                ", ".join(one.axioms or ()),
            )
            for one in development.about_code
        ],
    )
    by_coq = _by_coq(development)
    return finding_of(
        "proofs",
        "Proofs",
        "Which statements are proved?",
        f"{sentence} {by_coq.sentence}",
        (part, by_coq),
        {"statements": table, "theorems about the code": about_code},
        failures,
    )


def _by_coq(development: Development) -> Part:
    """Return what Coq proves, or that it has not run."""
    theorems = development.about_code
    if not development.version:
        return Part(
            f"Another {len(theorems)} theorems, about the code, need Coq, which has not run here "
            "(`make -C verification/proofs/coq`).",
            NOT_TESTABLE,
            optional=True,
        )
    accepted = sum(one.holds is True for one in theorems)
    sentence = (
        f"Coq {development.version} proves {len(development.statements)} of the statements too, "
        f"and {accepted} "
        f"of {len(theorems)} theorems about code: a checker of impacts in exact integers, and the "
        f"last step of "
        "the engine's impact in floating point. Axioms: those of the real numbers, and classical "
        "logic, which "
        "Coq's library for floating point, Flocq, uses. Not proved in Coq: that the compiled code "
        "does the "
        "theorems' operations in their order, and that the C functions frexp and ldexp, which "
        "scale by powers "
        "of two, are exact."
    )
    return Part(sentence, REPRODUCED if accepted == len(theorems) else REFUTED)
