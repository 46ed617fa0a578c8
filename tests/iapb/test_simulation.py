"""The loop: compiled or stepped from Python it is one algorithm, and no run depends on what ran
before."""

from __future__ import annotations

import copy
import itertools
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from iapb import recording
from iapb.advice.distrust import distrust_of
from iapb.contact.laws import RENDERINGS, ImpulseAugmented, Penalty, StepResult
from iapb.errors import ArgumentError
from iapb.haptics.coupling import FourChannel, NoCoupling
from iapb.loop import CONTACTS, IMPACTS
from iapb.numerics.schema import quantities
from iapb.run import FREE, Run
from iapb.scene import find_scene, load_scene, scene_from_text
from iapb.simulation import Simulation, simulate
from iapb.system import coupling_of
from reports.store.keys import content_hash
from tests.iapb.test_recording import assert_same
from tests.iapb.test_simulation_stops import Wrapped

# A tilted, rough peg and a weak device: contacts one by one, friction, and impulses that exceed the
# limits.
PEG = load_scene(find_scene("peg_corner")).with_values(
    {
        "bodies.peg.position": [0.0209, -0.0141, 0.08],
        "contact.friction": 0.1,
        "device.force_limit": [3, 3, 0.05],
        "device.delay": 2,
        "device.position_resolution": [1e-5, 1e-5, 0],
        "device.damping": [0.5, 0.5, 0],
    }
)
CRADLE = load_scene(find_scene("newton_cradle"))
# inertia that varies, velocity terms, a group of two trees
ARM = load_scene(find_scene("arm_pushing"))
STEPS = 350  # past the fourth collision of the peg
COUPLINGS = ("none", "four-channel", "unilateral")
LAWS = [Penalty(), *(ImpulseAugmented(rendering=rendering) for rendering in RENDERINGS)]
LAWS += [ImpulseAugmented(integrator="momentum")]
FORCES = tuple(each.name for each in quantities(Run, "step") if each.name != "state")


def name_of(law):
    return "-".join([law.name.split(" ")[0], *map(str, law.settings.values())])


@pytest.mark.parametrize(
    ("scene", "coupling"),
    [*itertools.product((PEG, ARM), COUPLINGS), (CRADLE, "none")],
    ids=lambda value: getattr(value, "name", value),
)
@pytest.mark.parametrize("law", LAWS, ids=name_of)
def test_the_compiled_loop_records_what_each_step_from_python_does_bit_for_bit(
    scene, coupling, law
):
    chosen = coupling_of(scene, coupling)
    run = simulate(scene, law, chosen, steps=STEPS)
    stepped = Simulation(scene, law, chosen)
    state = stepped.state
    port = stepped.port
    impact = 0
    for k in range(STEPS):
        result = stepped.step()
        for names, line in ((("q", "v", "device_q", "device_v"), k + 1), (FORCES, k)):
            for name in names:
                made = next(
                    getattr(each, name) for each in (result, port, state) if hasattr(each, name)
                )
                assert np.array_equal(getattr(run, name)[line], made), (k, name)
        assert result.state == run.state[k]
        rows = slice(run.contacts.offsets[k], run.contacts.offsets[k + 1])
        count = state.contact_count[0]
        logged = state.impacts.logged[0]
        assert rows.stop - rows.start == count
        for each in CONTACTS:
            made = (
                state.contact_impulse
                if each.name == "impulse"
                else getattr(state.contacts, each.name)
            )
            assert np.array_equal(getattr(run.contacts, each.name)[rows], made[:count]), each.name
        assert np.all(run.impacts.step[impact : impact + logged] == k)
        for each in IMPACTS[1:]:
            found = getattr(run.impacts, each.name)[impact : impact + logged]
            made = getattr(state.impacts, each.name)[:logged]
            made = made + k * run.dt if each.name == "time" else made  # it counts from the step
            assert np.array_equal(found, made), each.name
        impact += logged
    assert stepped.time == run.time[-1] and impact == len(run.impacts.step)
    assert len(run.contacts.gap) == run.contacts.offsets[-1] > 0 and np.any(run.state != FREE)


@pytest.mark.parametrize("coupling", COUPLINGS)
def test_a_law_written_in_python_is_run_and_recorded_as_the_compiled_one(coupling, monkeypatch):
    chosen = coupling_of(PEG, coupling)
    ours = simulate(PEG, Wrapped(), chosen, steps=STEPS)
    theirs = simulate(PEG, steps=STEPS, coupling=chosen)
    assert (ours.kernel, theirs.kernel) == ("python", "compiled")
    assert_same(ours, theirs)
    monkeypatch.setattr(recording, "_PIECE", 1)  # each chunk is a piece
    monkeypatch.setattr(recording, "_STEPS_PER_CHUNK", 60)
    thin = (simulate(PEG, law, chosen, steps=STEPS, every=7) for law in (Wrapped(), None))
    assert_same(*thin)


