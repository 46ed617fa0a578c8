"""checked.json holds what Coq accepted for these sources; the extracted checker judges as our judge
does."""

from __future__ import annotations

import json
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.verification.test_certificate import near_the_border
from verification.certificate import EXPORT_HEAD, exported, judge_gains
from verification.finding import REFUTED, REPRODUCED
from verification.numbers import read_values
from verification.proofs import all_proofs, on_proofs
from verification.proofs.coq import checked

IMPACTS = 1_500  # a hundred thousand were judged alike once: see docs/certificate.md
needs_coq = pytest.mark.skipif(shutil.which("coqc") is None, reason="coqc is not installed")
needs_ocaml = pytest.mark.skipif(
    shutil.which("coqc") is None or shutil.which("ocamlopt") is None,
    reason="coqc or ocamlopt is not installed",
)


def make(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["make", "-C", folder, *arguments], capture_output=True, text=True)


def development(folder: Path, **sources: str) -> Path:
    """Return a folder with the Makefile, checked.py and these sources, instead of those of the
    project."""
    for name in ("Makefile", "checked.py"):
        shutil.copy(checked.FOLDER / name, folder)
    for name, source in sources.items():
        (folder / f"{name}.v").write_text(source, encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def checker(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("checker")
    development(folder, Checker=(checked.FOLDER / "Checker.v").read_text(encoding="utf-8"))
    shutil.copy(checked.FOLDER / "checker.ml", folder)
    done = make(folder, "checker")
    assert done.returncode == 0, done.stderr
    return folder / "build" / "checker"


@needs_ocaml
def test_the_extracted_checker_judges_as_the_exact_judge_does(
    checker: Path, tmp_path: Path
) -> None:
    rng = np.random.default_rng(11)
    lines = [EXPORT_HEAD]
    gained = []
    for d, decades in ((3, 0.0), (3, 150.0), (1, 300.0), (6, 10.0)):
        impacts = near_the_border(IMPACTS // 4, d, rng, decades)
        lines += exported(*impacts)
        gained += judge_gains(*impacts).gained.tolist()
    # the largest number that OCaml holds
    lines += [f"1 1 0 {2**62 - 1} 0 {1 - 2**62} 0", f"end {len(gained) + 1}"]
    gained.append(False)
    (tmp_path / "impacts.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    done = subprocess.run([checker, tmp_path / "impacts.txt"], capture_output=True, text=True)
    *answers, total = done.stdout.splitlines()
    assert [answer == "no" for answer in answers] == gained and 0.3 * IMPACTS < sum(
        gained
    ) < 0.6 * IMPACTS
    assert done.returncode == 1 and total == f"{len(gained)} impacts: {sum(gained)} gained energy"


IMPACT = f"{EXPORT_HEAD}\n1 1 0 1 0 1 0\n"
WRAPPED = (
    "0x7fffffffffffffff",
    "1\r",
    "4611686018427387904",
)


@needs_ocaml
@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "line 1: the file is cut"),
        (f"{EXPORT_HEAD}\n1 1 0 1 0 1\n", "line 2: too few"),
        (IMPACT, "line 3: the file is cut"),
        (f"{IMPACT}end 2\n", '"end 2", but 1 impacts'),
        (f"{EXPORT_HEAD}\nend 0\n1 1 0 1 0 2 0\n", "line 3: a line after"),
        (f"{EXPORT_HEAD}\n1 0.5 0 1 0 1 0\n", "whole number"),
        (f"{EXPORT_HEAD}\n0\n", "below 1"),
        *(
            (f"{EXPORT_HEAD}\n1 1 0 1 0 {word} 0\nend 1\n", "line 2: no whole number")
            for word in WRAPPED
        ),
    ],
)
def test_what_is_no_file_of_impacts_is_refused(
    checker: Path, tmp_path: Path, text: str, said: str
) -> None:
    """A literal that OCaml wraps to −1 would hide a gain: M = 1, v = 1, w = 2⁶³ − 1."""
    (tmp_path / "impacts.txt").write_bytes(text.encode())
    done = subprocess.run([checker, tmp_path / "impacts.txt"], capture_output=True, text=True)
    assert (
        done.returncode == 2
        and said in done.stderr
        and (said != "line 2: no whole number" or not done.stdout)
    )


def test_exported_integers_are_the_doubles() -> None:
    mass = np.array([[2.0, 5e-324], [-0.0, 1e308]])
    v = np.array([[1.5, -0.1]])
    w = np.array([[0.0, 3.0]])
    (line,) = exported(mass, v, w)
    size, *numbers = map(int, line.split())
    values = [np.ldexp(float(m), e) for m, e in zip(numbers[::2], numbers[1::2], strict=True)]
    assert size == 2 and values == [*mass.ravel(), *v.ravel(), *w.ravel()]


@needs_coq
@pytest.mark.thorough
def test_coq_accepts_the_development_and_assumes_the_reals_alone() -> None:
    sources = [path.read_text(encoding="utf-8") for path in checked.FOLDER.glob("*.v")]
    assert not any(
        word in source
        for word in ("Admitted", "admit.", "Axiom ", "Parameter ", "Abort")
        for source in sources
    )
    done = make(checked.FOLDER)
    if "Cannot find a physical path" in done.stderr:
        pytest.skip("Flocq is not installed")
    found = checked.read()
    assert done.returncode == 0 and found.version, done.stderr
    assert all(theorem.holds for theorem in found.theorems) and all(
        theorem.says for theorem in found.about_code
    )
    assert {"theorem_1", "theorem_2"} <= set(found.statements) < set(all_proofs())


@needs_coq
@pytest.mark.parametrize(
    ("now", "then"),
    [
        ("(1 - e * e) / 2 * dot (J *v v) (G", "(1 - e * e) * dot (J *v v) (G"),
        ("energy M w <= energy M v", "energy M v <= energy M w"),
    ],
)
def test_coq_refuses_a_corrupted_statement(now: str, then: str, tmp_path: Path) -> None:
    source = (checked.FOLDER / "Theorems.v").read_text(encoding="utf-8")
    assert now in source
    done = make(development(tmp_path, Theorems=source.replace(now, then)))
    assert done.returncode != 0 and "Error" in done.stderr
    assert not (tmp_path / "checked.json").exists() and not checked.read(tmp_path).version


@needs_coq
def test_an_axiom_of_ones_own_is_noticed(tmp_path: Path) -> None:
    source = "Axiom easy : forall n : nat, n = 0.\nTheorem all : 1 = 0.\nProof. apply easy. Qed.\n"
    done = make(development(tmp_path, Wrong=source + "Print Assumptions all. (* one is zero *)\n"))
    found = checked.read(tmp_path)
    assert done.returncode == 0 and found.theorems == (
        checked.Theorem("all", "Wrong", "one is zero", ("easy",)),
    )
    assert found.theorems[0].holds is False
    (tmp_path / "Wrong.v").write_text(source, encoding="utf-8")  # no theorem is asked for
    assert make(tmp_path).returncode != 0


SOURCES = {
    "Code": "Print Assumptions all. (* 1 = 1 *)\n",
    "Theorems": "Print Assumptions theorem_1.\n",
}


def test_an_answer_for_other_sources_counts_as_has_not_run(tmp_path: Path) -> None:
    folder = development(tmp_path, **SOURCES)
    absent = checked.read(folder)
    content = {
        "version": "8.16.1",
        "sources": checked.hashes(folder),
        "theorems": {"all": [], "theorem_1": []},
    }
    (folder / "checked.json").write_text(json.dumps(content), encoding="utf-8")
    found = checked.read(folder)
    assert found.version == "8.16.1" and all(theorem.holds for theorem in found.theorems)
    assert [theorem.name for theorem in found.about_code] == ["all"] and set(found.statements) == {
        "theorem_1"
    }
    (folder / "Code.v").write_text("Print Assumptions all. (* 1 = 2 *)\n", encoding="utf-8")
    stale = checked.read(folder)
    for other in (absent, stale):
        assert not other.version and [theorem.holds for theorem in other.theorems] == [None, None]
    finding = on_proofs([], development=stale)
    quoted = read_values(finding.tables)
    assert quoted["coq"] is quoted["theorems_by_coq"] is None and quoted["theorems"] == 1
    assert len(finding.parts) == 1


@pytest.mark.parametrize(
    ("axioms", "verdict"), [(("Classical_Prop.classic",), REPRODUCED), (("easy",), REFUTED)]
)
def test_a_strange_axiom_refutes(axioms: tuple[str, ...], verdict: str) -> None:
    theorem = checked.Theorem("check_sound", "Checker", "", ())
    others = replace(theorem, name="compensated", axioms=axioms)
    finding = on_proofs([], development=checked.Development("8.16.1", (theorem, others)))
    assert finding.parts[1].verdict == verdict
    assert finding.tables["theorems about the code"]["Coq"] == ["yes", "yes"]
