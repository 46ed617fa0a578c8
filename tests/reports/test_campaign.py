"""The long verification: done batches are not redone, also after a kill; what breaks a law is kept and rechecked.

A counterexample to a law of impacts is a record: what was struck, what came of it, the law, and a test to paste.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import reports.campaign
from iapb.errors import RunFileError
from reports.campaign import Campaign
from reports.cli import main
from reports.counterexamples import ENGINE, CampaignRequest, keep_counterexample, read_counterexample, recheck
from reports.store import write_run
from reports.store.tables import read_record, write_record
from tests.reports.made_up import made_run
from tests.verification.laws.faults import returns_too_much
from verification.laws.bounds import LawResidual
from verification.laws.campaign import IMPACTS, TRAJECTORIES, UNEQUAL, Batch, Found, drawn, plan, residuals
from verification.laws.counterexample import strike
from verification.laws.planted import doubled_impulse

SOUND = CampaignRequest("verification.laws:sound_resolver", "KIT", 1e8, 60, 0, 0, 1)
BROKEN = replace(SOUND, resolver="verification.laws.planted:wrong_sign")
# The planted fault: 1e-4 too much of every impulse, computed in exact rationals, so that no BLAS has a say.
FAULTY = replace(SOUND, resolver="tests.verification.laws.faults:returns_too_much", impacts=600)
BATCHES = tuple(Batch(IMPACTS, first, 5) for first in range(0, 20, 5))


def silent(part, done, total):
    """No progress."""


def test_a_second_run_computes_nothing_and_a_longer_one_only_what_is_missing_however_it_is_cut(tmp_path):
    campaign, whole, seen = Campaign(tmp_path / "cut", SOUND), Campaign(tmp_path / "whole", SOUND), []
    campaign.run(BATCHES[:2], silent)
    written = {batch: campaign.path_of(batch).stat().st_mtime_ns for batch in BATCHES[:2]}
    campaign.run(BATCHES, lambda *told: seen.append(told))
    assert seen[0] == (IMPACTS, 10, 20) and seen[-1] == (IMPACTS, 20, 20)
    assert {batch: campaign.path_of(batch).stat().st_mtime_ns for batch in written} == written
    counts = campaign.counts(BATCHES)
    assert counts[IMPACTS]["kinetic_energy"].checked == 20 and campaign.counterexamples() == []
    assert not any(count.failures for count in counts[IMPACTS].values())
    whole.run([Batch(IMPACTS, 0, 20)], silent)
    assert whole.counts([Batch(IMPACTS, 0, 20)]) == counts


def test_another_resolver_or_tolerance_has_another_folder_and_a_file_that_is_not_there_is_named():
    with pytest.raises(RunFileError, match="no such file"):
        list(recheck(Path("absent.h5")))
    keys = {request.key() for request in (SOUND, BROKEN, replace(SOUND, bounds="FACTORED"), replace(SOUND, seed=1))}
    assert len(keys) == 4
    assert replace(SOUND, workers=2, impacts=7).key() == SOUND.key()


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    campaign = Campaign(tmp_path_factory.mktemp("out"), FAULTY)
    campaign.run([Batch(IMPACTS, 471, 1)], silent)  # elastic, so it gains energy
    [path] = [path for path in campaign.counterexamples() if "kinetic_energy" in path.name]
    return path


def test_it_says_what_was_struck_and_is_judged_again_and_its_test_fails_as_pasted(kept, capsys):
    case, broken = drawn(IMPACTS, 471, FAULTY.subject()), read_counterexample(kept)
    [(law, residual)] = recheck(kept, allow_code=True)
    for name in ("mass_matrix", "contact_jacobian", "velocity"):
        assert np.array_equal(getattr(broken["case"], name), getattr(case, name))
    assert (broken["case"].restitution, broken["case"].family) == (case.restitution, case.family)
    again = returns_too_much(case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution)
    assert np.array_equal(broken["velocity_after"], [again]) and broken["index"] == 471
    assert law == broken["law"] == "kinetic_energy" and residual.value > residual.tolerance
    assert (residual.value, residual.tolerance) == (broken["value"], broken["tolerance"])
    assert main(["inspect", str(kept)]) == 0
    out = capsys.readouterr().out
    assert "breaks a law, kinetic_energy: KE⁺ ≤ KE⁻" in out and "case 471" in out and "velocity after" in out
    assert broken["test"] in out and main(["inspect", str(kept), "--json"]) == 0
    space = {}
    exec(broken["test"], space)
    with pytest.raises(AssertionError):
        space["test_kinetic_energy"]()


def test_a_file_that_names_a_module_does_not_run_it_and_one_that_lacks_a_part_is_refused(
    kept, tmp_path, capsys, monkeypatch
):
    """The attack: a counterexample that names a module of the working directory, which leaves a trace if imported."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "trap_of_theirs.py").write_text("from pathlib import Path\nPath('trace').touch()\nresolver = print\n")
    broken = read_record(kept)
    broken["request"]["resolver"] = "trap_of_theirs:resolver"
    write_record(Path("evil.h5"), broken, "evil")
    assert main(["verify", "--recheck", "evil.h5"]) == 0  # the engine keeps the law
    said = capsys.readouterr().out
    assert "by iapb:resolve_impact; trap_of_theirs:resolver, which the file names" in said
    assert not Path("trace").exists() and "trap_of_theirs" not in sys.modules
    cases = [{"case": broken["case"] | {name: value}} for name, value in (
        ("mass_matrix", 1e308), ("velocity", 1e308), ("translations", 1e308), ("mass_matrix", [0.0] * 3),
        ("contact_jacobian", [0.0] * 3))]  # fmt: skip
    wrongs = [broken | wrong for wrong in (
        *cases, {"value": "NaN?"}, {"index": float("inf")}, {"velocity_after": [[1.0], []]}, {"tolerance": {}},
        {"test": "", "index": -1}, {"request": broken["request"] | {"bounds": "__loader__"}})]  # fmt: skip
    for wrong in (*wrongs, *({name: broken[name] for name in broken if name != lost} for lost in
                             ("part", "request", "test"))):  # fmt: skip
        write_record(Path("evil.h5"), wrong, "evil")
        with pytest.raises(RunFileError, match="is no counterexample"):
            list(recheck(Path("evil.h5")))
        assert main(["inspect", "evil.h5"]) in (0, 1)
    assert reports.counterexamples.recheck_command(Path("x; touch trace"), ENGINE) == (
        "iapb verify --recheck 'x; touch trace'")


