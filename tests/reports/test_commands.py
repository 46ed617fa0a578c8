"""The command line, in process: what it refuses, and each command once, from its words to its
answer and its files."""

import json
import re
import shlex
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from iapb.errors import SceneError
from reports import cli, show
from reports.store.runs import read_run
from verification.finding import REPRODUCED, Part
from verification.table import titled

ROOT = Path(__file__).parents[2]
SLOPE = ROOT / "tests" / "verification" / "worlds" / "slope.yaml"
SHORT = ("peg_corner", "--set", "duration=0.4")
STUDY = "scene: two_discs\nvalues:\n  contact.restitution: [0.0, 0.5]\n"
WRONG = "verification.laws.planted:wrong_sign"
WRONG_SCENE = """\
name: wrong
rate: -5
duration: 1.0
bodies:
  - {name: peg, joint: hinge, mass: 1.0, inertia: 1.0}
contact: {stiffness: soft}
"""


@pytest.fixture
def iapb(capsys):
    """Run a command line; return (status, what it printed, what it complained about)."""

    def call(*arguments):
        capsys.readouterr()
        return cli.main([str(argument) for argument in arguments]), *capsys.readouterr()

    return call


@pytest.fixture
def answer(iapb):
    """Run a command with --json; return its status and the object."""

    def call(*arguments):
        status, out, _ = iapb(*arguments, "--json")
        return status, json.loads(out)

    return call


