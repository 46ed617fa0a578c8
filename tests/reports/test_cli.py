"""The command line, in process: what it does, what it says, and how it ends."""

from __future__ import annotations

import json
import subprocess
import sys
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path

import pytest

from iapb.errors import SceneError
from reports import cli

SHORT = ("--set", "duration=0.4")
HEAVY = {"numpy", "numba", "cvxpy", "pinocchio", "sympy", "matplotlib", "h5py", "scipy", "coal", "flint", "hypothesis"}


@pytest.fixture
def iapb(capsys):
    """Run a command line; return (status, what it printed, what it complained about)."""

    def call(*arguments):
        status = cli.main([str(argument) for argument in arguments])
        return status, *capsys.readouterr()

    return call


def test_help_loads_nothing_heavy_and_lists_every_command():
    """By imports rather than by time, which other programs share."""
    code = ("import sys; from reports.cli import main; status = main(['--help']); "
            "print('LOADED', *sorted({name.split('.')[0] for name in sys.modules})); sys.exit(status)")  # fmt: skip
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    text, loaded = done.stdout.split("LOADED")
    assert not HEAVY & set(loaded.split())
    for command in cli.COMMANDS:
        assert command in text


@pytest.mark.parametrize("command", cli.COMMANDS)
def test_every_command_explains_itself_in_the_words_of_the_list(command, iapb):
    status, out, _ = iapb(command, "--help")
    assert status == 0 and "Usage" in out
    explained = getattr(import_module(f"reports.commands.{command}"), command).__doc__
    assert explained.partition("\n")[0] == cli.COMMANDS[command]


@pytest.mark.parametrize("arguments", [["walk"], ["run"], ["run", "peg_corner", "--speed", "3"], ["inspect"], [],
                                       ["verify", "--scene", "elastic_cradle"],
                                       ["inspect", "run.h5", "--impacts", "-3"], ["verify", "--seed", "-1"],
                                       ["sweep", "corner_tilt", "--workers", "99999999"],
                                       ["live", "peg_corner", "--view", "--port", "99999999"]])
def test_wrong_usage_ends_with_2_and_says_what_is_wrong(arguments, iapb):
    status, out, err = iapb(*arguments)
    assert status == 2
    assert "Usage" in out + err and "Traceback" not in err


def test_run_stores_a_run_and_a_second_call_reads_it(iapb, tmp_path):
    status, out, _ = iapb("run", "peg_corner", *SHORT, "--out", tmp_path)
    [file] = tmp_path.glob("*.h5")
    written = file.stat().st_mtime_ns
    assert status == 0 and "computed in" in out and str(file) in out
    status, out, _ = iapb("run", "peg_corner", *SHORT, "--out", tmp_path)
    assert status == 0 and "read from its file" in out
    assert [file] == list(tmp_path.glob("*.h5")) and file.stat().st_mtime_ns == written
    iapb("run", "peg_corner", *SHORT, "--set", "contact.stiffness=900", "--out", tmp_path)
    iapb("run", "peg_corner", *SHORT, "--world", "PB", "--out", tmp_path)
    iapb("run", "peg_corner", *SHORT, "--rendering", "spread", "--out", tmp_path)
    assert len(list(tmp_path.glob("*.h5"))) == 4


def test_inspect_tells_from_the_file_alone_what_is_in_it(iapb, tmp_path):
    iapb("run", "peg_corner", "--out", tmp_path)
    [file] = tmp_path.glob("*.h5")
    status, out, _ = iapb("inspect", file, "--impacts", "1")
    assert status == 0
    for text in ("peg_corner", "Complete.", "The first 1 of", "impact_loss", "friction", "run key", "content hash"):
        assert text in out, text


