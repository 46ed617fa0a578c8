"""`iapb verify-many`: what breaks a law is a test or a run, and Ctrl-C tells what was found until
then."""

from contextlib import nullcontext

import pytest

from reports.cli import main
from reports.commands import verify_many
from reports.store import read_run
from tests.reports.made_up import made_run
from verification.laws.bounds import LawCount, LawResidual
from verification.laws.full import TRAJECTORIES, Found, Outcome, drawn_again


class Here:
    """An executor in this process, interrupted at the third batch."""

    def map(self, judge, batches):
        yield judge(batches[0])
        yield judge(batches[1])
        raise KeyboardInterrupt


def test_ctrl_c_tells_what_was_judged_until_then_and_stores_a_run_that_breaks_a_law(
    capsys, monkeypatch, tmp_path
):
    def judged(resolver, seed, batch):
        count = LawCount("ledger")
        count.add(LawResidual("ledger", float(batch.first == 0), 0.5))
        found = (Found("ledger", TRAJECTORIES, 7, "", made_run()),) if batch.first == 0 else ()
        return Outcome(batch.part, (count,), found)

    monkeypatch.setattr(verify_many, "executor", lambda workers: nullcontext(Here()))
    monkeypatch.setattr(verify_many, "_judged", judged)
    monkeypatch.chdir(tmp_path)
    assert main(["verify-many", "--impacts", "2000"]) == 130
    said = capsys.readouterr().out
    assert "2 of " in said and "then stopped" in said and "BROKEN ledger: 1 of 2 break it" in said
    assert "out/runs/trajectories-seed0-7.h5" in said
    assert read_run(tmp_path / "out/runs/trajectories-seed0-7.h5").world == "IAPB"


@pytest.mark.parametrize(
    ("part", "law"),
    [("truncation", "truncation"), (TRAJECTORIES, "finite")],
)
def test_a_case_that_is_no_impact_of_a_resolver_is_drawn_again_by_its_test(part, law):
    space = {}
    exec(drawn_again(law, part, 5, seed=3), space)
    space[f"test_{law}"]()
