"""What a file of proofs states, and what comes out when it is checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from verification.proofs.algebra import Equation, Fact
from verification.proofs.exact import Instance
from verification.proofs.printing import proof_text
from verification.proofs.steps import Exact, Step


@dataclass(frozen=True)
class Without:
    """An exact case where one hypothesis fails, all others hold, and a conclusion is false: it is needed.

    Several names are dropped together where they say one thing (both sides of an inverse).
    """

    hypothesis: str | tuple[str, ...]
    instance: Instance
    note: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        return (self.hypothesis,) if isinstance(self.hypothesis, str) else self.hypothesis


@dataclass(frozen=True)
class Twin:
    """A nearby statement that is wrong: under the same hypotheses `claim` fails on `instance`.

    A claim about numbers (`Exact`) needs no instance: it is false as it stands.
    """

    title: str
    claim: Fact | Exact
    instance: Instance = Instance({})
    note: str = ""


@dataclass(frozen=True)
class Statement:
    """A theorem, lemma or erratum with its proof.

    `definitions` give names to expressions (a letter or scalar on the left); they say nothing about the world, so
    they need no counterexample. `statement` and `remarks` are prose with LaTeX between dollar signs. `concludes`
    names the steps that are the conclusions; the others are lemmas on the way. `witness` is one exact case in
    which every hypothesis holds, so that the theorem speaks of something. What a floating-point statement takes from
    elsewhere is kept apart: `assumed` of rounding, `measured` on the compiled code. `name` is given by `load`.
    """

    title: str
    source: str
    statement: str
    given: tuple[Fact, ...] = ()
    definitions: tuple[Equation, ...] = ()
    steps: Sequence[Step] = ()
    concludes: tuple[str, ...] = ()
    witness: Instance | None = None
    needed: tuple[Without, ...] = ()
    twins: tuple[Twin, ...] = ()
    remarks: tuple[str, ...] = ()
    assumed: tuple[str, ...] = ()
    measured: tuple[str, ...] = ()
    name: str = ""

    @property
    def conclusions(self) -> tuple[Fact, ...]:
        return tuple(s.claim for s in self.steps if s.claim is not None and s.claim.name in self.concludes)


YES, NO, NOT_APPLICABLE = "yes", "no", "not applicable"


@dataclass(frozen=True)
class Line:
    """One line of a printed proof: its words and, where there is one, its formula as text and as LaTeX."""

    words: str
    text: str = ""
    latex: str = ""


@dataclass(frozen=True)
class StepRecord:
    """A checked step: what is claimed, why, the certificate term by term, and whether it closed."""

    claim: Line
    because: str
    certificate: tuple[Line, ...]
    accepted: bool
    refusal: str = ""


@dataclass(frozen=True)
class Refutation:
    """A false statement, the exact case that refutes it, and whether the case does so."""

    title: str
    claim: Line
    case: tuple[Line, ...]
    note: str
    refuted: bool


@dataclass(frozen=True)
class ProofRecord:
    """A proof as plain data: everything the command line and the report show."""

    name: str
    title: str
    source: str
    statement: str
    hypotheses: tuple[Line, ...]
    definitions: tuple[Line, ...]
    steps: tuple[StepRecord, ...]
    conclusions: tuple[Line, ...]
    needed: tuple[Refutation, ...]
    twins: tuple[Refutation, ...]
    remarks: tuple[str, ...]
    assumed: tuple[str, ...]
    measured: tuple[str, ...]
    verdict: str
    problems: tuple[str, ...]
    seconds: float = field(compare=False)
    sympy: str = NOT_APPLICABLE  # whether SymPy and Coq expand the certificates too: YES, NO, or why there is no answer
    coq: str = NOT_APPLICABLE

    @property
    def holds(self) -> bool:
        return self.verdict == "proved"

    def as_text(self) -> str:
        """The whole proof in plain text, to be followed without the code."""
        return proof_text(self)
