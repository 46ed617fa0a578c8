"""The long verification: done batches are not redone, also after a kill; what breaks a law can be rechecked."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

import pytest

from iapb.errors import RunFileError
from reports.campaign import Campaign
from reports.cli import main
from reports.counterexamples import ENGINE, CampaignRequest, keep_counterexample, recheck, recheck_command
from reports.store.tables import read_record, write_record
from verification.laws.bounds import LawResidual
from verification.laws.campaign import IMPACTS, TRAJECTORIES, UNEQUAL, Batch, Found, drawn, plan, residuals
from verification.laws.planted import doubled_impulse

SOUND = CampaignRequest("verification.laws:sound_resolver", "KIT", 1e8, 60, 0, 0, 1)
BROKEN = replace(SOUND, resolver="verification.laws.planted:wrong_sign")
BATCHES = tuple(Batch(IMPACTS, first, 5) for first in range(0, 20, 5))


def _silent(part: str, done: int, total: int) -> None:
    """No progress."""


def test_a_second_run_computes_nothing_and_a_longer_one_only_what_is_missing(tmp_path: Path) -> None:
    campaign, seen = Campaign(tmp_path, SOUND), list[tuple[str, int, int]]()
    campaign.run(BATCHES[:2], _silent)
    written = {batch: campaign.path_of(batch).stat().st_mtime_ns for batch in BATCHES[:2]}
    campaign.run(BATCHES, lambda *told: seen.append(told))
    assert seen[0] == (IMPACTS, 10, 20) and seen[-1] == (IMPACTS, 20, 20)
    assert {batch: campaign.path_of(batch).stat().st_mtime_ns for batch in written} == written
    counts = campaign.counts(BATCHES)[IMPACTS]
    assert counts["kinetic_energy"].checked == 20 and not any(count.failures for count in counts.values())
    assert campaign.counterexamples() == []


def test_batches_do_not_depend_on_how_they_are_cut(tmp_path: Path) -> None:
    whole, cut = Campaign(tmp_path / "a", SOUND), Campaign(tmp_path / "b", SOUND)
    whole.run([Batch(IMPACTS, 0, 20)], _silent)
    cut.run(BATCHES, _silent)
    assert whole.counts([Batch(IMPACTS, 0, 20)]) == cut.counts(BATCHES)


def test_another_resolver_or_tolerance_has_another_folder_and_a_file_that_is_not_there_is_named() -> None:
    with pytest.raises(RunFileError, match="no such file"):
        list(recheck(Path("absent.h5")))
    keys = {request.key() for request in (SOUND, BROKEN, replace(SOUND, bounds="FACTORED"), replace(SOUND, seed=1))}
    assert len(keys) == 4
    assert replace(SOUND, workers=2, impacts=7).key() == SOUND.key()


def test_a_file_that_names_a_module_does_not_run_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The attack: a counterexample that names a module of the working directory, which leaves a trace if imported."""
    campaign = Campaign(tmp_path / "out", BROKEN)
    campaign.run(BATCHES[:1], _silent)
    broken = read_record(campaign.counterexamples()[0])
    broken["request"]["resolver"] = "trap_of_theirs:resolver"
    (tmp_path / "trap_of_theirs.py").write_text("from pathlib import Path\nPath('trace').touch()\nresolver = print\n")
    monkeypatch.chdir(tmp_path)
    write_record(Path("evil.h5"), broken, "evil")
    assert main(["verify", "--recheck", "evil.h5"]) == 0  # the engine keeps the law
    said = capsys.readouterr().out
    assert "by iapb:resolve_impact; trap_of_theirs:resolver, which the file names" in said
    assert not Path("trace").exists() and "trap_of_theirs" not in sys.modules
    cases = ({"case": broken["case"] | {name: 1e308}} for name in ("mass_matrix", "velocity", "translations"))
    for wrong in (*cases, {"value": "NaN?"}, {"index": float("inf")}, {"velocity_after": [[1.0], []]},
                  {"tolerance": {}}, {"test": "", "index": -1}):
        write_record(Path("evil.h5"), broken | wrong, "evil")
        with pytest.raises(RunFileError, match="is no counterexample"):
            list(recheck(Path("evil.h5")))
        assert main(["inspect", "evil.h5"]) in (0, 1)
    assert recheck_command(Path("x; touch trace"), ENGINE) == "iapb verify --recheck 'x; touch trace'"
    broken["request"]["bounds"] = "__loader__"
    write_record(Path("evil.h5"), broken, "evil")
    with pytest.raises(RunFileError, match="is no counterexample"):
        list(recheck(Path("evil.h5")))


def test_a_trajectory_is_kept_as_its_run(tmp_path: Path) -> None:
    subject = SOUND.subject()
    run = next(run for index in range(20) if (run := doubled_impulse(drawn(TRAJECTORIES, index, subject))) is not None)
    found = Found("impulse_momentum", TRAJECTORIES, 0, LawResidual("", 1.0, 0.0), None, run)
    path = keep_counterexample(tmp_path, found, SOUND)
    judged = dict(recheck(path))
    assert not judged["as recorded: impulse_momentum"].passed
    assert judged["simulated again: impulse_momentum"].passed


@pytest.mark.parametrize("part", ["hand_port", "device_port", "device_limits", "group_splitting"])
def test_a_case_that_is_no_impact_is_drawn_again(part: str, tmp_path: Path) -> None:
    case = drawn(part, 3, SOUND.subject())
    residual = residuals(part, case, SOUND.subject())[0][part]
    path = keep_counterexample(tmp_path, Found(part, part, 3, residual, case), SOUND)
    assert list(recheck(path)) == [(part, residual)]


def test_the_plan_covers_every_part_once() -> None:
    batches = plan(1_000_000, 5000)
    impacts = sorted((batch.first, batch.count) for batch in batches if batch.part == IMPACTS)
    assert sum(count for _, count in impacts) == 1_000_000
    assert all(first + count == following for (first, count), (following, _) in zip(impacts, impacts[1:], strict=False))
    assert sum(batch.count for batch in batches if batch.part == TRAJECTORIES) == 5000
    assert any(batch.part == UNEQUAL for batch in batches)


def test_what_is_stopped_tells_what_there_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = Campaign.run

    def interrupted(self: Campaign, batches: Iterable[Batch], progress: Callable[[str, int, int], None]) -> None:
        whole(self, [Batch(IMPACTS, 0, 30)], progress)
        raise KeyboardInterrupt

    monkeypatch.setattr(Campaign, "run", interrupted)
    full = ["verify", "--full", "--resolver", SOUND.resolver, "--impacts", "30", "--out", str(tmp_path)]
    assert main(full) == 130
    assert "kinetic_energy: 0 of 30 break it" in capsys.readouterr().out
    monkeypatch.undo()
    assert main(full) == 0
    assert "1 of them done before" in capsys.readouterr().out
