"""An impact that broke a law is a run file: what was struck, what came of it, the law, and a test to paste."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import h5py
import numpy as np
import pytest

import reports.campaign
from iapb.errors import RunFileError
from iapb.run import Run
from reports.campaign import Campaign
from reports.cli import main
from reports.counterexamples import CampaignRequest, keep_counterexample, recheck
from reports.store import read_run, write_run
from reports.store.care import PARTIAL, check_store
from reports.store.impact import read_broken_impact
from reports.store.io import new_file
from tests.verification.laws.faults import returns_too_much
from verification.impacts import ImpactCase
from verification.laws.bounds import LawResidual
from verification.laws.campaign import IMPACTS, UNEQUAL, Batch, Found, drawn
from verification.laws.counterexample import strike

# The planted fault: 1e-4 too much of every impulse, computed in exact rationals, so that no BLAS has a say.
FAULTY = CampaignRequest("tests.verification.laws.faults:returns_too_much", "KIT", 1e8, 600, 0, 0, 1)
BATCH = Batch(IMPACTS, 471, 1)  # elastic, so it gains energy


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    campaign = Campaign(tmp_path / "out", FAULTY)
    campaign.run([BATCH], lambda *told: None)
    [path] = [path for path in campaign.counterexamples() if "kinetic_energy" in path.name]
    return path


def test_the_run_says_what_was_struck_and_what_came_of_it(kept: Path) -> None:
    case, broken = drawn(IMPACTS, 471, FAULTY.subject()), read_broken_impact(kept)
    assert broken is not None and broken.law == "kinetic_energy" and broken.value > broken.tolerance
    stored = broken.struck.case
    for name in ("mass_matrix", "contact_jacobian", "velocity"):
        assert np.array_equal(getattr(stored, name), getattr(case, name))
    assert (stored.restitution, stored.family, stored.unequal) == (case.restitution, case.family, None)
    again = returns_too_much(case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution)
    assert np.array_equal(broken.struck.velocity_after, [again])
    assert broken.found["index"] == 471 and broken.found["request"]["resolver"] == FAULTY.resolver


def test_it_is_a_run_that_ends_in_its_first_impact(kept: Path) -> None:
    run, broken = read_run(kept), read_broken_impact(kept)
    assert broken is not None
    case, after = broken.struck.case, broken.struck.velocity_after[0]
    assert run.steps == 0 and not run.complete and "breaks kinetic_energy" in run.stopped
    assert np.array_equal(run.v, [case.velocity]) and np.array_equal(run.impacts.v_plus, [after])
    M, a, b = ([[Fraction(x) for x in row] for row in rows] for rows in
               (case.mass_matrix.tolist(), [case.velocity.tolist()], [after.tolist()]))
    energy = [sum(M[i][j] * v[0][i] * v[0][j] for i in range(len(M)) for j in range(len(M))) / 2 for v in (a, b)]
    assert run.impacts.energy_lost[0] == float(energy[0] - energy[1]) < 0.0
    assert run.impacts.rank[0] == -1 and np.isnan(run.impacts.clamp[0])  # nobody said


def test_inspect_reads_it_and_its_test_fails_as_pasted(kept: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["inspect", str(kept)]) == 0
    out = capsys.readouterr().out
    assert "breaks a law, kinetic_energy: KE⁺ ≤ KE⁻" in out and "case 471" in out and "velocity after" in out
    broken = read_broken_impact(kept)
    assert broken is not None and broken.test in out
    space: dict[str, object] = {}
    exec(broken.test, space)
    with pytest.raises(AssertionError):
        space["test_kinetic_energy"]()  # type: ignore[operator]


def test_it_is_judged_again_from_the_file(kept: Path) -> None:
    broken, [(law, residual)] = read_broken_impact(kept), recheck(kept, allow_code=True)
    assert broken is not None and law == "kinetic_energy"
    assert (residual.value, residual.tolerance) == (broken.value, broken.tolerance)
    assert kept.with_suffix(".hdf5").is_file()
    assert all(one.state == PARTIAL for one in check_store(kept.parent))


def _keep(part: str, case: ImpactCase, request: CampaignRequest, law: str, folder: Path) -> Path:
    struck = strike(part, case, request.subject().resolver)
    return keep_counterexample(folder, Found(law, part, 7, LawResidual(law, 1.0, 0.0), case, None, struck), request)


def test_unequal_restitution_and_known_motions_come_back(tmp_path: Path) -> None:
    cases = (drawn(UNEQUAL, index, FAULTY.subject()) for index in range(400))
    case = next(case for case in cases if case.translations is not None and case.contacts > 1)
    broken = read_broken_impact(_keep(UNEQUAL, case, replace(FAULTY, resolver="iapb:resolve_impact"),
                                      "unequal_momentum", tmp_path / "kept"))  # fmt: skip
    assert broken is not None
    stored = broken.struck.case
    assert np.array_equal(stored.unequal, case.unequal) and np.array_equal(stored.translations, case.translations)
    assert stored.restitution == case.restitution


@pytest.mark.parametrize("part", ["truncation", "extremes"])
def test_the_engines_own_laws_of_impacts_are_runs_too(part: str, tmp_path: Path) -> None:
    cases = (drawn(part, index, FAULTY.subject()) for index in range(100))
    case = next(case for case in cases if case.contacts > 2 and case.coordinates > 2)
    path = _keep(part, case, FAULTY, part, tmp_path / "kept")
    broken, run = read_broken_impact(path), read_run(path)
    assert broken is not None and broken.resolver == "iapb:resolve_impact"
    if part == "truncation":  # a line for each budget; without a row nothing changes
        assert run.impacts.rows.tolist() == list(range(min(case.contacts, case.coordinates) + 1))
        assert np.array_equal(broken.struck.velocity_after[0], case.velocity)
    assert dict(recheck(path))[part].passed
    assert f"ENGINE_LAWS['{part}']" in broken.test
    space: dict[str, object] = {}
    exec(broken.test, space)
    space[f"test_{part}"]()  # type: ignore[operator]


def test_a_resolver_that_raises_leaves_no_velocity_and_its_words(tmp_path: Path) -> None:
    request = replace(FAULTY, resolver="tests.verification.laws.faults:gives_up")
    case = drawn(IMPACTS, 3, request.subject())
    path = _keep(IMPACTS, case, request, "kinetic_energy", tmp_path / "kept")
    broken = read_broken_impact(path)
    assert broken is not None and np.all(np.isnan(broken.struck.velocity_after))
    assert broken.struck.complaint and broken.struck.complaint in read_run(path).stopped
    assert read_run(path).impacts.approaching.tolist() == [-1]


@pytest.mark.parametrize("spoiled", ["mass_matrix", "velocity_after", "value", "contact_jacobian", "struck"])
def test_a_file_that_lacks_a_part_or_has_it_in_another_shape_is_refused(spoiled: str, kept: Path) -> None:
    with new_file(kept.with_name("spoiled.h5"), replace=True) as file, h5py.File(kept) as good:
        file.attrs.update(good.attrs)
        told = json.loads(good["struck"].asstr()[()])
        if spoiled == "value":
            del told[spoiled]
        elif spoiled in told["struck"]:
            told["struck"][spoiled] = [0.0] * 3
        elif spoiled != "struck":
            told["struck"]["case"][spoiled] = [0.0] * 3
        file["struck/law" if spoiled == "struck" else "struck"] = json.dumps(told)  # a group: of an earlier version
    with pytest.raises(RunFileError):
        read_broken_impact(kept.with_name("spoiled.h5"))


def test_a_run_of_a_scene_has_nothing_struck_and_of_many_broken_impacts_the_first_are_kept(
    tmp_path: Path, make_run: Callable[..., Run], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert read_broken_impact(write_run(tmp_path / "run.h5", make_run())) is None
    monkeypatch.setattr(reports.campaign, "KEPT_PER_LAW", 3)
    campaign = Campaign(tmp_path, CampaignRequest("verification.laws.planted:wrong_sign", "KIT", 1e8, 60, 0, 0, 1))
    batches = [Batch(IMPACTS, 0, 10), Batch(IMPACTS, 10, 10)]
    campaign.run(batches, lambda *told: None)
    files = [path.name for path in campaign.counterexamples() if path.name.endswith("-kinetic_energy.h5")]
    assert len(files) == 3 < campaign.counts(batches)[IMPACTS]["kinetic_energy"].failures