def test_a_subclass_with_a_step_of_its_own_is_not_run_as_the_engines_law():
    class Stays(Penalty):
        def advance(self, system, state, applied_force, dt):
            return StepResult(state.q, 0.0 * state.v, *(np.zeros(3) for _ in range(3)), FREE)

    run = simulate(PEG, Stays(), steps=3)
    assert run.kernel == "python" and np.array_equal(run.q, np.tile(run.q[0], (4, 1)))


def test_the_hand_force_stays_until_the_next_one():
    values = {"hand.force": [0, 0, 0], "bodies.peg.position": [1, -1, 0.0]}
    simulation = Simulation(PEG.with_values(values))
    rest = simulation.step().v
    pushed = simulation.step([2.0, -4.0, 0.01]).v
    again = simulation.step().v
    change = simulation.system.dt * np.array([2.0, -4.0, 0.01]) / np.array([2.0, 2.0, 0.005])
    assert not rest.any() and pushed == pytest.approx(change, rel=1e-12)
    assert again == pytest.approx(2.0 * change, rel=1e-12)
    spatial = simulation.step([0, 0, 0, 0, 0, -0.01]).v
    assert spatial == pytest.approx(again - [0, 0, change[2]], rel=1e-12)


@pytest.mark.parametrize(
    "force",
    [
        [1.0],
        [1.0, 2.0, float("nan")],
        "abc",
        [[1], [2, 3]],
    ],
)
def test_a_wrong_hand_force_is_named(force):
    with pytest.raises(
        ArgumentError, match="hand_force = .*expected 3 .plane. or 6 .space. finite numbers"
    ):
        Simulation(PEG).step(force)
    with pytest.raises(ArgumentError, match="hand_force"):
        Simulation(find_scene("two_discs")).step([0, 0, 0])


WRONG = {  # argument of `simulate` -> values that are refused
    "steps": [0, 2.5],
    "every": [0],
    "law": ["IAPB", Penalty],
    "max_memory": [float("nan"), "1GB"],
    "coupling stiffness": [FourChannel((1.0,), (1.0,))],
    "world": [["IAPB"]],
}


@pytest.mark.parametrize(
    ("argument", "value"), [(name, value) for name, values in WRONG.items() for value in values]
)
def test_wrong_arguments_are_named_with_value_and_expectation(argument, value):
    with pytest.raises(ArgumentError) as caught:
        simulate(PEG, **{argument.split()[0]: value})
    assert caught.value.argument == argument and caught.value.expected
    assert str(caught.value).startswith(f"{argument} = ")


def test_a_scene_has_a_name_and_a_world_selects_the_law_and_its_coupling():
    run = simulate("peg_corner", world="PB", steps=3)
    assert (run.world, run.law, run.coupling) == ("PB", "penalty", "four-channel")
    assert simulate(PEG, Penalty(), world="my own", steps=3).world == "my own"
    # its gains act, as in `iapb run`
    assert_same(simulate(PEG, steps=STEPS), simulate(PEG, world="IAPB", steps=STEPS))
    assert simulate(PEG, world="PB", coupling=NoCoupling(), steps=3).coupling == "none"
    with pytest.raises(ArgumentError, match=r"world = 'nonsense': expected one of IAPB, PB"):
        simulate("peg_corner", world="nonsense")


def test_a_record_that_would_not_fit_is_refused_with_its_size_before_it_is_allocated():
    with pytest.raises(ArgumentError, match=r"bytes a step.*GB in all.*max_memory"):
        simulate("peg_corner", steps=10**12)
    with pytest.raises(ArgumentError, match="GB in all"):
        simulate("peg_corner", steps=10**400)
    each = recording.Recorder(Simulation("peg_corner")).bytes_per_step
    assert simulate("peg_corner", steps=10, max_memory=10 * each).steps == 10
    with pytest.raises(ArgumentError, match=r"at most 9:.*every=2 \(iapb run --every 2\)"):
        simulate("peg_corner", steps=10, max_memory=10 * each - 1)
    assert simulate("peg_corner", steps=10, every=2, max_memory=10 * each - 1).steps_done == 10
    with pytest.raises(ArgumentError, match=r"at most 18:"):
        simulate("peg_corner", steps=20, every=2, max_memory=10 * each - 1)


