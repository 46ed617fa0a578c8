"""What goes beside the report: true to the byte, described as RO-Crate 1.1 asks for, and silent about the machine."""

import json
import re
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from iapb.scene import find_scene, load_scene
from reports import provenance, report
from reports.crate import CRATE_NAME, PROFILE, sha256
from reports.evidence import gather
from reports.evidence.gather import ABSENT, manifest
from reports.evidence.stage import Stage
from reports.figures.figure import Figure, Panel
from reports.numbers_file import NUMBERS_NAME, read_numbers
from reports.pages.builder import FIRST_PAGE, build_report
from reports.pages.records import Evidence
from reports.report import DIRTY_NAME, write_companions, write_report
from reports.runner import Runner
from verification.finding import REPRODUCED, Finding, Part, finding_of
from verification.table import titled

PANEL = Panel("<svg viewBox='0 0 1 1'></svg>", "nothing")
FIGURE = Figure("figA", "", "A", "See.", (PANEL,), titled(("x",), ((0.1,),)))


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    """A small report from two runs and one stage, with everything beside it, made with uncommitted changes."""
    folder = tmp_path_factory.mktemp("elsewhere")
    scene, runner = load_scene(find_scene("peg_corner")).with_values({"duration": 0.4}), Runner(folder / "runs")

    def compute(failures):
        runner.user = "C07"
        runner(scene, "PB")
        runner(scene.with_values({"name": "own"}), "PB")
        table = titled(("κ", "gain"), ((1e3, 2e-16),))
        return (finding_of("C07", "C07", "s", "h", (Part("p", REPRODUCED),), {"C07": table}),)

    stage = Stage(folder / "tables", "claims", tuple[Finding, ...], "quick").fill(runner, compute)
    with pytest.MonkeyPatch.context() as patch:
        words = [str(folder / "bin" / "iapb"), "reproduce", "--out", str(folder), f"--check={folder}"]
        patch.setattr(sys, "argv", words)
        patch.setattr(report, "uncommitted_changes", lambda: "--- a/iapb/x.py\n+++ b/iapb/x.py")
        evidence = Evidence(inputs={"bulk": titled(("n",), ((3,),))}, claims=stage.records,
                            provenance=gather.provenance(), manifest=manifest(runner.used, [stage], folder))
        write_report(folder, build_report(evidence, [FIGURE]))
        write_companions(folder, evidence, [FIGURE], "quick")
    return folder


def references(value):
    """Every entity that an entity refers to: a mapping with nothing but an @id."""
    if isinstance(value, dict):
        if set(value) == {"@id"}:
            yield value["@id"]
        value = list(value.values())
    for item in value if isinstance(value, list) else ():
        yield from references(item)


def test_the_crate_says_what_ro_crate_1_1_asks_for_and_names_every_file_with_size_and_hash(out):
    crate = json.loads((out / CRATE_NAME).read_text())
    assert crate["@context"][0] == f"{PROFILE}/context"
    entities = {entity["@id"]: entity for entity in crate["@graph"]}
    assert len(entities) == len(crate["@graph"]) and entities[CRATE_NAME]["about"] == {"@id": "./"}
    assert not {name for name in references(crate["@graph"]) if name not in entities and not name.startswith("https")}
    root, action = entities["./"], entities["#reproduce"]
    assert {"@type", "name", "description", "datePublished", "author"} <= set(root)
    on_disk = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()}
    parts = {part["@id"] for part in root["hasPart"]}
    assert parts == on_disk - {CRATE_NAME}
    assert parts == {part["@id"] for part in action["result"]} and "claims 20050601" in action["description"]
    files = [entity for entity in crate["@graph"] if entity["@type"] == "File"]
    for entity in files:
        path = out / entity["@id"]
        assert (int(entity["contentSize"]), entity["sha256"]) == (path.stat().st_size, sha256(path))
    commands = [entity["description"] for entity in files if entity["@id"].startswith("runs/")]
    assert any("iapb run peg_corner --set duration=0.4 --world PB" in text and "C07" in text for text in commands)
    needs = entities["#iapb"]["softwareRequirements"]
    assert f"lock {provenance.lock_hash()}" in needs and any(need.startswith("mujoco ") for need in needs)


