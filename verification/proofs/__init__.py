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

from verification.finding import Failure, Finding, Part, counted, finding_of, of_each
from verification.numbers import Values, value_tables
from verification.proofs import layout
from verification.proofs.coq.checked import Development
from verification.proofs.prove import checked
from verification.proofs.show import NO, NOT_APPLICABLE, YES, ProofRecord
from verification.table import table_from


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


# files of the statements -> their group on the page
GROUPS = {
    "theorems": "the paper",
    "redundant_rows": "the paper",
    "consequences": "the paper",
    "exact_instances": "the paper",
    "errata": "its errata",
    "floating_point": "floating point",
}
OTHER_GROUP = "our engine and its laws"


def on_proofs(
    records: Sequence[ProofRecord], failures: Sequence[Failure] = (), *, development: Development
) -> Finding:
    """Return the Finding on proofs: proved statements, checking tools, refuted false variants, and
    Coq's theorems."""
    groups = {
        name: GROUPS.get(file, OTHER_GROUP)
        for file in layout.FILES
        for name in layout.names_in(file)
    }
    in_coq = development.statements
    statements = table_from(
        {
            "statement": one.name,
            "group": groups.get(one.name, OTHER_GROUP),
            "title": one.title,
            "says": one.statement,
            "source": one.source,
            "proved": one.holds,
            "own kernel": YES if all(step.accepted for step in one.steps) else NO,
            "SymPy": one.sympy,
            "Coq": in_coq[one.name].coq if one.name in in_coq else NOT_APPLICABLE,
            "false variants": len(one.twins),
        }
        for one in records
    )
    theorems = table_from(
        {
            "theorem": one.name,
            "says": one.says,
            "accepted": one.holds,
            "Coq": one.coq,
            "assumes": ", ".join(one.axioms or ()),
        }
        for one in development.about_code
    )
    tables = {"statements": statements, "theorems about the code": theorems}
    proved = sum(one.holds for one in records)
    accepted = [one.holds is True for one in development.about_code]
    numbers: Values = {
        "statements": len(records),
        "proved": proved,
        "by_sympy": sum(one.sympy == YES for one in records),
        "theorems": len(accepted),
        "coq": development.version or None,
        "theorems_by_coq": sum(accepted) if development.version else None,
    }
    parts = [Part.on("statements that are not proved", len(records) - proved, 0)]
    if development.version:
        parts.append(Part.on("theorems that Coq does not accept", accepted.count(False), 0))
    return finding_of(
        "proofs",
        "Proofs",
        "Which statements are proved?",
        parts,
        tables | value_tables(numbers),
        failures,
    )