def test_a_run_shows_itself_in_a_line_a_table_a_picture_and_as_a_dataset():
    run = simulate("peg_corner", steps=STEPS)
    assert repr(run).startswith("<Run of peg_corner in") and "\n" not in repr(run)
    data = run.to_xarray()
    assert data.q.dims == ("time", "coordinate") and data.q.attrs["units"] == "m, m, rad"
    assert np.array_equal(data.energy_kinetic.values, run.energy["kinetic"])
    assert data.sizes["contact"] == len(run.contacts.gap) > 0
    assert len(run.plot().axes) == 3


CHANGES = [  # what scenes with equal bodies or walls might share
    {},
    {"contact.friction": 0.2, "contact.forces": "implicit"},
    {"contact.restitution": 0.5},
    {"walls.floor.restitution": 0.6},
    {"bodies.peg.mass": 1.5},
    {"bodies.peg.position": [0.021, -0.0135, 0.02]},
    {"bodies.peg.joint_damping": [1.0, 1.0, 0.0]},
    {"rate": 700.0},
    {"hand.point": [0.005, 0.002]},
    {"hand.force_function": ["0.1*sin(9*t)", "0", "0"]},
    {"device.delay": 3},
]


def test_a_scene_gives_the_bits_of_one_that_is_read_anew_whatever_ran_between() -> None:
    laws = [
        ImpulseAugmented(rendering="scale"),
        ImpulseAugmented(pushing=True),
        Penalty(),
        ImpulseAugmented(integrator="momentum"),
    ]
    scene = load_scene(find_scene("peg_corner"))
    coupling = coupling_of(scene, "four-channel")
    changed = [scene.with_values(values) for values in CHANGES]
    after = [simulate(each, laws[0], coupling, steps=STEPS) for each in changed]
    for each, run in zip(changed, after, strict=True):
        alone = simulate(scene_from_text(each.source_text), laws[0], coupling, steps=STEPS)
        assert_same(run, alone)
        assert run.effects == alone.effects and run.distrust == alone.distrust
    assert len({content_hash(run) for run in after}) == len(CHANGES)
    for law in (*laws, *laws[::-1]):
        fresh = simulate(load_scene(find_scene("peg_corner")), law, coupling, steps=STEPS)
        assert_same(simulate(scene, law, coupling, steps=STEPS), fresh)


@pytest.mark.parametrize("copied", [copy.deepcopy, pickle.dumps], ids=["deepcopy", "pickle"])
def test_a_simulation_refuses_to_be_copied(copied) -> None:
    """A copy would step the original's memory: its blocks hold addresses."""
    with pytest.raises(TypeError, match="cannot be copied or pickled"):
        copied(Simulation(PEG))


def test_what_follows_from_a_run_is_its_own_and_computed_when_it_is_asked_for() -> None:
    """All runs have the same sizes; one is asked in between, one only after the last was made."""
    # sinks into the floor, so this run is not to be trusted
    heavy = PEG.with_values({"gravity": [0.0, 9.81]})

    def followed(run: Run) -> tuple[str, tuple[str, ...]]:
        return content_hash(run), run.distrust

    alone = [followed(simulate(scene, steps=STEPS)) for scene in (PEG, heavy)]
    early = simulate(PEG, steps=STEPS)
    late = simulate(PEG, steps=STEPS)
    assert not {"pose", "energy", "distrust", "scene_source"} & vars(late).keys()
    assert early.pose is early.pose
    last = simulate(heavy, steps=STEPS)
    assert [followed(early), followed(late), followed(last)] == [alone[0], *alone]
    for each in (
        pickle.loads(pickle.dumps(simulate(heavy, steps=STEPS))),
        replace(last, world="w"),
    ):
        assert_same(last, each)
        assert each.scene_source == heavy.source_text and each.distrust == distrust_of(last)
    with pytest.raises(AttributeError, match="no attribute 'poses'"):
        last.poses  # noqa: B018


def test_a_changed_file_is_read_again(tmp_path: Path) -> None:
    path = tmp_path / "wall.yaml"
    text = find_scene("wall_1d").read_text(encoding="utf-8")
    path.write_text(text, encoding="utf-8")
    first = simulate(path, steps=5)
    assert simulate(path, steps=5).q.tobytes() == first.q.tobytes()
    path.write_text(text.replace("name: wall_1d", "name: another_wall"), encoding="utf-8")
    assert simulate(path, steps=5).scene_name == "another_wall"