@pytest.fixture
def here(tmp_path, monkeypatch):
    """Work in a folder with files that are not what they seem."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bare").mkdir(), (tmp_path / "given").mkdir()
    for name, text in {
        "wrong.yaml": WRONG_SCENE,
        "ball.yaml": "",
        "notes.h5": "not HDF5",
        "notes.md": "notes",
        "text.npz": "no archive",
        "empty.npz": "",
        "own_number.py": "f = 3",
        "own_syntax.py": "def f(:",
        "own_wall.py": "def f(x, v):\n    return -min(3e3 * x, 5.0) if x > 0.0 else 0.0",
        "two.yaml": STUDY,
        "given/two.lcp": "2\n2 1\n1 2\n-5 -6\n",
        "given/bad.lcp": "2\nno number\n",
        "given/none.lcp": "1\n-1\n-1\n",
    }.items():
        (tmp_path / name).write_text(text)
    np.savez(tmp_path / "half.npz", v_minus=np.ones((1, 2)))
    (tmp_path / "cut.npz").write_bytes((tmp_path / "half.npz").read_bytes()[:99])
    archive(tmp_path / "whole.npz")
    (tmp_path / "link.out").symlink_to(tmp_path / "whole.npz")
    return tmp_path


def archive(path, gain=False):
    """Two impacts of a recorder elsewhere; the second may gain one unit in the last place."""
    v = np.array([[1.0, -2.0], [0.3, 0.7]])
    after = -v
    after[1, 0] = np.nextafter(after[1, 0], -np.inf) if gain else after[1, 0]
    np.savez(path, mass_matrix=np.diag([2.0, 3.0]), v_minus=v, v_plus=after)
    return path


def listed(command):
    """The keys that the documents list for a command: the words before what stands in brackets."""
    [row] = re.findall(
        rf"^\| `{command}` \| (.*) \|$", (ROOT / "docs" / "commands.md").read_text("utf-8"), re.M
    )
    return {key.strip() for key in re.sub(r"\([^)]*\)|;.*", "", row).split(",")}


REFUSED = [  # status, command line, what the refusal says
    (2, "walk", "Usage"),
    (2, "", "Usage"),
    (2, "run peg_corner --speed 3", "No such option"),
    (1, "run wrong.yaml", "wrong.yaml:2:"),
    (1, "run peg_cornr", "did you mean peg_corner?"),
    (1, "run peg_corner --world best", "world = 'best': expected one of IAPB, PB, "),
    (1, "run peg_corner --rendering clip", "'clip'"),
    (1, "run peg_corner --set friction", "--set = 'friction': expected path=value"),
    (1, "run peg_corner --set contact.frictoin=1", "frictoin"),
    (1, "run peg_corner --out ''", "--out = '': expected a value that is not empty"),
    (1, "run peg_corner --out /dev/null/folder", "/dev/null/folder: "),
    (1, "inspect no_such_file.h5", "no_such_file.h5: no such file"),
    (1, "inspect .", ".: not a file"),
    (1, "store check /", "not a whole file system"),
    (1, "certify cut.npz", "no archive"),
    (1, "certify half.npz", "mass_matrix, v_plus missing"),
    (1, "certify whole.npz --export link.out", "--export"),
    (1, "solvers bare", "a folder with problem files"),
    (1, "solvers --out x.csv", "ends in .json"),
    (1, "sweep corner_tlt", "did you mean corner_tilt?"),
    (1, "prove theorem1", "did you mean theorem_1?"),
    (1, "reproduce --figure fig04 --set contact.friction=0.2", "a figure that shows scenes: hero"),
    (1, "reproduce --figure fig7", "did you mean fig07?"),
    (1, "reproduce --set contact.friction=0.2", "a figure whose scenes it changes"),
    (
        1,
        "reproduce --figure motions --set contact.friction=0.2",
        "a figure that shows scenes: hero, fig07",
    ),
    (1, "report diff here there", "report = 'here'"),
    (1, "bench --budget 50", "budget = '50': expected a time with its unit, e.g. 50us"),
    (1, "effects peg_corner --measure --world ideal", "--measure needs a world of the compiled"),
    (1, "port json:dumps --start 0;1", "--start = '0;1': expected a number, or two or three"),
    (1, "port own_number:f", "law = 3: expected a function of (x, v)"),
    (1, "verify --resolver iapb:resolve_impct", "did you mean resolve_impact?"),
    (1, "verify --resolver own_syntax:f", "SyntaxError"),
]


@pytest.mark.parametrize(
    ("status", "words", "said"), REFUSED, ids=lambda value: str(value) or "nothing"
)
def test_a_refusal_names_the_value_and_what_is_expected_and_changes_no_file(
    status, words, said, iapb, here
):
    before = {path: path.read_bytes() for path in here.rglob("*") if path.is_file()}
    ended, out, err = iapb(*shlex.split(words))
    assert (
        ended == status and said in " ".join((out + err).split()) and "Traceback" not in out + err
    )
    assert "\niapb: " in f"\n{err}" if status == 1 else "Usage" in out + err
    assert before == {
        path: path.read_bytes()
        for path in here.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }


JSON = {  # of each row in the documents: the status, and a command
    "run": (0, "run peg_corner --set duration=0.4 --out runs"),
    "check": (3, "check peg_corner --set contact.stiffness=1e9"),
    "effects": (0, "effects peg_corner --world ideal"),
    "certify": (0, "certify runs whole.npz"),
    "store again": (0, "store again runs"),
    "sweep": (0, "sweep two.yaml --workers 1 --out sweeps"),
    "solvers": (0, "solvers given"),
    "verify": (0, "verify --impacts 20 --laws kinetic_energy"),
    "verify-many": (1, f"verify-many --impacts 20 --workers 1 --resolver {WRONG}"),
    "port": (1, "port own_wall:f --damping 1.52 --limit 4 --start -0.001 --reach 0.005 --seed 1"),
    "prove": (0, "prove theorem_1"),
    "reproduce --figure": (0, "reproduce --figure fig02 --out figures"),
}


def test_json_has_the_keys_that_the_documents_list_and_an_error_is_an_object_too(answer, here):
    found = {}
    for row, (status, line) in JSON.items():
        ended, found[row] = answer(*line.split())
        assert (row, ended, set(found[row])) == (row, status, listed(row))
    ran = found["run"]
    seen = answer("inspect", ran["file"], "--impacts", 2)[1]
    assert len(seen["impacts"]) == min(2, seen["collisions"])
    assert (seen["end"], seen["steps"]) == (ran["end"], ran["steps"])
    check = found["check"]
    assert check["limits"]["contacts"] == 2 and check["warnings"][0]["kind"] == "stiffness"
    ignored = {one["name"]: one["ignores"] for one in found["effects"]["effects"]}
    assert ignored["penalty_stiffness"] == "stiffness"
    assert found["store again"]["same"] == 1 == len(found["store again"]["files"])
    assert len(found["sweep"]["points"]) == 2 == found["sweep"]["new"]
    rows = {row[0]: row for row in found["solvers"]["tables"]["given"]["rows"]}
    assert "not read" in rows["bad.lcp"] and rows["two.lcp"].count("solved") > 3
    assert "solved" not in rows["none.lcp"]  # no z has 0 <= z and -z - 1 >= 0
    assert found["verify"]["passed"] and len(found["verify"]["laws"]) == 1
    assert "def test_" in found["verify-many"]["counterexamples"][0]["test"]
    assert found["port"]["broken_laws"] == ["bounded"] and Path(found["port"]["map"]).is_file()
    assert [one["verdict"] for one in found["prove"]["statements"]] == ["proved"]
    drawn = found["reproduce --figure"]
    assert all(Path(each).is_file() for each in (*drawn["drawings"], drawn["page"]))
    assert "Two uniform links" in Path(drawn["page"]).read_text(encoding="utf-8")
    for status, line in ((1, "run no_such_scene"), (2, "run peg_corner --speed 3")):
        ended, error = answer(*line.split())
        assert ended == error["status"] == status and error["error"]


def test_debug_shows_the_traceback_ctrl_c_ends_with_130_and_a_fault_of_ours_is_not_hidden(
    iapb, here, monkeypatch
):
    with pytest.raises(SceneError):
        cli.main(["--debug", "run", "wrong.yaml"])
    raised = [KeyboardInterrupt, ZeroDivisionError]

    def stopped(**_):
        raise raised.pop(0)

    monkeypatch.setattr("reports.commands.schema.scene_schema", stopped)
    assert iapb("schema") == (130, "", "iapb: stopped; files that were complete stay\n")
    with pytest.raises(ZeroDivisionError):
        iapb("schema")


def test_every_command_explains_itself(iapb):
    told = iapb("--help")[1]
    for command in cli.COMMANDS:
        status, out, _ = iapb(command, "--help")
        assert status == 0 and "Usage" in out and command in told


def test_version_schema_and_completion(iapb, monkeypatch, capsys):
    assert iapb("--version")[:2] == (0, f"iapb {import_module('iapb').__version__}\n")
    parts = json.loads(iapb("schema")[1])["$defs"]
    assert all("bodies" in parts[kind]["properties"] for kind in ("Scene", "SpatialScene"))
    for name, value in (("_IAPB_COMPLETE", "complete_bash"), ("COMP_CWORD", "2")):
        monkeypatch.setenv(name, value)
    monkeypatch.setenv("COMP_WORDS", "iapb run peg_c")
    with pytest.raises(SystemExit, match="0"):  # typer ends the process that a shell asks
        iapb()
    assert "peg_corner" in capsys.readouterr().out.split()


def test_run_stores_a_run_a_second_call_reads_it_and_inspect_tells_what_is_in_it(iapb, tmp_path):
    status, out, _ = iapb("run", *SHORT, "--out", tmp_path)
    [file] = tmp_path.glob("*.h5")
    written = file.stat().st_mtime_ns
    assert status == 0 and str(file) in out
    assert "read from its file" in iapb("run", *SHORT, "--out", tmp_path)[1]
    assert file.stat().st_mtime_ns == written
    status, out, _ = iapb("inspect", file, "--impacts", "1")
    assert status == 0 and "The first 1 of" in out and "content hash" in out


def test_a_run_that_is_interrupted_diverges_or_is_not_to_be_trusted_says_so(
    iapb, answer, tmp_path, monkeypatch
):
    @contextmanager
    def interrupting(*_, **__):
        def progress(*_):
            raise KeyboardInterrupt

        yield progress

    monkeypatch.setattr("reports.commands.run.stage_progress", interrupting)
    status, out, err = iapb("run", "peg_corner", "--out", tmp_path)
    [file] = tmp_path.glob("*.partial")
    assert status == 130 and f"{file}" in out and "Stopped: interrupted" in out
    assert "Traceback" not in err and "Partial: interrupted." in iapb("inspect", file)[1]
    monkeypatch.undo()
    assert iapb("run", "peg_corner", "--out", tmp_path)[0] == 0  # done from the start
    assert len(list(tmp_path.glob("*.h5"))) == 1 and not list(tmp_path.glob("*.partial"))
    fast = ("run", "peg_corner", "--set", "bodies.peg.velocity=[-0.3, 0.4, 0.0]")
    fast += ("--set", "couplings.four_channel.stiffness=[1e9, 1e9, 1e9]")
    status, out, _ = iapb(*fast, "--out", tmp_path)
    assert status == 1 and "Stopped: the" in out
    wrong = ("run", *SHORT, "--set", "contact.stiffness=1e8", "--out", tmp_path / "x")
    status, out, err = iapb(*wrong)
    assert status == 3 and "Warning: contact.stiffness" in err
    assert "not to be trusted, because its energy is" in out and answer(*wrong)[1]["distrust"]
    assert "not to be trusted" in iapb("inspect", *tmp_path.glob("x/*.h5"))[1]


def test_check_says_what_the_step_holds_and_effects_why_one_is_off(iapb):
    status, out, _ = iapb("check", "peg_corner")
    assert status == 0 and "the step holds contact.stiffness <= 2.62e+05 N/m" in out
    status, out, _ = iapb("effects", "peg_corner", "--world", "PB")
    assert status == 0 and "the law 'penalty' does not use it" in " ".join(out.split())


def test_certify_judges_runs_and_archives_and_exports_them_as_integers(iapb, answer, here):
    iapb("run", "newton_cradle", "--set", "duration=0.4", "--out", "runs")
    status, out, _ = iapb("certify", archive(here / "gain.npz", gain=True))
    assert status == 1 and "2 impacts of 1 file: 1 gained energy (exact)" in out
    assert "Impact 1 of" in out and "Fraction" in out
    status, found = answer("certify", "runs", "whole.npz", "whole.npz", "--export", "impacts.txt")
    assert status == 0 and found["passed"] and len(found["files"]) == 2  # named twice, judged once
    head, *impacts, end = whole = Path("impacts.txt").read_text(encoding="utf-8").splitlines()
    run = read_run(next(here.glob("runs/*.h5")))
    assert head == "iapb impacts 2" and end == f"end {len(impacts)}"
    assert len(impacts) == len(run.impacts.step) + 2 > 2
    assert iapb("certify", "whole.npz", "absent.npz", "--export", "impacts.txt")[0] == 1
    assert Path("impacts.txt").read_text(encoding="utf-8").splitlines() == whole


def test_bench_names_the_methods_for_a_budget_or_says_that_there_is_none(iapb, answer, monkeypatch):
    found = ["IAPB in 1 µs"]
    monkeypatch.setattr("reports.commands.bench.which_method", lambda *_: found)
    bench = ("bench", "--budget", "2ms", "--contacts", "7")
    status, given = answer(*bench)
    assert (status, set(given), given["choices"]) == (0, listed("bench --budget"), found)
    assert found[0] in iapb(*bench)[1]
    found.clear()
    assert "In 2 ms no method solves 7 contacts on 6 coordinates" in iapb(*bench)[1]


def test_a_figure_of_changed_scenes_says_so_and_leaves_the_papers_figure(iapb, here):
    figure = ("reproduce", "--figure", "fig12", "--out", "drawn")
    assert iapb(*figure)[0] == 0 == iapb(*figure, "--set", "bodies.peg.mass=4")[0]
    ours, papers = (
        (here / "drawn" / f"fig12{name}-0.svg").read_text() for name in ("-changed", "")
    )
    assert ours != papers
    assert "with bodies.peg.mass=4" in (here / "drawn" / "fig12-changed.html").read_text()


def test_compare_puts_worlds_on_one_page_and_stores_them_with_their_figure(iapb, here):
    door = ("compare", SLOPE.with_name("door.yaml"), "--set", "duration=0.15", "--worlds", "IAPB")
    status, out, err = iapb(*door, "--against", "IAPB")
    assert status == 0 and "IAPB moves as the LCP in " in " ".join(out.split()), err
    place = Path("mine/slope.json")
    slope = ("compare", SLOPE, "--set", "duration=0.05", "--worlds", "IAPB,ideal,ideal-friction")
    status, out, err = iapb(*slope, "--out", place)
    lines = out.splitlines()
    assert status == 0 and max(map(len, lines)) <= show.WIDTH and len(lines) < 60, err
    found = json.loads(place.read_text(encoding="utf-8"))["tables"]
    assert len(found["over time"]["rows"]) == 3 * 51
    assert [row[0] for row in found["worlds"]["rows"]] == ["IAPB", "ideal", "ideal-friction"]
    assert "ideal-friction (reference)" in place.with_suffix(".svg").read_text(encoding="utf-8")


def test_tables_and_sentences_fit_a_terminal_and_json_is_strict():
    titles = ("name", *(f"quantity {k} [N s]" for k in range(12)))
    lines = show.table_text(titled(titles, [("a", *map(float, range(12)))], 3)).splitlines()
    assert max(map(len, lines)) <= show.WIDTH
    assert [line for line in lines if line.startswith("a ")][1].split()[-1] == "11"
    wrapped = show.sentence("word " * 40, "• ").splitlines()
    assert max(map(len, wrapped)) <= show.WIDTH and wrapped[1].startswith("  word")
    facts = {"a": np.array([1.0, np.nan]), 2: Part("s", REPRODUCED), "d": (np.int64(3), None)}
    found = json.loads(show.Answer(facts, []).text(json_=True), parse_constant=pytest.fail)
    assert (found["a"], found["2"]["verdict"], found["d"]) == ([1.0, None], REPRODUCED, [3, None])
