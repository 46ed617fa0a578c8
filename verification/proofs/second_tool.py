"""The certificates as Coq scripts: Coq expands them again and shares no code with the kit.

A statement becomes one self-contained script over an abstract non-commutative ring with a transposition. The script has
no matrix sizes: words of one shape are compared letter by letter, whatever their sizes, so an identity of the free
algebra is an identity of matrices. Each step becomes a lemma, "these equations imply this equation". The proof of the
lemma is the certificate,

    claim.lhs - claim.rhs = sum of  left * (equation.lhs - equation.rhs) * right,

which Coq expands. Facts that are not identities are visible hypotheses of the script: a number (a 1 x 1 word) equals
its own transpose, a scalar commutes, and a positive definite form vanishes only at zero. Each hypothesis covers only
the words for which it is used. Coq checks a sum of squares as an equation; only the kit checks that its terms are not
negative.
"""

from __future__ import annotations

import shutil
import subprocess
import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from verification.proofs.algebra import Equation, Expression, expression, transposed, word_expression
from verification.proofs.second_tool_prelude import PRELUDE, NotExportable, in_coq, spelled
from verification.proofs.statement import NO, NOT_APPLICABLE, YES, Statement
from verification.proofs.steps import (
    Cancelling,
    Cofactor,
    Dividing,
    Exact,
    Identity,
    Positivity,
    Refused,
    Square,
    Step,
)

CERTIFIED = ("theorem_1", "theorem_2", "independent_subset")
PATIENCE = 120.0  # seconds for one script; each of the three takes up to 20 s on a loaded machine
CLOSED = "Closed under the global context"  # Coq's message for a lemma that depends only on its own hypotheses


@dataclass(frozen=True)
class SecondOpinion:
    """Result of the second tool: verdict "accepted", "refused" or "skipped"; `words` is its message or the reason."""

    name: str
    verdict: str
    words: str
    seconds: float = 0.0

    @property
    def answer(self) -> str:
        """The verdict as a table cell: yes, no, or not applicable."""
        return {"accepted": YES, "refused": NO}.get(self.verdict, NOT_APPLICABLE)


def second_opinion(statement: Statement) -> SecondOpinion:
    """Let Coq check the certificates of a statement; the verdict is "skipped" if there is no `coqc`."""
    started = time.perf_counter()
    coqc = shutil.which("coqc")
    if coqc is None:
        return SecondOpinion(statement.name, "skipped", "coqc is not installed (Debian: apt-get install coq)")
    try:
        script = coq_script(statement)
    except NotExportable as error:
        return SecondOpinion(statement.name, "skipped", str(error))
    except Refused as error:
        return SecondOpinion(statement.name, "refused", str(error))
    verdict, words = _run(coqc, script)
    return SecondOpinion(statement.name, verdict, words, time.perf_counter() - started)


def coq_script(statement: Statement) -> str:
    """Return the Coq script: the ring, the letters, the hypotheses, one lemma per step.

    Raises
    ------
    NotExportable
        If a step is not an identity, a coefficient is a fraction, or the statement has no step to expand.
    Refused
        If a step uses an equation that was not established before.
    """
    return _Script(statement).text()


def _run(coqc: str, script: str) -> tuple[str, str]:
    with TemporaryDirectory() as folder:
        Path(folder, "certificate.v").write_text(script, encoding="utf-8")
        try:
            done = subprocess.run(
                [coqc, "-q", "certificate.v"],
                cwd=folder,
                capture_output=True,
                text=True,
                encoding="utf-8",
                timeout=PATIENCE,
            )
        except subprocess.TimeoutExpired:
            return "refused", f"no answer within {PATIENCE:.0f} s"
    if done.returncode != 0:
        return "refused", " ".join(done.stderr.split()) or f"coqc ended with {done.returncode}"
    lemmas = script.count("Print Assumptions")
    if done.stdout.count(CLOSED) != lemmas:
        return "refused", "a lemma leans on an axiom: " + " ".join(done.stdout.split())
    return "accepted", f"{lemmas} lemmas, {CLOSED[0].lower()}{CLOSED[1:]}"


