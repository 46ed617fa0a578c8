"""Coq accepts the development without assumptions beyond the reals; its extracted checker judges as our judge does."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from iapb.advice.certificate import EXPORT_HEAD, exported, judge_gains
from iapb.errors import IapbError
from verification.finding import NOT_COMPUTED, NOT_TESTABLE, REFUTED, REPRODUCED
from verification.proofs import all_proofs, coq_development, on_proofs
from verification.proofs import coq_development as coq
from verification.proofs.show import YES

IMPACTS = 1_500  # a hundred thousand were judged alike once: see docs/report.md
needs_ocaml = pytest.mark.skipif(
    bool(coq.lacking("Checker")) or shutil.which("ocamlopt") is None, reason="coqc or ocamlopt is not installed")


@pytest.fixture(scope="module")
def checker(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("checker")
    coq.compiled("Checker", folder)
    shutil.copy(coq.FOLDER / "checker.ml", folder)
    subprocess.run(["ocamlopt", "judge.mli", "judge.ml", "checker.ml", "-o", "checker"], cwd=folder, check=True)
    return folder / "checker"


def near_the_border(n: int, d: int, rng: np.random.Generator, decades: float) -> tuple[np.ndarray, ...]:
    """M asymmetric in the last bit, v and w = ±v with one unit in the last place planted in one entry: gain or loss."""
    root = rng.normal(size=(n, d, d))
    mass = np.nextafter(root @ root.transpose(0, 2, 1), np.where(rng.random((n, d, d)) < 0.5, np.inf, -np.inf))
    v = rng.normal(size=(n, d)) * 10.0 ** rng.uniform(-decades, decades, (n, 1))
    w = np.where(rng.random((n, 1)) < 0.5, v, -v)
    entry, towards = rng.integers(0, d, n), np.where(rng.random(n) < 0.5, np.inf, -np.inf)
    w[np.arange(n), entry] = np.nextafter(w[np.arange(n), entry], towards)
    same = rng.random(n) < 0.1  # w = −v gains nothing and loses nothing
    w[same] = -v[same]
    return mass, v, w


@needs_ocaml
def test_the_extracted_checker_judges_as_the_exact_judge_does(checker: Path, tmp_path: Path) -> None:
    rng, lines, gained = np.random.default_rng(11), [EXPORT_HEAD], []
    for d, decades in ((3, 0.0), (3, 150.0), (1, 300.0), (6, 10.0)):
        impacts = near_the_border(IMPACTS // 4, d, rng, decades)
        lines += exported(*impacts)
        gained += judge_gains(*impacts).gained.tolist()
    lines += [f"1 1 0 {2**62 - 1} 0 {1 - 2**62} 0", f"end {len(gained) + 1}"]  # the largest number that OCaml holds
    gained.append(False)
    (tmp_path / "impacts.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    done = subprocess.run([checker, tmp_path / "impacts.txt"], capture_output=True, text=True)
    *answers, total = done.stdout.splitlines()
    assert [answer == "no" for answer in answers] == gained and 0.3 * IMPACTS < sum(gained) < 0.6 * IMPACTS
    assert done.returncode == 1 and total == f"{len(gained)} impacts: {sum(gained)} gained energy"


IMPACT = f"{EXPORT_HEAD}\n1 1 0 1 0 1 0\n"
WRAPPED = ("0x7fffffffffffffff", "0u9223372036854775807", "0b1", "0o7", "1_0", "+1", "-", "--1", "1\r",
           "4611686018427387904", "-4611686018427387904")  # fmt: skip


@needs_ocaml
@pytest.mark.parametrize(("text", "said"), [
    ("", "line 1: the file is cut"), ("1 1 0 1 0 1 0\n", "first line"),
    (f"{EXPORT_HEAD}\n1 1 0 1 0 1\n", "line 2: too few"), (f"{EXPORT_HEAD}\n", "line 2: the file is cut"),
    (IMPACT, "line 3: the file is cut"), (f"{IMPACT}end 2\n", '"end 2", but 1 impacts'),
    (f"{EXPORT_HEAD}\nend\n", '"end", but 0'), (f"{EXPORT_HEAD}\nend 0\n1 1 0 1 0 2 0\n", "line 3: a line after"),
    (f"{EXPORT_HEAD}\n1 1 0 1 0 1 0 5\n", "too many"), (f"{EXPORT_HEAD}\n1 0.5 0 1 0 1 0\n", "whole number"),
    (f"{EXPORT_HEAD}\n\n", "empty line"), (f"{EXPORT_HEAD}\n0\n", "below 1"),
    *((f"{EXPORT_HEAD}\n1 1 0 1 0 {word} 0\nend 1\n", "line 2: no whole number") for word in WRAPPED)])  # fmt: skip
def test_what_is_no_file_of_impacts_is_refused(checker: Path, tmp_path: Path, text: str, said: str) -> None:
    """A literal that OCaml wraps to −1 would hide a gain: M = 1, v = 1, w = 2⁶³ − 1."""
    (tmp_path / "impacts.txt").write_bytes(text.encode())
    done = subprocess.run([checker, tmp_path / "impacts.txt"], capture_output=True, text=True)
    assert done.returncode == 2 and said in done.stderr and (said != "line 2: no whole number" or not done.stdout)


def test_exported_integers_are_the_doubles() -> None:
    mass, v, w = np.array([[2.0, 5e-324], [-0.0, 1e308]]), np.array([[1.5, -0.1]]), np.array([[0.0, 3.0]])
    (line,) = exported(mass, v, w)
    size, *numbers = map(int, line.split())
    values = [np.ldexp(float(m), e) for m, e in zip(numbers[::2], numbers[1::2], strict=True)]
    assert size == 2 and values == [*mass.ravel(), *v.ravel(), *w.ravel()]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("built")


@pytest.mark.thorough
@pytest.mark.parametrize("name", coq.files())
def test_coq_accepts_the_development_and_assumes_the_reals_alone(name: str, built: Path) -> None:
    source = (coq.FOLDER / f"{name}.v").read_text(encoding="utf-8")
    assert not any(word in source for word in ("Admitted", "admit.", "Axiom ", "Parameter ", "Abort"))
    if reason := coq.lacking(name):
        pytest.skip(reason)
    found = coq.compiled(name, built)
    assert found and all(theorem.holds for theorem in found), found
    if name == coq.STATEMENTS:
        assert {theorem.name for theorem in found} < set(all_proofs())
    else:
        assert all(theorem.says for theorem in found)  # about the code: each has its English


@pytest.mark.parametrize(("now", "then"), [
    ("(one - e * e) * form", "(one - e) * form"), ("opp (e * J * v)", "e * J * v"), ("W * G * W = W", "W * G * W = G")])
def test_coq_refuses_a_corrupted_statement(now: str, then: str, tmp_path: Path,
                                           monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    if reason := coq.lacking(coq.STATEMENTS):
        pytest.skip(reason)
    source = (coq.FOLDER / f"{coq.STATEMENTS}.v").read_text(encoding="utf-8")
    assert now in source
    (tmp_path / "out").mkdir()
    (tmp_path / f"{coq.STATEMENTS}.v").write_text(source.replace(now, then), encoding="utf-8")
    monkeypatch.setattr(coq_development, "FOLDER", tmp_path)
    with pytest.raises(IapbError, match="Theorems.v.*Error"):
        coq.compiled(coq.STATEMENTS, tmp_path / "out")


def test_an_axiom_of_ones_own_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if reason := coq.lacking("Checker"):
        pytest.skip(reason)
    (tmp_path / "Wrong.v").write_text(
        "Axiom easy : forall n : nat, n = 0.\nTheorem all : 1 = 0.\nProof. apply easy. Qed.\nPrint Assumptions all.\n")
    (tmp_path / "Open.v").write_text("Theorem all : 1 = 0.\nProof. reflexivity. Qed.\nPrint Assumptions all.\n")
    (folder := tmp_path / "out").mkdir()
    monkeypatch.setattr(coq_development, "FOLDER", tmp_path)
    (theorem,) = coq.compiled("Wrong", folder)
    assert theorem == coq.Theorem("all", YES, ("easy",)) and theorem.holds is False
    with pytest.raises(IapbError, match="Unable to unify"):
        coq.compiled("Open", folder)


def test_coq_that_fails_refutes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A library that is not where this version of Coq looks for it, say: no answer, with Coq's own words."""
    if reason := coq.lacking("Checker"):
        pytest.skip(reason)
    (tmp_path / "Moved.v").write_text(
        "From Coq Require Import NoSuchLibrary.\nTheorem all : 1 = 1.\nProof. trivial. Qed.\nPrint Assumptions all.\n")
    monkeypatch.setattr(coq_development, "FOLDER", tmp_path)
    (theorem,) = coq.theorems()
    assert theorem.coq == coq.NO_ANSWER and theorem.holds is None and "NoSuchLibrary" in theorem.error


def test_without_coq_nothing_is_claimed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    found = coq.theorems(lambda *done: None, [])
    assert len(found) >= 6 and {theorem.coq for theorem in found} == {coq.NOT_RUN}
    finding = on_proofs([], (), found)
    assert "not checked here" in finding.answer and finding.parts[1].verdict == NOT_TESTABLE
    assert finding.parts[1].optional and finding.verdict == finding.parts[0].verdict


@pytest.mark.parametrize(("answer", "axioms", "verdict"), [
    (YES, ("Classical_Prop.classic",), REPRODUCED), (YES, ("easy",), REFUTED),
    (coq.NO_ANSWER, (), NOT_COMPUTED), (coq.NOT_RUN, (), NOT_COMPUTED)])  # fmt: skip
def test_a_refused_theorem_or_a_strange_axiom_refutes(answer: str, axioms: tuple[str, ...], verdict: str) -> None:
    finding = on_proofs([], (), [coq.Theorem("check_sound", YES), coq.Theorem("compensated", answer, axioms)])
    assert finding.parts[1].verdict == verdict
