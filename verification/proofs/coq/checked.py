"""What Coq accepted: `make -C verification/proofs/coq` compiles the sources and writes it to
checked.json.

`Checker.v` verifies an exact judge of impacts and extracts it to OCaml; `checker.ml` reads the file
that `iapb certify --export` writes. `Passive.v`, `Accepted.v` and `Wide.v` prove with Flocq what
the resolver's last step accepts. `Theorems.v` states Theorems 1 and 2 and (33) by hand, for real
matrices of every size; it says of both theorems that no energy is added.

checked.json holds the version of Coq, the hash of each source, and the axioms of each theorem. If
the file is missing, or was made from other sources, Coq has not run. The Makefile calls this module
as a script, without the project's packages: it imports the standard library only.
"""

from __future__ import annotations

import hashlib
import json
import re
import sys
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path(__file__).parent
STATEMENTS = (
    "Theorems"  # the file with theorems that are also statements of the kernel, by the same names
)
NOT_RUN = "not run"
# Axioms that `Print Assumptions` may list: those from which Coq's library builds the real numbers,
# and classical logic (P or not P, for every P), which Flocq uses.
KNOWN_AXIOMS = frozenset(
    {
        "ClassicalDedekindReals.sig_forall_dec",
        "ClassicalDedekindReals.sig_not_dec",
        "FunctionalExtensionality.functional_extensionality_dep",
        "Classical_Prop.classic",
    }
)


@dataclass(frozen=True)
class Theorem:
    """A theorem of the development.

    Attributes
    ----------
    name : as in the source.
    file : the source without its ending.
    says : what it says, in the English of the comment beside it.
    axioms : the axioms that it uses; None if Coq has not run.
    """

    name: str
    file: str
    says: str
    axioms: tuple[str, ...] | None = None

    @property
    def holds(self) -> bool | None:
        """Whether Coq accepts it with axioms of KNOWN_AXIOMS only; None if Coq has not run."""
        return None if self.axioms is None else KNOWN_AXIOMS.issuperset(self.axioms)

    @property
    def coq(self) -> str:
        """Coq's answer for a table: it accepts every theorem of checked.json."""
        return NOT_RUN if self.axioms is None else "yes"


@dataclass(frozen=True)
class Development:
    """All theorems, and the version of Coq that checked them; empty if it has not run."""

    version: str
    theorems: tuple[Theorem, ...]

    @property
    def statements(self) -> dict[str, Theorem]:
        """Theorems that are also statements of the kernel, by name."""
        return {one.name: one for one in self.theorems if one.file == STATEMENTS}

    @property
    def about_code(self) -> tuple[Theorem, ...]:
        """Theorems about the code."""
        return tuple(one for one in self.theorems if one.file != STATEMENTS)


def read(folder: Path = FOLDER) -> Development:
    """Return the theorems of the sources in `folder`, with Coq's answers if checked.json was made
    from them."""
    stated = _stated(folder)
    path = folder / "checked.json"
    found = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    if found.get("sources") != hashes(folder):
        return Development("", stated)
    axioms = found["theorems"]
    theorems = tuple(
        Theorem(one.name, one.file, one.says, tuple(axioms[one.name])) for one in stated
    )
    return Development(found["version"], theorems)


def hashes(folder: Path = FOLDER) -> dict[str, str]:
    """Return sha256 of each source by its name."""
    return {
        path.name: hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.glob("*.v"))
    }


def write(version: str, folder: Path = FOLDER) -> None:
    """Write checked.json from what Coq printed for each source, in build/*.txt.

    Raises
    ------
    ValueError
        If Coq did not print the axioms of each theorem once.
    """
    axioms: dict[str, tuple[str, ...]] = {}
    for path in sorted(folder.glob("*.v")):
        names = [one.name for one in _stated(folder) if one.file == path.stem]
        printed = _axioms((folder / "build" / f"{path.stem}.txt").read_text(encoding="utf-8"))
        if not names or len(printed) != len(names):
            raise ValueError(
                f"{path.name} asks for the axioms of {len(names)} theorems; Coq prints {len(printed)}"
            )
        axioms |= dict(zip(names, printed, strict=True))
    content = {"version": version, "sources": hashes(folder), "theorems": axioms}
    (folder / "checked.json").write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def _stated(folder: Path) -> tuple[Theorem, ...]:
    """Return the theorems whose axioms the sources print, without Coq's answer."""
    found = []
    for path in sorted(folder.glob("*.v")):
        source = path.read_text(encoding="utf-8")
        printed = re.findall(
            r"^Print Assumptions (\w+)\.(?: \(\* ([^*]+) \*\))?", source, re.MULTILINE
        )
        found += [Theorem(name, path.stem, " ".join(english.split())) for name, english in printed]
    return tuple(found)


def _axioms(printed: str) -> list[tuple[str, ...]]:
    """Return the axioms that each `Print Assumptions` lists: the unindented lines after
    "Axioms:"."""
    answers = re.split(
        r"^(?:Axioms:|Closed under the global context)", printed, flags=re.MULTILINE
    )[1:]
    return [
        tuple(
            sorted({line.split(":")[0].strip() for line in answer.splitlines() if line[:1].strip()})
        )
        for answer in answers
    ]


if __name__ == "__main__":
    write(sys.argv[1])
