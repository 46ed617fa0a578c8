"""The comparison with Pinocchio and the references is complete, and notices a wrong mass, reading,
gap or e."""

from __future__ import annotations

from dataclasses import replace

import pytest

from iapb.mechanics.joints import KINDS
from reference.rigid_body import model_from_urdf
from verification.check import Study
from verification.finding import REFUTED, REPRODUCED
from verification.mechanics import against_pinocchio as study

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


@pytest.fixture(autouse=True)
def few(monkeypatch, tmp_path):
    """Few states; one robot in the folder."""
    for name, value in (
        ("STATES", 2),
        ("TREES", {"quick": 1}),
        ("ROBOTS", tmp_path),
    ):
        monkeypatch.setattr(study, name, value)
    (tmp_path / "arm.urdf").write_text(ARM)
    return tmp_path


def cases(*sets):
    return [case for case in study.AGAINST_PINOCCHIO.cases(Study()) if case.set in sets]


def test_every_set_is_compared_and_agrees():
    table = study.AGAINST_PINOCCHIO.table(Study())
    assert table.passed and all(value is not None for row in table.rows for value in row)
    of = {name: table.where(set=name)["mechanism"] for name in set(table["set"])}
    assert {name.split()[1] for name in of["joint kinds"]} == set(KINDS)
    assert {"peg_corner", "tumbling_body", "arm_obstacles"} <= set(of["scenes"])
    assert [name.split()[-1] for name in of["random trees"]] == list(map(str, study.TREE_SIZES))
    assert table.where(set=study.OTHERS)["base"] == ["fixed", "floating"]
    assert {part.verdict for part in study.AGAINST_PINOCCHIO.judge(table)} == {REPRODUCED}


def test_robots_that_are_not_there_are_left_out(monkeypatch, tmp_path):
    monkeypatch.setattr(study, "ROBOTS", tmp_path / "nowhere")
    assert not cases(study.OTHERS) and cases("joint kinds")


def test_a_wrong_mass_is_noticed_in_every_tree(monkeypatch):
    def heavier(mechanism):
        body = mechanism.bodies[0]
        return original(
            type(mechanism)([replace(body, mass=1.001 * body.mass), *mechanism.bodies[1:]])
        )

    original = study.model_of
    monkeypatch.setattr(study, "model_of", heavier)
    chosen = [case for case in cases("joint kinds") if "revolute" in case.label]
    table = study.AGAINST_PINOCCHIO.table(Study(), chosen)
    assert set(table.holds) == {False} and REFUTED in {
        part.verdict for part in study.AGAINST_PINOCCHIO.judge(table)
    }


def test_a_reading_that_turns_inertias_wrongly_is_noticed(monkeypatch, tmp_path):
    def careless(path, floating):
        other = tmp_path / "other.urdf"
        other.write_text(path.read_text().replace('ixx="', 'ixx="1'))
        return model_from_urdf(other, floating)

    monkeypatch.setattr(study, "model_from_urdf", careless)
    assert set(study.AGAINST_PINOCCHIO.table(Study(), cases("URDF texts")).holds) == {False}


def test_impacts_agree_with_pinocchio_and_another_restitution_does_not(monkeypatch):
    assert study.IMPULSE_DYNAMICS.table(Study(), (100,)).passed
    theirs = study.impulse_dynamics
    monkeypatch.setattr(study, "impulse_dynamics", lambda M, J, v, e: theirs(M, J, v, e + 1e-6))
    assert study.IMPULSE_DYNAMICS.table(Study(), (100,)).passed is False