class _Script:
    """Collects the lines of the script; `proofs` maps each established equation to the Coq term that proves it."""

    def __init__(self, statement: Statement) -> None:
        self.lines: list[str] = []
        self.lemmas: list[str] = []
        self.proofs: list[tuple[Equation, str]] = []
        self._declare(statement)
        for number, fact in enumerate((*statement.given, *statement.definitions), 1):
            if isinstance(fact, Equation):
                sides = f"{in_coq(fact.lhs)} = {in_coq(fact.rhs)}"
                self._write(fact.name, f"Hypothesis given_{number} : {sides}.")
                self.proofs.append((fact, f"given_{number}"))
        for number, step in enumerate(statement.steps, 1):
            self._step(number, step)

    def text(self) -> str:
        if not self.lemmas:
            raise NotExportable("no step is an identity of words")
        checks = [f"Print Assumptions {lemma}." for lemma in self.lemmas]
        return "\n".join([PRELUDE, *self.lines, "End Certificates.", *checks]) + "\n"

    def _write(self, comment: str, *lines: str) -> None:
        words = comment.replace('"', "'").replace("(*", "( *").replace("*)", "* )")
        self.lines += ["", f"(* {words} *)", *lines]

    def _declare(self, statement: Statement) -> None:
        parts = list(_expressions(statement))
        letters = sorted({letter.name for part in parts for letter in part.letters})
        scalars = sorted({name for part in parts for names, _ in part.terms for name in names})
        self._write("letters", *(f"Variable {spelled(name)} : R." for name in letters))
        for position, name in enumerate(map(spelled, scalars)):
            central, own = f"{name}_central", f"{name}_turned"
            self._write(
                "a scalar commutes and is its own transpose",
                f"Variable {name} : R.",
                f"Hypothesis {central} : forall x, x * {name} = {name} * x.",
                f"Hypothesis {own} : tr {name} = {name}.",
                f"Hint Rewrite {own} : expand.",
            )
            later = [spelled(other) for other in scalars[position + 1 :]]
            words = [text for letter in map(spelled, letters) for text in (letter, f"(tr {letter})")]
            for word in words + later:
                moved = f"({central} {word}) (past _ _ ({central} {word}))"
                self.lines.append(f"Hint Rewrite {moved} : expand.")

    def _step(self, number: int, step: Step) -> None:
        name = f"step_{number}"
        if isinstance(step, Identity):
            self._lemma(name, step.claim, step.cofactors)
            self.proofs.append((step.claim, name))
        elif isinstance(step, Positivity):
            total = sum((term.value for term in step.terms), expression(0))
            claim = Equation(f"{step.claim.name}: the sum of squares", step.claim.value, total)
            self._lemma(name, claim, step.cofactors)
        elif isinstance(step, Cancelling | Dividing):
            self._inference(name, step)
        elif not isinstance(step, Exact):  # Exact steps compare numbers: there is nothing to expand
            raise NotExportable(f"a step of kind {type(step).__name__}")

    def _inference(self, name: str, step: Cancelling | Dividing) -> None:
        """Write X = 0 with its certificate, and N = 0 from the hypothesis for definiteness (or for s ≠ 0)."""
        source = step.square if isinstance(step, Cancelling) else step.product
        if not isinstance(source, Equation):
            raise NotExportable(f"'{step.claim.name}' follows from an inequality, which is no identity")
        residual = step.claim.difference
        if isinstance(step, Cancelling):
            form = Square(residual, step.definite).value
        else:
            form = step.divisor.value * residual
        zero = f"{in_coq(form)} = zero"
        self._write(step.because, f"Hypothesis {name}_rule : {zero} -> {in_coq(residual)} = zero.")
        self._lemma(
            f"{name}_form",
            Equation(f"for '{step.claim.name}'", form, expression(0)),
            (Cofactor(expression(1), source, expression(1)),),
        )
        self._write(
            step.claim.name,
            f"Lemma {name} : {in_coq(step.claim.lhs)} = {in_coq(step.claim.rhs)}.",
            f"Proof. refine (certificate _ _ _ ({name}_rule {name}_form) _). expand. Qed.",
        )
        self.lemmas.append(name)
        self.proofs.append((step.claim, name))

    def _lemma(self, name: str, claim: Equation, cofactors: tuple[Cofactor, ...]) -> None:
        terms = [
            f"zero_by ({in_coq(c.left)}) ({in_coq(c.right)}) {self._proof(c.equation)}" for c in cofactors
        ] + self._turned(name, claim, cofactors)
        total = "zero_is_zero"
        for term in reversed(terms):
            total = f"add_zeros ({term})\n    ({total})"
        self._write(
            claim.name,
            f"Lemma {name} : {in_coq(claim.lhs)} = {in_coq(claim.rhs)}.",
            f"Proof. refine (certificate _ _ _\n    ({total}) _). expand. Qed.",
        )
        self.lemmas.append(name)

    def _turned(self, name: str, claim: Equation, cofactors: tuple[Cofactor, ...]) -> list[str]:
        """Write cofactors k s (wᵀ - w) for the 1 x 1 words w that the kit transposes; Coq checks that they suffice."""
        rest = claim.difference
        for cofactor in cofactors:
            rest = rest - cofactor.value
        terms: list[str] = []
        for (scalars, word), coefficient in rest.ordered() if rest.is_scalar else ():
            if transposed(word) < word:
                number, text = f"{name}_number_{len(terms)}", in_coq(word_expression(word))
                self._write("a number is its own transpose", f"Hypothesis {number} : tr ({text}) = {text}.")
                left = Expression({(scalars, ()): -coefficient})
                terms.append(f"zero_by ({in_coq(left)}) (one) {number}")
        return terms

    def _proof(self, wanted: Equation) -> str:
        for fact, proof in self.proofs:
            if fact == wanted:
                return proof
            if fact.T == wanted:
                return f"(f_equal tr {proof})"
        raise Refused(f"the step uses '{wanted.name}', which no earlier step proves")


def _expressions(statement: Statement) -> Iterable[Expression]:
    for fact in (*statement.given, *statement.definitions):
        yield from fact.expressions
    for step in statement.steps:
        if not isinstance(step, Exact):
            yield from step.claim.expressions
        for cofactor in getattr(step, "cofactors", ()):
            yield from (cofactor.left, cofactor.right)
