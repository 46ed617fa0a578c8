"""The studies of robots: complete, judged by the worst row, skipped with a reason; nothing is timed here."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.errors import ArgumentError
from reference.random_mechanisms import random_mechanism
from verification.mechanics import robot_timing, robots

ARM = """<robot name="arm">
  <link name="base"/>
  <link name="arm"><inertial><origin xyz="0.2 0 0"/><mass value="2"/>
    <inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="flange"><inertial><mass value="1"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="weld" type="fixed"><parent link="arm"/><child link="flange"/><origin xyz="0.4 0 0"/></joint>
</robot>"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "arm.urdf").write_text(ARM)
    return tmp_path


def test_robots_of_a_folder_agree_with_a_fixed_and_a_floating_base(folder):
    finding = robots.compare_robots(folder)
    assert finding.passed and finding.rows
    assert finding.column("base") == ["fixed", "floating"]
    assert finding.column("states") == [robots.STATES] * 2


def test_a_folder_that_is_not_there_is_skipped_with_the_reason(tmp_path):
    for study in (robots.compare_robots, robot_timing.time_robots):
        finding = study(tmp_path / "nowhere")
        assert finding.passed is None and finding.rows == () and "nowhere" in finding.note


def test_random_trees_agree_in_every_quantity(monkeypatch):
    monkeypatch.setattr(robots, "STATES", 10)
    monkeypatch.setattr(robots, "TREES", {"quick": 1})
    finding = robots.compare_trees()
    assert finding.passed and finding.column("bodies") == list(robots.TREE_SIZES)
    assert all(value is not None for row in finding.rows for value in row)


def test_the_comparison_fails_when_one_mass_is_wrong(monkeypatch):
    from dataclasses import replace

    def heavier(mechanism):
        body = mechanism.bodies[0]
        return original(type(mechanism)([replace(body, mass=1.001 * body.mass), *mechanism.bodies[1:]]))

    original = robots.model_of
    monkeypatch.setattr(robots, "STATES", 2)
    monkeypatch.setattr(robots, "model_of", heavier)
    monkeypatch.setattr(robots, "random_mechanism", lambda rng, n: random_mechanism(rng, n, ("revolute",)))
    finding = robots.compare_trees()
    assert finding.passed is False and len(finding.that(False).rows) == len(finding.rows)


def test_times_are_positive_and_judged_by_form(folder, monkeypatch):
    monkeypatch.setattr(robot_timing, "STATES", 3)
    monkeypatch.setattr(robot_timing, "ROUNDS", {"quick": 2})
    table = robot_timing.time_robots(folder)
    assert len(table.rows) == 4 and len(table.holds) == 4
    assert all(np.array([row[4:] for row in table.rows]).ravel() > 0.0)


def test_depths_are_checked_and_an_empty_finding_is_undecided(tmp_path):
    with pytest.raises(ArgumentError, match="depth"):
        robots.compare_trees("deeper")
    assert robot_timing.time_robots(tmp_path).passed is None