def test_an_interrupted_run_leaves_a_readable_partial_file_and_ends_with_130(iapb, tmp_path, monkeypatch):
    @contextmanager
    def interrupting(title):
        def progress(done, total):
            raise KeyboardInterrupt

        yield progress

    monkeypatch.setattr("reports.commands.run.step_progress", interrupting)
    status, out, err = iapb("run", "peg_corner", "--out", tmp_path)
    [file] = tmp_path.glob("*.partial")
    assert status == 130 and str(file) in out and "Stopped: interrupted" in out and "Traceback" not in err
    assert not list(tmp_path.glob("*.h5"))
    status, out, _ = iapb("inspect", file)
    assert status == 0 and "Partial: interrupted." in out
    monkeypatch.undo()
    assert iapb("run", "peg_corner", "--out", tmp_path)[0] == 0  # done from the start, and the partial file is gone
    assert len(list(tmp_path.glob("*.h5"))) == 1 and not list(tmp_path.glob("*.partial"))


def test_a_run_that_diverges_says_why_and_ends_with_1(iapb, tmp_path):
    walls = [{"name": f"wall_{n}", "kind": "half_plane", "point": [0.05 * n, 0], "normal": [-n, 0]} for n in (1, -1)]
    status, out, _ = iapb("run", "peg_corner", "--world", "PB", "--set", "contact.stiffness=1e9", "--set",
                          "contact.damping=0", "--set", f"walls={json.dumps(walls)}", "--out", tmp_path)  # fmt: skip
    assert status == 1 and "Stopped: the" in out and "range of numbers" in out
    assert len(list(tmp_path.glob("*.partial"))) == 1


WRONG_SCENE = """\
name: wrong
rate: -5
duration: 1.0
bodies:
  - {name: peg, joint: hinge, mass: 1.0, inertia: 1.0}
contact: {stiffness: soft}
"""


def test_a_wrong_scene_shows_all_its_mistakes_with_their_places(iapb, tmp_path):
    path = tmp_path / "wrong.yaml"
    path.write_text(WRONG_SCENE)
    for command in ("run", "effects"):
        status, out, err = iapb(command, path)
        assert status == 1 and "Traceback" not in out + err
        assert f"{path}:2:" in err and "rate" in err
        assert f"{path}:5:" in err and "bodies[0].joint" in err and "hinge" in err
        assert f"{path}:6:" in err and "contact.stiffness" in err
        assert err.count("expected") >= 3


