"""The command beside a run makes that run again, to the last bit."""

from __future__ import annotations

import shlex

import pytest

from iapb.scene import find_scene, load_scene, scene_names
from reports import cli
from reports.evidence.runs import FIGURE_RUNS, shipped_scene
from reports.runner import Runner
from reports.uses import parsed, run_command

PEG = load_scene(find_scene("peg_corner"))
CHANGED = {
    "duration": 0.4, "bodies.peg.position": [0.0205, -0.013250000000000001, 1e-7], "contact.friction": 0.1,
    "walls.floor.normal": [0.1, -1.0], "device.delay": 1, "gravity": [0.0, 9.81], "couplings.unilateral": None,
    "title": "it's \"quoted\": {a, b} # and more",
}  # fmt: skip


def test_a_place_is_set_as_messages_write_it():
    named, numbered = (PEG.with_values(parsed([f"{path}=3"])) for path in ("bodies.peg.mass", "bodies[0].mass"))
    assert named.resolved() == numbered.resolved() != PEG.resolved()


@pytest.mark.parametrize(("values", "world", "rendering", "status"), [
    ({"duration": 0.4}, "PB", "full", 0), (CHANGED, "IAPB", "spread", 3)])  # 3: the floor is tilted into the peg
def test_a_pasted_command_makes_the_same_run_again(values, world, rendering, status, tmp_path):
    runner = Runner(tmp_path / "one")
    runner(PEG.with_values(values), world, rendering)
    [used] = runner.used.values()
    program, *words = shlex.split(used.command)
    assert program == "iapb" and cli.main([*words, "--out", str(tmp_path / "two")]) == status
    [again] = Runner(tmp_path / "two").store.entries()
    assert (again.file, again.run_key, again.content_hash) == (used.file, used.key, used.content_hash)


def test_every_scene_and_every_run_of_the_figures_has_a_command_and_a_scene_of_ones_own_its_file(tmp_path):
    assert all(run_command(load_scene(find_scene(name)), "IAPB") for name in scene_names())
    for scene, values, world, rendering in FIGURE_RUNS.values():
        command = run_command(shipped_scene(scene, values), world, rendering)
        assert command.startswith(f"iapb run {scene} ") and command.count("--set") == len(values)
    runner = Runner(tmp_path)
    runner(PEG.with_values({"name": "own", "duration": 0.4}), "PB")
    [used] = runner.used.values()
    assert used.command == f"iapb store again out/runs/{used.file}"
    assert cli.main(["store", "again", str(tmp_path / used.file)]) == 0
