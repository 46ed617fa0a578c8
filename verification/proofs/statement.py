"""Records of statements to prove and of the results of checking them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from verification.proofs.algebra import Equation, Fact
from verification.proofs.exact import Instance
from verification.proofs.printing import proof_text
from verification.proofs.steps import Exact, Step


@dataclass(frozen=True)
class Without:
    """An exact case that shows the need for a hypothesis: it fails, all others hold, and a conclusion is false.

    Several names are dropped together if they state one property (such as both sides of an inverse).
    """

    hypothesis: str | tuple[str, ...]
    instance: Instance
    note: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        return (self.hypothesis,) if isinstance(self.hypothesis, str) else self.hypothesis


@dataclass(frozen=True)
class Twin:
    """A deliberately altered statement that is false: `claim` fails on `instance`, which satisfies all hypotheses.

    A claim about numbers (`Exact`) needs no instance, because it is false by itself.
    """

    title: str
    claim: Fact | Exact
    instance: Instance = Instance({})
    note: str = ""


@dataclass(frozen=True)
class Statement:
    """A theorem, lemma or erratum with its proof.

    `definitions` give names to expressions (a letter or scalar on the left); they assume nothing, so they need no
    counterexample. `statement` and `remarks` are prose with LaTeX between dollar signs. `concludes` names the steps
    that are conclusions; the other steps are lemmas. `witness` is one exact case that satisfies every hypothesis, so
    the theorem is not vacuous. A floating-point statement lists its premises separately: `assumed` about rounding,
    `measured` on the compiled code. `load` sets `name`.
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
    """One line of a printed proof: its words and, if there is one, its formula as text and as LaTeX."""

    words: str
    text: str = ""
    latex: str = ""


@dataclass(frozen=True)
class StepRecord:
    """A checked step: claim, reason, certificate term by term, and whether the check accepted it."""

    claim: Line
    because: str
    certificate: tuple[Line, ...]
    accepted: bool
    refusal: str = ""


@dataclass(frozen=True)
class Refutation:
    """A false statement, an exact case, and whether the case refutes the statement."""

    title: str
    claim: Line
    case: tuple[Line, ...]
    note: str
    refuted: bool


@dataclass(frozen=True)
class ProofRecord:
    """A proof as plain data, with everything that the command line and the report show."""

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
        """Return the whole proof as plain text, readable without the code."""
        return proof_text(self)