def kept_again(part, case, request, law, folder):
    found = Found(law, part, 7, LawResidual(law, 1.0, 0.0), case, None, strike(part, case, request.subject().resolver))
    return read_counterexample(keep_counterexample(folder, found, request))


def test_unequal_restitution_and_known_motions_come_back_and_so_do_the_words_of_a_resolver_that_raises(tmp_path):
    cases = (drawn(UNEQUAL, index, FAULTY.subject()) for index in range(400))
    case = next(case for case in cases if case.translations is not None and case.contacts > 1)
    stored = kept_again(UNEQUAL, case, replace(FAULTY, resolver=ENGINE), "unequal_momentum", tmp_path)["case"]
    assert np.array_equal(stored.unequal, case.unequal) and np.array_equal(stored.translations, case.translations)
    request = replace(FAULTY, resolver="tests.verification.laws.faults:gives_up")
    broken = kept_again(IMPACTS, drawn(IMPACTS, 3, request.subject()), request, "kinetic_energy", tmp_path)
    assert np.all(np.isnan(broken["velocity_after"])) and broken["complaint"]


@pytest.mark.parametrize("part", ["truncation", "extremes"])
def test_the_engines_own_laws_of_impacts_are_judged_again_too(part, tmp_path):
    cases = (drawn(part, index, FAULTY.subject()) for index in range(100))
    case = next(case for case in cases if case.contacts > 2 and case.coordinates > 2)
    broken = kept_again(part, case, FAULTY, part, tmp_path)
    assert broken["resolver"] == ENGINE
    if part == "truncation":  # a line for each budget; without a row nothing changes
        assert broken["rows"] == list(range(min(case.contacts, case.coordinates) + 1))
        assert np.array_equal(broken["velocity_after"][0], case.velocity)
    assert dict(recheck(next(tmp_path.glob("*.h5"))))[part].passed
    space = {}
    exec(broken["test"], space)
    space[f"test_{part}"]()


def test_a_trajectory_is_kept_as_its_run(tmp_path):
    subject = SOUND.subject()
    run = next(run for index in range(20) if (run := doubled_impulse(drawn(TRAJECTORIES, index, subject))) is not None)
    found = Found("impulse_momentum", TRAJECTORIES, 0, LawResidual("", 1.0, 0.0), None, run)
    judged = dict(recheck(keep_counterexample(tmp_path, found, SOUND)))
    assert not judged["as recorded: impulse_momentum"].passed
    assert judged["simulated again: impulse_momentum"].passed


@pytest.mark.parametrize("part", ["hand_port", "device_port", "device_limits", "group_splitting"])
def test_a_case_that_is_no_impact_is_drawn_again(part, tmp_path):
    case = drawn(part, 3, SOUND.subject())
    residual = residuals(part, case, SOUND.subject())[0][part]
    path = keep_counterexample(tmp_path, Found(part, part, 3, residual, case), SOUND)
    assert list(recheck(path)) == [(part, residual)]


def test_a_run_is_no_counterexample_and_of_many_the_first_are_kept(tmp_path, monkeypatch):
    assert read_counterexample(write_run(tmp_path / "run.h5", made_run())) is None
    monkeypatch.setattr(reports.campaign, "KEPT_PER_LAW", 3)
    campaign, batches = Campaign(tmp_path, BROKEN), [Batch(IMPACTS, 0, 10), Batch(IMPACTS, 10, 10)]
    campaign.run(batches, silent)
    files = [path.name for path in campaign.counterexamples() if path.name.endswith("-kinetic_energy.h5")]
    assert len(files) == 3 < campaign.counts(batches)[IMPACTS]["kinetic_energy"].failures


def test_the_plan_covers_every_part_once():
    batches = plan(1_000_000, 5000)
    impacts = sorted((batch.first, batch.count) for batch in batches if batch.part == IMPACTS)
    assert sum(count for _, count in impacts) == 1_000_000
    assert all(first + count == following for (first, count), (following, _) in zip(impacts, impacts[1:], strict=False))
    assert sum(batch.count for batch in batches if batch.part == TRAJECTORIES) == 5000
    assert any(batch.part == UNEQUAL for batch in batches)


def test_what_is_stopped_tells_what_there_is(tmp_path, capsys, monkeypatch):
    whole = Campaign.run

    def interrupted(self, batches, progress):
        whole(self, [Batch(IMPACTS, 0, 30)], progress)
        raise KeyboardInterrupt

    monkeypatch.setattr(Campaign, "run", interrupted)
    full = ["verify", "--full", "--resolver", SOUND.resolver, "--impacts", "30", "--out", str(tmp_path)]
    assert main(full) == 130
    assert "kinetic_energy: 0 of 30 break it" in capsys.readouterr().out
    monkeypatch.undo()
    assert main(full) == 0
    assert "1 of them done before" in capsys.readouterr().out
