"""The Coq development in `verification/proofs/coq`: its compilation, its assumptions, and the extracted checker.

`Checker.v` verifies an exact judge of impacts and extracts it to OCaml; `checker.ml` reads the file that
`iapb certify --export` writes. `Passive.v`, `Accepted.v` and `Wide.v` prove with Flocq what the resolver's last step
accepts. `Theorems.v` states Theorems 1 and 2 and (33) by hand. If coqc, Flocq or OCaml is missing, the result names the
missing program and claims nothing.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from iapb.errors import IapbError, MissingDependencyError
from verification.finding import Failure, counted, of_each
from verification.proofs.show import YES

FOLDER = Path(__file__).with_name("coq")
PATIENCE = 600.0  # seconds for one file
# Axioms that `Print Assumptions` may list: those from which Coq's library builds the real numbers, and classical
# logic (P or not P, for every P), which Flocq uses.
KNOWN_AXIOMS = frozenset({
    "ClassicalDedekindReals.sig_forall_dec", "ClassicalDedekindReals.sig_not_dec",
    "FunctionalExtensionality.functional_extensionality_dep", "Classical_Prop.classic"})  # fmt: skip
STATEMENTS = "Theorems"  # the file with theorems that are also statements of the kernel, by the same names
NOT_RUN, NO_ANSWER = "not run here", "no answer"
# Text for the report beside the theorems: the rest of the proof that an accepted candidate never gains energy.
ARGUED = ("Not proved in Coq: that the compiled code does the theorems' operations in their order, and that the C "
          "functions frexp and ldexp, which scale by powers of two, are exact.")
_HINT = "apt-get install coq libcoq-flocq ocaml-nox (Debian)"


@dataclass(frozen=True)
class Theorem:
    """A theorem of the development: Coq's answer (yes, not run here, no answer), the axioms that it uses, the error if
    Coq did not compile its file, and what it says, in the English of the comment beside it."""

    name: str
    coq: str
    axioms: tuple[str, ...] = ()
    error: str = ""
    says: str = ""

    @property
    def holds(self) -> bool | None:
        """Whether Coq accepts it with axioms of KNOWN_AXIOMS only; None if Coq did not run or compile the file."""
        return None if self.coq in (NOT_RUN, NO_ANSWER) else self.coq == YES and KNOWN_AXIOMS.issuperset(self.axioms)


def theorems(progress: Callable[[int, int], None] = lambda *_: None,
             failures: list[Failure] | None = None) -> tuple[Theorem, ...]:  # fmt: skip
    """Return every theorem about the code, with Coq's answer, or "not run here" if Coq is not installed."""
    with TemporaryDirectory() as folder:
        about_code = [name for name in files() if name != STATEMENTS]
        return tuple(of_each(counted(about_code, progress), lambda name: _answered(name, Path(folder)), failures))


def files() -> list[str]:
    """Return the names of the files, each after those that it requires."""
    return sorted((path.stem for path in FOLDER.glob("*.v")), key=lambda name: (len(_required(name)), name))


@cache
def statements() -> dict[str, Theorem]:
    """Return the statements that Coq proves too, by name, with its answer."""
    with TemporaryDirectory() as folder:
        return {theorem.name: theorem for theorem in _answered(STATEMENTS, Path(folder))}


def _answered(name: str, folder: Path) -> tuple[Theorem, ...]:
    if lacking(name):
        return tuple(Theorem(one, NOT_RUN, says=said) for one, said in _asked(name).items())
    try:
        return compiled(name, folder)
    except IapbError as error:  # may be due to another version of Coq or Flocq, so it refutes nothing
        return tuple(Theorem(one, NO_ANSWER, (), str(error), said) for one, said in _asked(name).items())


def version() -> str:
    """Return the version of `coqc`, or "absent" if it is not installed."""
    return _run(["coqc", "--print-version"]).strip() if shutil.which("coqc") else "absent"


def lacking(name: str) -> str:
    """Return which program is missing to compile a file of the development; empty if none is."""
    if not shutil.which("coqc"):
        return "coqc is not installed"
    if "Flocq" in _source(name) and not Path(_run(["coqc", "-where"]).strip(), "user-contrib", "Flocq").exists():
        return "Flocq is not installed"
    return ""


def compiled(name: str, folder: Path) -> tuple[Theorem, ...]:
    """Compile a file in `folder` and return each theorem whose assumptions it prints.

    Raises
    ------
    MissingDependencyError
        Coq or Flocq is not installed.
    IapbError
        Coq refuses the file.
    """
    if reason := lacking(name):
        raise MissingDependencyError(reason.partition(" ")[0], "the Coq development", _HINT)
    for needed in _required(name):
        if not (folder / f"{needed}.vo").exists():
            compiled(needed, folder)
    shutil.copy(FOLDER / f"{name}.v", folder)
    said = _run(["coqc", "-q", f"{name}.v"], folder)
    asked, answers = _asked(name), _assumptions(said)
    if not asked or len(asked) != len(answers):
        raise IapbError(f"{name}.v asks for the assumptions of {len(asked)} theorems; Coq answers {len(answers)}")
    return tuple(Theorem(one, YES, axioms, says=asked[one]) for one, axioms in zip(asked, answers, strict=True))


def _source(name: str) -> str:
    return (FOLDER / f"{name}.v").read_text(encoding="utf-8")


def _required(name: str) -> list[str]:
    return re.findall(r"^Require Import (\w+)\.$", _source(name), re.MULTILINE)


def _asked(name: str) -> dict[str, str]:
    """Return the theorems whose assumptions a file prints, each with its description in English."""
    found = re.findall(r"^Print Assumptions (\w+)\.(?: \(\* ([^*]+) \*\))?", _source(name), re.MULTILINE)
    return {theorem: " ".join(english.split()) for theorem, english in found}


def _run(command: list[str], folder: Path | None = None) -> str:
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, encoding="utf-8", timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        raise IapbError(f"{' '.join(command)}: did not finish within {PATIENCE:g} s") from None
    if done.returncode:
        raise IapbError(f"{' '.join(command)}: {' '.join(done.stderr.split())}")
    return done.stdout


def _assumptions(said: str) -> list[tuple[str, ...]]:
    """Return the axioms that each `Print Assumptions` lists: the unindented lines after "Axioms:"."""
    answers = re.split(r"^(?:Axioms:|Closed under the global context)", said, flags=re.MULTILINE)[1:]
    return [tuple(sorted({line.split(":")[0].strip() for line in answer.splitlines() if line[:1].strip()}))
            for answer in answers]  # fmt: skip