def test_the_manifest_lists_each_run_and_the_numbers_are_those_of_tables_and_figures(out, tmp_path):
    page = (out / "report" / "manifest.html").read_text()
    assert "2 runs and 1 tables" in page and "iapb run peg_corner" in page and "iapb store again " in page
    numbers = read_numbers(out)
    assert numbers.tables["claims/C07"].rows == ((1e3, 2e-16),)
    assert numbers.tables["figures/figA"].rows == ((0.1,),) and numbers.tables["inputs/bulk"].rows == ((3,),)
    assert list(numbers.runs)[0] == "iapb run peg_corner --set duration=0.4 --world PB"
    runner = Runner(tmp_path / "runs")
    runner(load_scene(find_scene("peg_corner")).with_values({"duration": 0.1}), "PB")
    [used] = runner.used.values()
    (tmp_path / "runs" / used.file).unlink()  # a run that was removed is said to be absent
    assert [listed.status for listed in manifest(runner.used, [], tmp_path)] == [ABSENT]


def test_nothing_says_on_which_machine_it_was_made(out):
    host = re.compile(rf"\b{re.escape(socket.gethostname())}\b")
    pages = [path.relative_to(out) for path in (out / "report").iterdir()]
    for name in (FIRST_PAGE, *pages, NUMBERS_NAME, CRATE_NAME):
        text = (out / name).read_text()
        assert not [path for path in (out, provenance._ROOT, f"{Path.home()}/") if str(path) in text]
        assert not host.search(text) or len(socket.gethostname()) < 4, name  # "x86" would be found in any page


@pytest.mark.parametrize(("word", "kept"), [
    ("--out=/srv/data/out", "--out=out"), ("/srv/data/out", "out"), ("../../her/out", "out"), ("out/runs", "out/runs"),
    ("--set", "--set"), ("rate=1/512", "rate=1/512"), ("--check=../r.html", "--check=r.html")])  # fmt: skip
def test_paths_of_a_machine_are_cut_from_the_command(word, kept, monkeypatch):
    for program in ("/srv/bin/iapb", str(provenance._ROOT / "reports" / "cli.py")):
        monkeypatch.setattr(sys, "argv", [program, "run", word])
        assert provenance.current_command() == f"iapb run {kept}"


def test_uncommitted_changes_are_a_patch_with_new_files_until_they_are_committed(tmp_path, monkeypatch):
    def git(*words):
        subprocess.run(["git", "-C", str(tmp_path), "-c", "user.name=n", "-c", "user.email=e@e", *words], check=True,
                       capture_output=True)  # fmt: skip

    monkeypatch.setattr(provenance, "_ROOT", tmp_path)
    assert provenance.uncommitted_changes() is None and provenance._dirty() == provenance.UNKNOWN
    (tmp_path / "iapb").mkdir()
    (tmp_path / "iapb" / "old.py").write_text("a = 1\n")
    git("init", "-q")
    git("add", ".")
    git("commit", "-q", "-m", "one")
    for name in ("notes.txt", FIRST_PAGE, DIRTY_NAME):
        (tmp_path / name).write_text("not a source")
    assert provenance.uncommitted_changes() == "" and provenance._dirty() == "false"
    assert DIRTY_NAME not in [path.name for path in write_companions(tmp_path, Evidence(), (), "quick")]
    assert not (tmp_path / DIRTY_NAME).exists()
    (tmp_path / "iapb" / "old.py").write_text("a = 2\n")
    (tmp_path / "iapb" / "new.py").write_text("b = 3\n")
    patch = provenance.uncommitted_changes() or ""
    assert "+a = 2" in patch and "+b = 3" in patch and str(tmp_path) not in patch and provenance._dirty() == "true"
