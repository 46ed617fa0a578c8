"""What goes beside the report: true to the byte, described as RO-Crate 1.1 asks for, and silent
about the machine."""

import json
import re
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from iapb.scene import find_scene, load_scene
from reports import provenance
from reports.evidence import gather
from reports.evidence.stage import Stage
from reports.figures.figure import Figure, Panel
from reports.pages.builder import build_report
from reports.pages.crate import CRATE_NAME
from reports.pages.numbers_file import NUMBERS_NAME, read_numbers
from reports.pages.page import FIRST_PAGE
from reports.pages.records import Evidence
from reports.pages.report import write_companions, write_report
from reports.runner import Runner
from verification.finding import REPRODUCED, Finding, Part, finding_of
from verification.table import titled

PANEL = Panel("<svg viewBox='0 0 1 1'></svg>", "nothing")
FIGURE = Figure("figA", "", "A", "See.", (PANEL,), titled(("x",), ((0.1,),)))


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    """A small report from two runs and one stage, with everything beside it."""
    folder = tmp_path_factory.mktemp("elsewhere")
    scene = load_scene(find_scene("peg_corner")).with_values({"duration": 0.4})
    runner = Runner(folder / "runs")

    def compute(failures):
        runner.user = "C07"
        runner(scene, "PB")
        runner(scene.with_values({"name": "own"}), "PB")
        table = titled(("κ", "gain"), ((1e3, 2e-16),))
        return (finding_of("C07", "C07", "s", (Part("p", REPRODUCED),), {"C07": table}),)

    stage = Stage(folder / "tables", "claims", tuple[Finding, ...], "quick").fill(runner, compute)
    with pytest.MonkeyPatch.context() as patch:
        words = [
            str(folder / "bin" / "iapb"),
            "reproduce",
            "--out",
            str(folder),
        ]
        patch.setattr(sys, "argv", words)
        evidence = Evidence(
            inputs={"bulk": titled(("n",), ((3,),))},
            claims=stage.records,
            provenance=gather.provenance(),
            runs=tuple(runner.used.values()),
        )
        write_report(folder, build_report(evidence, [FIGURE]))
        write_companions(folder, evidence, [FIGURE], "quick")
    return folder


def test_the_crate_names_the_report_the_numbers_and_the_runs(out):
    crate = json.loads((out / CRATE_NAME).read_text())
    entities = {entity["@id"]: entity for entity in crate["@graph"]}
    report = entities["./"]
    assert report["datePublished"] and len(report["version"]) == 40
    parts = [part["@id"] for part in report["hasPart"]]
    assert parts == [FIRST_PAGE, "report/", NUMBERS_NAME, "runs/"]
    assert all((out / name).exists() and name in entities for name in parts)


def test_the_numbers_are_those_of_tables_and_figures_and_name_each_run_with_its_hash(out):
    numbers = read_numbers(out)
    assert numbers.tables["claims/C07"].rows == ((1e3, 2e-16),)
    assert numbers.tables["figures/figA"].rows == ((0.1,),) and numbers.tables[
        "inputs/bulk"
    ].rows == ((3,),)
    first, second = numbers.runs
    assert first == "iapb run peg_corner --set duration=0.4 --world PB" and second.startswith(
        "iapb store again "
    )
    hashes = {entry.content_hash for entry in Runner(out / "runs").store.entries()}
    assert set(numbers.runs.values()) == hashes
    page = (out / "report" / "data.html").read_text()
    assert "each of the 2 runs" in page and "uncommitted changes" in page


def test_nothing_says_on_which_machine_it_was_made(out):
    host = re.compile(rf"\b{re.escape(socket.gethostname())}\b")
    written = [path for path in out.rglob("*") if path.suffix in (".html", ".json")]
    for path in written:
        text = path.read_text()
        assert not any(str(one) in text for one in (out, provenance._ROOT, f"{Path.home()}/"))
        # "x86" would be found in any page
        assert not host.search(text) or len(socket.gethostname()) < 4, path
    assert len(written) > 3


@pytest.mark.parametrize(
    ("word", "kept"),
    [
        ("--out=/srv/data/out", "--out=out"),
        ("../../her/out", "out"),
        ("rate=1/512", "rate=1/512"),
        ("--out=../r", "--out=r"),
    ],
)
def test_paths_of_a_machine_are_cut_from_the_command(word, kept, monkeypatch):
    for program in ("/srv/bin/iapb", str(provenance._ROOT / "reports" / "cli.py")):
        monkeypatch.setattr(sys, "argv", [program, "run", word])
        assert provenance.current_command() == f"iapb run {kept}"


def test_uncommitted_changes_of_sources_have_a_hash(tmp_path, monkeypatch):
    def git(*words):
        author = ("-c", "user.name=n", "-c", "user.email=e@e")
        subprocess.run(["git", *author, *words], cwd=tmp_path, check=True)

    monkeypatch.setattr(provenance, "_ROOT", tmp_path)
    found = [provenance.uncommitted_changes()]
    (tmp_path / "iapb").mkdir()
    old, new = (tmp_path / "iapb" / name for name in ("old.py", "new.py"))
    old.write_text("a = 1\n")
    git("init", "-q")
    git("add", ".")
    git("commit", "-qm", "one")
    for path in (tmp_path / "notes.txt", old, new):
        path.write_text("changed = 2\n")
        found.append(provenance.uncommitted_changes())
    assert found[:2] == [provenance.UNKNOWN, "none"]  # notes are no source
    assert [len(each) for each in found[2:]] == [64, 64] and found[2] != found[3]
