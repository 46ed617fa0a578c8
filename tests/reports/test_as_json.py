"""With --json a command prints one JSON object, with the keys of docs/scenes.md, and ends as it does without."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np
import pytest

from reports import cli
from reports.commands.answer import print_json
from verification.cost.impacts import Choice
from verification.finding import REPRODUCED, Finding, Part
from verification.proofs import all_proofs
from verification.proofs.coq_development import Theorem
from verification.table import Column, Table

ROOT = Path(__file__).parents[2]
SHORT = ("--set", "duration=0.4")
STUDY = "name: two\ntitle: Two\nscene: two_discs\nworlds: [IAPB]\ngrid:\n  contact.restitution: [0.0, 0.5]\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with one run."""
    place = tmp_path_factory.mktemp("json")
    assert cli.main(["run", "peg_corner", *SHORT, "--out", str(place)]) == 0
    return place


@pytest.fixture
def answer(capsys):
    """Run a command with --json; return its status and the object."""

    def call(*arguments):
        capsys.readouterr()
        status = cli.main([str(argument) for argument in (*arguments, "--json")])
        return status, json.loads(capsys.readouterr().out)

    return call


def listed(command: str) -> set[str]:
    """The keys that the documents list for a command: the words before what stands in brackets."""
    text = (ROOT / "docs" / "scenes.md").read_text(encoding="utf-8")
    (row,) = re.findall(rf"^\| `{command}` \| (.*) \|$", text, re.M)
    return {key.strip() for key in re.sub(r"\([^)]*\)|;.*", "", row).split(",")}


def test_run_and_inspect(answer, folder):
    status, ran = answer("run", "peg_corner", *SHORT, "--out", folder)
    assert status == 0 and set(ran) == listed("run")
    status, seen = answer("inspect", ran["file"], "--impacts", 2)
    assert status == 0 and len(seen["impacts"]) == min(2, seen["collisions"])
    assert {name: seen[name] for name in ("end", "steps", "collisions")} == {
        name: ran[name] for name in ("end", "steps", "collisions")}
    assert {"energy", "effects", "provenance", "run_key", "content_hash"} <= set(seen)


def test_check_and_effects(answer):
    status, found = answer("check", "peg_corner", "--set", "contact.stiffness=1e9")
    assert status == 3 and set(found) == listed("check")
    assert found["warnings"][0].keys() == {"kind", "where", "text"}
    status, found = answer("effects", "peg_corner", "--world", "ideal")
    assert status == 0 and set(found) == {"scene", "world", "effects"}
    assert {one["name"]: one["ignores"] for one in found["effects"]}["penalty_stiffness"] == "stiffness"


def test_certify_and_store(answer, folder):
    status, found = answer("certify", folder)
    assert status == 0 and found["passed"] and len(found["files"]) == 1
    (one,) = found["files"].values()
    assert one["gains"] == 0 and one["impacts"] > 0
    status, found = answer("store", "check", folder)
    assert status == 0 and found["count"] == {"whole": len(found["files"])}
    status, found = answer("store", "again", folder)
    assert status == 0 and found["same"] == 1 == len(found["files"])
    assert answer("store", "gc", folder)[1]["removed"] is False
    assert set(answer("store", "repair", folder)[1]) == {"files", "count", "logs", "aside"}
    damaged = next(folder.glob("*.h5"))
    damaged.write_bytes(damaged.read_bytes()[:5000])
    status, found = answer("store", "check", folder)
    assert status == 1 and found["count"]["damaged"] == 1


def standing_still(mass_matrix, contact_jacobian, velocity, restitution):
    """A resolver that breaks the law of restitution."""
    return 0.0 * velocity


def test_bench_and_figures(answer, tmp_path, monkeypatch):
    choice = Choice(5e-5, 4, 3, "factored", "all rows", "compiled", 1e-6, 1e-16, 1e-15, 1.0, 1.0)
    asked = []
    monkeypatch.setattr("reports.commands.bench.which_method", lambda *given: asked.append(given) or (choice,))
    status, found = answer("bench", "--budget", "50us", "--contacts", "7", "--coordinates", "3")
    assert asked == [(pytest.approx(5e-5), 7, 3)]
    assert status == 0 and found["choices"][0]["method"] == "factored"
    part, tables = Part("s", REPRODUCED), {"one": Table((Column("x"),), ((1,),))}
    finding = Finding("cost", "t", "q", "a", REPRODUCED, (part,), tables)
    monkeypatch.setattr("reports.commands.bench.haptic_study", lambda *_: finding)
    monkeypatch.setattr("reports.commands.bench.work_precision", lambda **_: Table((Column("y"),), ((2,),)))
    monkeypatch.setattr("reports.commands.bench.choices", lambda _: Table(()))
    status, found = answer("bench")
    assert status == 0 and set(found) == listed("bench")
    assert found["tables"] == {"one": [{"x": 1}], "methods on problems": [{"y": 2}]}
    status, found = answer("reproduce", "--figure", "fig02", "--out", tmp_path)
    assert status == 0 and found["drawings"] and all(Path(each).is_file() for each in found["drawings"])


