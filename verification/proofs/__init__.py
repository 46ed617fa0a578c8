"""Machine-checked proofs: one function per statement, listed in reading order.

    >>> from verification.proofs import all_proofs, check
    >>> for name in all_proofs():
    ...     record = check(name)
    ...     print(record.name, record.verdict)

The function with the statement's name returns a `Statement`. To add a proof, write its function and add its name below.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from iapb.errors import ArgumentError
from iapb.names import one_of
from verification.finding import (
    NOT_COMPUTED,
    REFUTED,
    REPRODUCED,
    Column,
    Failure,
    Finding,
    Part,
    counted,
    finding_of,
    of_each,
    table_of,
)
from verification.proofs.checking import checked
from verification.proofs.coq_development import ARGUED, NO_ANSWER, NOT_RUN, Theorem, says
from verification.proofs.second_tool import CERTIFIED, second_opinion
from verification.proofs.statement import NO, NOT_APPLICABLE, YES

if TYPE_CHECKING:
    from verification.proofs.statement import ProofRecord, Statement

# Modules and their statements, in reading order.
_STATEMENTS = {
    "theorems": ("theorem_1", "theorem_2", "impulse_of_independent_rows", "dynamically_consistent_inverse",
                 "newton_law_solvable"),
    "redundant_rows": ("one_inverse_invariance", "independent_subset", "step_37", "reverse_order_law",
                       "delassus_definite"),
    "consequences": ("single_contact_complementarity", "coordinate_invariance", "scaled_impulse",
                     "loss_without_stiffness"),
    "resting_contact": ("resting_contact", "resting_energy"),
    "resolver": ("projector_form", "spectral_filter", "damped_impact", "any_truncation", "energy_clamp"),
    "impact_laws": ("unequal_restitution", "newton_lcp", "newton_lcp_equal", "poisson_two_lcps", "momentum",
                    "impact_friction", "islands"),
    "errata": ("erratum_half", "erratum_symmetric", "erratum_hypothesis", "erratum_rank", "erratum_shape",
               "erratum_friction_sign", "erratum_self_collision", "erratum_adhesion", "erratum_spreading",
               "erratum_saturation"),
    "floating_point": ("fp_projector", "fp_cholesky", "fp_clamp", "fp_rounding", "fp_promise", "fp_gram_pinv"),
    "exact_instances": ("exact_instances",),
}  # fmt: skip
_HOME = {name: module for module, names in _STATEMENTS.items() for name in names}


def all_proofs() -> tuple[str, ...]:
    """Return the names of all statements, in reading order, without importing or checking them."""
    return tuple(_HOME)


def load(name: str) -> Statement:
    """Return the statement of this name without checking it."""
    if name not in _HOME:
        raise ArgumentError("name", name, one_of(name, _HOME))
    module = importlib.import_module(f"verification.proofs.statements.{_HOME[name]}")
    return replace(getattr(module, name)(), name=name)


def check(name: str) -> ProofRecord:
    """Build and check one statement.

    Raises
    ------
    ArgumentError
        If there is no statement of this name.
    """
    started = time.perf_counter()
    return checked(load(name), started)


def check_all(progress: Callable[[int, int], None], failures: list[Failure]) -> tuple[ProofRecord, ...]:
    """Check all statements; a statement that raises an exception gives a Failure and no record."""
    return tuple(of_each(counted(all_proofs(), progress), lambda name: [_check_with_coq(name)], failures))


def _check_with_coq(name: str) -> ProofRecord:
    """Return the record, with Coq's answer for the theorems in CERTIFIED."""
    record = check(name)
    if name not in CERTIFIED:
        return record
    opinion = second_opinion(load(name))
    return replace(record, coq=NOT_RUN if opinion.verdict == "skipped" else opinion.answer)


def on_proofs(records: Sequence[ProofRecord], failures: Sequence[Failure] = (),
              development: Sequence[Theorem] = ()) -> Finding:  # fmt: skip
    """Return the Finding on proofs: proved statements, checking tools, refuted false variants, and Coq's theorems."""
    rows = [{"statement": one.name, "holds": one.holds,
             "own kernel": YES if all(step.accepted for step in one.steps) else NO, "SymPy": one.sympy, "Coq": one.coq,
             "wrong twins": len(one.twins)} for one in records]  # fmt: skip
    columns = "statement", "holds", "own kernel", "SymPy", "Coq", "wrong twins"
    table = table_of(tuple(map(Column, columns)), rows)
    proved, twins = sum(table.column("holds")), sum(table.column("wrong twins"))
    sentence = (f"{proved} of {len(rows)} statements are proved: a program expands the certificate of every step. "
                f"SymPy confirms {sum(one.sympy == YES for one in records)} of the proofs. Exact counterexamples "
                f"refute {twins} deliberately altered statements.")
    parts = [Part(sentence, REPRODUCED if proved == len(rows) else REFUTED)]
    tables = {"statements": table}
    if development:
        theorems = [{"theorem": one.name, "says": says(one.name), "holds": one.holds, "own kernel": NOT_APPLICABLE,
                     "SymPy": NOT_APPLICABLE, "Coq": one.coq, "assumes": ", ".join(one.axioms)} for one in development]
        tables["theorems about the code"] = table_of(tuple(map(Column, theorems[0])), theorems)
        asked = [one for one in development if one.holds is not None]
        lost = [one for one in development if one.coq == NO_ANSWER]
        accepted = sum(one.holds is True for one in asked)
        told = (f"Coq proves {accepted} of {len(development)} theorems about the exact checker and the floating-point "
                "arithmetic of the resolver's last step. Their only axioms are those of the real numbers and, through "
                f"Flocq, classical logic. {ARGUED}" if asked or lost else
                f"Coq is not installed: {len(development)} theorems about the code were not checked here.")  # fmt: skip
        if lost:
            told = f"{told} Of {len(lost)} theorems Coq did not compile the file: {lost[0].error}"
        if asked or lost:
            whole = REPRODUCED if accepted == len(development) else NOT_COMPUTED
            parts.append(Part(told, whole if accepted == len(asked) else REFUTED))
        sentence = f"{sentence} {told}"
    return finding_of("proofs", "Proofs", "Which statements are proved?", sentence, tuple(parts), tables, failures)
