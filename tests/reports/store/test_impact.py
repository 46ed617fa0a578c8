"""A counterexample to a law of impacts is a record: what was struck, what came of it, the law, and a test to paste."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import reports.campaign
from iapb.errors import RunFileError
from iapb.run import Run
from reports.campaign import Campaign
from reports.cli import main
from reports.counterexamples import CampaignRequest, keep_counterexample, read_counterexample, recheck
from reports.store import write_run
from reports.store.tables import read_record, write_record
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


def read(path: Path) -> dict[str, Any]:
    found = read_counterexample(path)
    assert found is not None
    return found


def test_it_says_what_was_struck_and_what_came_of_it_and_is_judged_again(kept: Path) -> None:
    case, broken, [(law, residual)] = drawn(IMPACTS, 471, FAULTY.subject()), read(kept), recheck(kept, allow_code=True)
    for name in ("mass_matrix", "contact_jacobian", "velocity"):
        assert np.array_equal(getattr(broken["case"], name), getattr(case, name))
    assert (broken["case"].restitution, broken["case"].family) == (case.restitution, case.family)
    again = returns_too_much(case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution)
    assert np.array_equal(broken["velocity_after"], [again]) and broken["index"] == 471
    assert law == broken["law"] == "kinetic_energy" and residual.value > residual.tolerance
    assert (residual.value, residual.tolerance) == (broken["value"], broken["tolerance"])
    assert kept.with_suffix(".hdf5").is_file()


def test_inspect_reads_it_and_its_test_fails_as_pasted(kept: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["inspect", str(kept)]) == 0
    out, test = capsys.readouterr().out, read(kept)["test"]
    assert "breaks a law, kinetic_energy: KE⁺ ≤ KE⁻" in out and "case 471" in out and "velocity after" in out
    assert test in out and main(["inspect", str(kept), "--json"]) == 0
    space: dict[str, object] = {}
    exec(test, space)
    with pytest.raises(AssertionError):
        space["test_kinetic_energy"]()  # type: ignore[operator]


def _keep(part: str, case: ImpactCase, request: CampaignRequest, law: str, folder: Path) -> dict[str, Any]:
    struck = strike(part, case, request.subject().resolver)
    found = Found(law, part, 7, LawResidual(law, 1.0, 0.0), case, None, struck)
    return read(keep_counterexample(folder, found, request))


def test_unequal_restitution_and_known_motions_come_back(tmp_path: Path) -> None:
    cases = (drawn(UNEQUAL, index, FAULTY.subject()) for index in range(400))
    case = next(case for case in cases if case.translations is not None and case.contacts > 1)
    engine = replace(FAULTY, resolver="iapb:resolve_impact")
    stored = _keep(UNEQUAL, case, engine, "unequal_momentum", tmp_path)["case"]
    assert np.array_equal(stored.unequal, case.unequal) and np.array_equal(stored.translations, case.translations)


@pytest.mark.parametrize("part", ["truncation", "extremes"])
def test_the_engines_own_laws_of_impacts_are_judged_again_too(part: str, tmp_path: Path) -> None:
    cases = (drawn(part, index, FAULTY.subject()) for index in range(100))
    case = next(case for case in cases if case.contacts > 2 and case.coordinates > 2)
    broken = _keep(part, case, FAULTY, part, tmp_path)
    assert broken["resolver"] == "iapb:resolve_impact"
    if part == "truncation":  # a line for each budget; without a row nothing changes
        assert broken["rows"] == list(range(min(case.contacts, case.coordinates) + 1))
        assert np.array_equal(broken["velocity_after"][0], case.velocity)
    assert dict(recheck(next(tmp_path.glob("*.h5"))))[part].passed
    space: dict[str, object] = {}
    exec(broken["test"], space)
    space[f"test_{part}"]()  # type: ignore[operator]


def test_a_resolver_that_raises_leaves_no_velocity_and_its_words(tmp_path: Path) -> None:
    request = replace(FAULTY, resolver="tests.verification.laws.faults:gives_up")
    broken = _keep(IMPACTS, drawn(IMPACTS, 3, request.subject()), request, "kinetic_energy", tmp_path)
    assert np.all(np.isnan(broken["velocity_after"])) and broken["complaint"]


@pytest.mark.parametrize("spoiled", ["mass_matrix", "contact_jacobian", "part", "request", "test"])
def test_a_file_that_lacks_a_part_or_has_it_in_another_shape_is_refused(spoiled: str, kept: Path) -> None:
    record = read_record(kept)
    if spoiled in record:
        del record[spoiled]
    else:
        record["case"][spoiled] = [0.0] * 3
    with pytest.raises(RunFileError, match="is no counterexample"):
        read_counterexample(write_record(kept, record, "spoiled"))


def test_a_run_is_no_counterexample_and_of_many_the_first_are_kept(
    tmp_path: Path, make_run: Callable[..., Run], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert read_counterexample(write_run(tmp_path / "run.h5", make_run())) is None
    monkeypatch.setattr(reports.campaign, "KEPT_PER_LAW", 3)
    campaign = Campaign(tmp_path, CampaignRequest("verification.laws.planted:wrong_sign", "KIT", 1e8, 60, 0, 0, 1))
    batches = [Batch(IMPACTS, 0, 10), Batch(IMPACTS, 10, 10)]
    campaign.run(batches, lambda *told: None)
    files = [path.name for path in campaign.counterexamples() if path.name.endswith("-kinetic_energy.h5")]
    assert len(files) == 3 < campaign.counts(batches)[IMPACTS]["kinetic_energy"].failures
