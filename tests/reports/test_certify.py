"""`iapb certify` judges run files and archives of any engine, and ends with 1 where an impact gained energy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from iapb import find_scene, load_scene, simulate
from reports.cli import main
from reports.store.runs import write_run


def archive(path: Path, gain: bool) -> Path:
    """Two impacts of a recorder elsewhere; the second gains one unit in the last place."""
    v = np.array([[1.0, -2.0], [0.3, 0.7]])
    after = -v
    if gain:
        after[1, 0] = np.nextafter(after[1, 0], -np.inf)
    np.savez(path, mass_matrix=np.diag([2.0, 3.0]), v_minus=v, v_plus=after)
    return path


def test_runs_and_archives_are_certified(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_run(tmp_path / "run.h5", simulate(load_scene(find_scene("wall_1d"))))
    assert main(["certify", str(tmp_path), str(archive(tmp_path / "other.npz", False))]) == 0
    said = capsys.readouterr().out
    assert "of 2 files: 0 gained energy (exact)" in said and "run.h5" in said


def test_impacts_of_runs_and_archives_are_exported_as_integers(tmp_path: Path) -> None:
    run = simulate(load_scene(find_scene("newton_cradle")), steps=400)
    write_run(tmp_path / "run.h5", run)
    np.savez(tmp_path / "other.npz", mass_matrix=[[1.0]], v_minus=[[1.5]], v_plus=[[-1.5]])
    files = str(tmp_path / "run.h5"), str(tmp_path / "other.npz")
    assert main(["certify", *files, "--export", str(tmp_path / "impacts.txt")]) == 0
    head, *impacts, end = (tmp_path / "impacts.txt").read_text(encoding="utf-8").splitlines()
    assert head == "iapb impacts 2" and len(impacts) == len(run.impacts.step) + 1 > 1 and end == f"end {len(impacts)}"
    size, *numbers = map(float, impacts[-1].split())
    assert size == 1.0 and [m * 2.0**e for m, e in zip(numbers[::2], numbers[1::2], strict=True)] == [1.0, 1.5, -1.5]
    d, *numbers = map(int, impacts[0].split())
    after = [np.ldexp(float(m), e) for m, e in zip(numbers[-2 * d::2], numbers[-2 * d + 1::2], strict=True)]
    assert after == run.impacts.v_plus[0].tolist()


def test_export_destroys_neither_its_input_nor_an_older_export(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    given, export = archive(tmp_path / "other.npz", False), tmp_path / "impacts.txt"
    before = given.read_bytes()
    (tmp_path / "link.txt").symlink_to(given)
    (tmp_path / "hard.txt").hardlink_to(given)
    for name in ("other.npz", "link.txt", "hard.txt", "."):
        assert main(["certify", str(given), "--export", str(tmp_path / name)]) == 1
        assert "--export" in capsys.readouterr().err and given.read_bytes() == before
    assert main(["certify", str(given), str(given), "--export", str(export)]) == 0
    whole = export.read_text(encoding="utf-8")
    assert whole.splitlines()[3:] == ["end 2"]  # a file that is named twice is judged and exported once
    assert main(["certify", str(given), str(tmp_path / "absent.npz"), "--export", str(export)]) == 1
    assert export.read_text(encoding="utf-8") == whole
    assert not list(tmp_path.glob(".*"))  # nothing is left aside


def test_a_gain_of_the_last_bit_is_shown_and_ends_with_1(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["certify", str(archive(tmp_path / "other.npz", True))]) == 1
    said = capsys.readouterr().out
    assert "2 impacts of 1 file: 1 gained energy (exact)" in said
    assert "Impact 1 of" in said and "Fraction" in said


def test_what_holds_no_impacts_is_refused_by_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    np.savez(tmp_path / "half.npz", v_minus=np.ones((1, 2)))
    (tmp_path / "text.npz").write_text("no archive", encoding="utf-8")
    (tmp_path / "empty.npz").touch()
    with (tmp_path / "array.npz").open("wb") as file:
        np.save(file, np.ones(2))
    whole = archive(tmp_path / "whole.npz", False).read_bytes()
    (tmp_path / "cut.npz").write_bytes(whole[: len(whole) // 2])
    for name, reason in (("half.npz", "mass_matrix, v_plus missing"), ("text.npz", "no archive"),
                         ("empty.npz", "no archive"), ("array.npz", "no archive"), ("cut.npz", "no archive")):
        assert main(["certify", str(tmp_path / name)]) == 1
        assert reason in capsys.readouterr().err
