"""A topic that cannot be computed costs the report that topic alone."""

from __future__ import annotations

from pathlib import Path

import pytest

from reports.evidence import gather
from reports.evidence.topics import failed_topic
from reports.pages.records import Evidence
from reports.runner import Runner
from tests.reports.joined import joined
from verification.finding import NOT_COMPUTED, Finding, Part, failure_of, finding_of

COMPUTED = finding_of("engines", "Other engines", "", "all well", (Part("all well", "reproduced"),))


def kept(folder: Path) -> gather._Kept:
    return gather._Kept(folder / "tables", "quick", lambda stage, done, total: None, Runner(folder / "runs"))


def test_the_reason_is_said_and_the_next_time_it_is_tried_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def compute(name: str, *rest: object) -> Finding:
        raise RuntimeError("the disk went away\nand more")

    stages = kept(tmp_path)
    monkeypatch.setattr(gather, "compute_topic", compute)
    topic = gather._topic(stages, "engines", stages.runner, "quick")
    assert topic.key == "engines" and [part.verdict for part in topic.parts] == [NOT_COMPUTED]
    assert "RuntimeError: the disk went away" in topic.answer and "and more" not in topic.answer
    [failed] = stages.failed()
    assert failed.file == str(tmp_path / "tables" / "engines-failed.txt")
    assert "in compute" in Path(failed.file).read_text()
    monkeypatch.setattr(gather, "compute_topic", lambda *given: COMPUTED)
    stages = kept(tmp_path)
    assert gather._topic(stages, "engines", stages.runner, "quick") == COMPUTED
    assert not stages.failed() and not Path(failed.file).exists()


def test_the_first_page_says_so() -> None:
    topic = failed_topic("haptic-rate", failure_of("all of it", ValueError("no clock")))
    page = joined(Evidence(topics=(topic,)), ())
    first = page.split('<section id="verdict"')[1].split("</section>")[0]
    assert "Not computed, after ValueError: no clock." in first
    assert 'href="report/haptic-rate.html#haptic-rate"' in first


def test_ctrl_c_is_no_failure_of_a_topic(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def compute(name: str, *rest: object) -> Finding:
        raise KeyboardInterrupt

    stages = kept(tmp_path)
    monkeypatch.setattr(gather, "compute_topic", compute)
    with pytest.raises(KeyboardInterrupt):
        gather._topic(stages, "engines", stages.runner, "quick")