def test_debug_shows_the_traceback(tmp_path):
    path = tmp_path / "wrong.yaml"
    path.write_text(WRONG_SCENE)
    with pytest.raises(SceneError):
        cli.main(["--debug", "run", str(path)])
    assert cli.main(["run", str(path)]) == 1  # and only where it was asked for


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["run", "no_such_scene"], "no_such_scene"),
        (["run", "peg_corner", "--world", "best"], "world = 'best': expected one of IAPB, PB, "),
        (["run", "peg_corner", "--rendering", "clip"], "rendering = 'clip'"),
        (["run", "peg_corner", "--world", "PB", "--rendering", "spread"], "rendering = 'spread'"),
        (["run", "peg_corner", "--set", "friction"], "--set = 'friction': expected path=value"),
        (["run", "peg_corner", "--set", "contact.friction=-1"], "contact.friction"),
        (["run", "peg_corner", "--set", "contact.frictoin=1"], "frictoin"),
        (["run", "peg_corner", "--set", "contact.friction=[1"], "--set"),
        (["inspect", "no_such_file.h5"], "no_such_file.h5: no such file"),
        (["inspect", "."], ".: a folder, not a file"),
        (["compare", "--only-problems", "--problems", "."], "a folder with problem files"),
        (["compare", "--export", "/dev/null/folder"], "iapb: /dev/null/folder: Not a directory"),
        (["run", "peg_corner", "--out", ""], "--out = '': expected a value that is not empty"),
        (["run", "peg_corner", "--out="], "--out = '': expected a value that is not empty"),
        (["run", ""], "argument 2 = '': expected a value that is not empty"),
        (["store", "check", ""], "argument 3 = ''"),
        (["live", "peg_corner", "--rate", "inf"], "--rate = inf: expected a number"),
        (["live", "peg_corner", "--seconds", "0.1", "--out", "/dev/null/folder"], "/dev/null/folder: Not a directory"),
        (["prove", "no_such_statement"], "no_such_statement"),
        (["reproduce", "--figure", "fig99"], "fig99"),
        (["verify", "--resolver", "nothing"], "package.module:function"),
        (["verify", "--resolver", "no_such_module:f"], "can be imported"),
        (["verify", "--resolver", "json:dumps"], "resolver = 'dumps': expected a function called as (mass_matrix, con"),
        (["verify", "--resolver", "os.path:basename"], "velocity, restitution): too many positional arguments"),
        (["bench", "--budget", "50"], "budget = '50': expected a time with its unit, e.g. 50us"),
        (["verify", "--resolver", "iapb:resolve_impct"], "which has no resolve_impct; did you mean resolve_impact?"),
        (["verify", "--simulator", "mujocco"], "did you mean mujoco?"),
        (["verify", "--simulator", "iapb", "--scene", "elastic_cradel"], "did you mean elastic_cradle?"),
        (["run", "peg_cornr"], "did you mean peg_corner?"),
        (["run", "scenes/peg_cornr.yaml"], "did you mean peg_corner?"),
        (["run", "peg_corner", "--world", "iapb"], "did you mean IAPB?"),
        (["run", "peg_corner", "--set", "bodies.pegg.mass=1"], "did you mean peg?"),
        (["sweep", "corner_tlt"], "did you mean corner_tilt?"),
        (["prove", "theorem1"], "did you mean theorem_1?"),
        (["reproduce", "--figure", "fig7"], "did you mean fig07?"),
    ],
)
def test_an_error_is_one_sentence_with_value_and_expectation(arguments, said, iapb, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, out, err = iapb(*arguments)
    assert status == 1
    assert err.startswith("iapb: ") and said in err and "Traceback" not in out + err
    assert not list(tmp_path.rglob("*.h5*"))


def test_a_local_file_is_guessed_before_a_scene_of_ours(iapb, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ball.yaml").touch()
    for given, near in (("bal.yaml", "ball.yaml"), (str(tmp_path / "bell.yaml"), str(tmp_path / "ball.yaml"))):
        assert iapb("run", given)[2].endswith(f"; did you mean {near}?\n")


@pytest.mark.parametrize(("arguments", "status", "said"), [
    (("run", "no_such_scene"), 1, "no_such_scene"), (("bench", "--budget", "50"), 1, "with its unit"),
    (("run", "peg_corner", "--speed", "3"), 2, "No such option"), (("run",), 2, "scene")])
def test_with_json_an_error_is_an_object_too(arguments, status, said, iapb):
    ended, out, err = iapb(*arguments, "--json")
    found = json.loads(out)
    assert ended == found["status"] == status and said in found["error"] and found["error"] and err


def test_a_file_that_is_no_run_is_refused(iapb, tmp_path):
    path = tmp_path / "notes.h5"
    path.write_text("not HDF5")
    status, _, err = iapb("inspect", path)
    assert status == 1 and str(path) in err


def test_the_store_checks_a_file_that_is_named_and_cares_for_folders_only(iapb, tmp_path):
    path = tmp_path / "notes.txt"
    path.write_text("not HDF5")
    status, out, _ = iapb("store", "check", path)
    assert status == 1 and "1 files: 1 foreign" in out
    for action in ("gc", "repair"):
        status, _, err = iapb("store", action, path)
        assert status == 1 and f"a folder of results: {action} is not for one file" in err and path.is_file()


@pytest.mark.parametrize("action", ["check", "repair", "gc", "again"])
def test_the_store_does_not_care_for_a_whole_file_system(action, iapb):
    root = Path.cwd().anchor
    status, _, err = iapb("store", action, root)
    assert status == 1 and "where" in err and root in err and "not a whole file system" in err


def test_effects_lists_each_with_its_reason(iapb):
    status, out, _ = iapb("effects", "peg_corner", "--world", "PB")
    words = " ".join(out.split())
    assert status == 0 and "impulses" in words and "the law 'penalty' does not use it" in words
    status, out, _ = iapb("effects", "peg_corner")
    assert status == 0 and "without it" in out and "Off, because" in out


def test_schema_prints_a_json_schema(iapb):
    status, out, _ = iapb("schema")
    parts = json.loads(out)["$defs"]
    assert status == 0 and all("bodies" in parts[kind]["properties"] for kind in ("Scene", "SpatialScene"))


def test_prove_prints_one_proof(iapb):
    from verification.proofs import all_proofs

    status, out, _ = iapb("prove", all_proofs()[0])
    assert status == 0 and "proved" in out


def test_ctrl_c_outside_a_run_is_told_and_ends_with_130(iapb, monkeypatch):
    def stopped(**options):
        raise KeyboardInterrupt

    monkeypatch.setattr("reports.commands.schema.scene_schema", stopped)
    status, _, err = iapb("schema")
    assert status == 130 and err == "iapb: stopped; files that were complete stay\n"


def test_a_fault_of_ours_is_not_hidden(monkeypatch):
    def broken(**options):
        raise ZeroDivisionError

    monkeypatch.setattr("reports.commands.schema.scene_schema", broken)
    with pytest.raises(ZeroDivisionError):
        cli.main(["schema"])


@pytest.mark.parametrize(("arguments", "law", "effect"), [
    (("bar_on_posts",), "impulse-augmented penalty", "unequal_restitution"),
    (("sliding_box", "--world", "IAPB-friction"), "impulse-augmented penalty with impact friction", "impact_friction"),
])  # fmt: skip
def test_extensions_of_the_law_run_by_name_and_say_so_in_the_file(arguments, law, effect, iapb, tmp_path):
    from reports.store.runs import read_run

    status, out, _ = iapb("run", *arguments, "--out", tmp_path, "--set", "duration=0.02")
    assert status == 0 and f": {law}, coupling none." in out
    run = read_run(next(tmp_path.glob("*.h5")))
    assert run.law == law and run.law_settings["friction_in_impacts"] == (effect == "impact_friction")
    assert effect in {row.name for row in run.effects if row.active}


def test_check_warns_with_a_number_and_ends_with_3(iapb):
    status, out, _ = iapb("check", "peg_corner")
    assert status == 0 and "the step holds contact.stiffness <= 2.62e+05 N/m" in out and "Nothing wrong" in out
    status, out, _ = iapb("check", "peg_corner", "--set", "contact.stiffness=1e9", "--json")
    found = json.loads(out)
    assert status == 3 and found["warnings"][0]["kind"] == "stiffness" and found["limits"]["contacts"] == 2


def test_a_run_that_is_not_to_be_trusted_says_why_ends_with_3_and_stores_it(iapb, tmp_path):
    wrong = ("run", "peg_corner", "--set", "duration=0.5", "--set", "contact.stiffness=1e8", "--out", tmp_path)
    status, out, err = iapb(*wrong)
    assert status == 3 and "Warning: contact.stiffness" in err
    assert "This result is not to be trusted, because its energy is" in out
    [file] = tmp_path.glob("*.h5")
    again, out, _ = iapb(*wrong, "--json")
    assert again == 3 and json.loads(out)["distrust"] and "not to be trusted" in iapb("inspect", file)[1]


def test_version_scenes_and_completion(iapb, monkeypatch, capsys):
    assert iapb("--version")[:2] == (0, f"iapb {import_module('iapb').__version__}\n")
    assert json.loads(iapb("scenes", "--json")[1])["peg_corner"]
    monkeypatch.setenv("_IAPB_COMPLETE", "complete_bash")
    for words, place, expected in (("iapb run peg_c", 2, "peg_corner"), ("iapb che", 1, "check"),
                                   ("iapb run --wor", 2, "--world")):
        monkeypatch.setenv("COMP_WORDS", words)
        monkeypatch.setenv("COMP_CWORD", str(place))
        with pytest.raises(SystemExit, match="0"):  # typer ends the process that a shell asks
            iapb()
        assert expected in capsys.readouterr().out.split()
