"""What the project itself compares with Pinocchio: nothing left out, and a reading that is wrong is found."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.mechanics.joints import KINDS
from reference.rigid_body import model_from_urdf
from verification.mechanics import robots
from verification.mechanics.random_urdf import TYPES, random_urdf


@pytest.fixture(autouse=True)
def few(monkeypatch):
    monkeypatch.setattr(robots, "STATES", 5)
    monkeypatch.setattr(robots, "WRITTEN", {"quick": 1})


def test_every_kind_of_joint_agrees_alone():
    finding = robots.compare_kinds()
    assert finding.passed
    assert {name.split()[1] for name in finding.column("mechanism")} == set(KINDS)


def test_every_scene_has_a_mechanism_that_agrees():
    finding = robots.compare_scenes()
    assert finding.passed
    assert {"peg_corner", "tumbling_body", "arm_obstacles"} <= set(finding.column("mechanism"))


def test_texts_are_read_as_pinocchio_reads_them():
    finding = robots.compare_written()
    assert finding.passed
    assert set(finding.column("base")) == {"fixed", "floating"}


def test_a_reading_that_turns_inertias_wrongly_is_found(tmp_path):
    def careless(path, floating):
        other = tmp_path / "other.urdf"
        other.write_text(path.read_text().replace('ixx="', 'ixx="1'))
        return model_from_urdf(other, floating)

    finding = robots.compare_written(reader=careless)
    assert finding.passed is False and len(finding.that(False).rows) == len(finding.rows)


def test_a_text_has_every_joint_type_and_repeats_with_its_seed():
    text = random_urdf(np.random.default_rng(7), 12)
    assert all(f'type="{kind}"' in text for kind in TYPES)
    assert text == random_urdf(np.random.default_rng(7), 12)