def test_verify_and_prove(answer, tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    status, found = answer("verify", "--impacts", 20, "--laws", "kinetic_energy")
    assert status == 0 and set(found) == listed("verify") and found["passed"]
    assert [one["law"] for one in found["laws"]] == ["kinetic_energy"]
    recorded, again = tmp_path / "found", ("verify", "--full", "--impacts", 20, "--trajectories", 0)
    status, found = answer(*again, "--resolver", "tests.reports.test_as_json:standing_still", "--out", recorded)
    assert status == 1 and not found["passed"] and set(found) == listed("verify --full")
    assert {one["law"]: one["failures"] > 0 for one in found["laws"]["impacts"]}["restitution"]
    status, found = answer("verify", "--recheck", found["counterexamples"][0], "--allow-code")
    assert status == 1 and not found["passed"] and not found["laws"][0]["passed"]
    status, found = answer("prove", next(iter(all_proofs())))
    assert status == 0 and set(found) == listed("prove")
    assert [one["verdict"] for one in found["statements"]] == ["proved"]
    refused = Theorem("sign_kept", "yes", ("an_axiom_of_its_own",))
    monkeypatch.setattr("reports.commands.prove.theorems", lambda: (refused,))
    monkeypatch.setattr("reports.commands.prove.all_proofs", lambda: ())
    status, found = answer("prove", "--second-tool")
    assert status == 1 and found["theorems"][0]["verdict"] == "refused"
    assert found["theorems"][0]["axioms"] == ["an_axiom_of_its_own"]


def test_sweep(answer, tmp_path):
    study = tmp_path / "two.yaml"
    study.write_text(STUDY, encoding="utf-8")
    status, found = answer("sweep", study, "--workers", 1, "--out", tmp_path / "sweeps")
    assert status == 0 and set(found) == listed("sweep")
    assert len(found["points"]) == 2 == found["computed"] and Path(found["table"]).is_file()


def test_live(answer, tmp_path):
    status, found = answer("live", "peg_corner", "--seconds", 0.05, "--rate", 512, "--out", tmp_path)
    assert status == 0 and {"ticks", "missed", "run", "timetable", "stopped"} <= set(found)
    assert Path(found["run"]).is_file()


def test_scenes_of_rigid_worlds_say_what_they_cost(answer, capsys):
    many = [{"name": f"b{i}", "joint": "planar", "mass": 1.0, "inertia": 1e-3, "position": [0.11 * i, 0.05, 0.0],
             "shapes": [{"kind": "circle", "radius": 0.05}]} for i in range(330)]
    some = ("--set", f"bodies={json.dumps(many[:60])}", "--set", "walls=[]", "--set", "duration=10")
    base = ("wall_1d", "--set", "hand=null", "--set", "device=null", "--set", "couplings={}")
    _, found = answer("check", *base, *some, "--world", "ideal")
    assert any("1,770 contacts of 180 coordinates in each step, about" in said for said in found["remarks"])
    assert not answer("check", *base, *some)[1]["remarks"]
    everything = ("--set", f"bodies={json.dumps(many)}", "--set", "walls=[]", "--set", "duration=0.01")
    status, found = answer("check", *base, *everything, "--world", "ideal")
    assert status == 3 and "size" in {one["kind"] for one in found["warnings"]}
    capsys.readouterr()
    assert cli.main(["run", *base, *everything, "--world", "ideal", "--out", "/nonexistent"]) == 1


class _Colour(Enum):
    RED = "red"


@dataclass
class _Record:
    path: Path
    sizes: tuple[float, ...]


def test_plain_values_of_all_kinds(capsys):
    print_json({"a": np.array([1.0, np.nan]), 2: _Record(Path("x"), (float("inf"), 1.5)), "c": _Colour.RED,
                "d": np.int64(3), "e": None, "f": True})
    assert json.loads(capsys.readouterr().out) == {
        "a": [1.0, None], "2": {"path": "x", "sizes": [None, 1.5]}, "c": "red", "d": 3, "e": None, "f": True}
