"""The loop: compiled or stepped from Python it is one algorithm, and what stops it early leaves a readable run."""

from __future__ import annotations

import copy
import itertools
import pickle
from collections import Counter
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from iapb import compiled, recording, simulation, system
from iapb.advice.distrust import distrust_of
from iapb.contact.laws import RENDERINGS, ImpulseAugmented, Penalty, StepResult
from iapb.errors import ArgumentError
from iapb.haptics.coupling import FourChannel, NoCoupling
from iapb.mechanics.integrators import INTEGRATORS
from iapb.run import FREE, Run
from iapb.scene import Scene, find_scene, load_scene, mechanism, model, scene_from_text
from iapb.simulation import Simulation, simulate
from iapb.system import coupling_of, system_of

# A tilted, rough peg and a weak device: contacts one by one, friction, and impulses that exceed the limits.
PEG = load_scene(find_scene("peg_corner")).with_values({
    "bodies.peg.position": [0.0209, -0.0141, 0.08], "contact.friction": 0.1, "device.force_limit": [3, 3, 0.05],
    "device.delay": 2, "device.position_resolution": [1e-5, 1e-5, 0], "device.damping": [0.5, 0.5, 0],
})
ARM = load_scene(find_scene("arm_pushing"))  # inertia that varies, velocity terms, a group of two trees
STEPS = 350  # past the fourth collision of the peg
COUPLINGS = ("none", "four-channel", "unilateral")
LAWS = [Penalty(), *(ImpulseAugmented(rendering=rendering) for rendering in RENDERINGS)]
LAWS += [ImpulseAugmented(integrator=name) for name in INTEGRATORS if name != "semi_implicit_euler"]
STEP_VECTORS = ("q", "v", "penalty_force", "friction_force", "impulse")


def name_of(law):
    return "-".join([law.name.split(" ")[0], *map(str, law.settings.values())])


def results_of(record, place="run"):
    """Every array of results, by place; timings left out."""
    found = {}
    for field in fields(record):
        value = getattr(record, field.name)
        if is_dataclass(value):
            found |= results_of(value, field.name)
        elif isinstance(value, dict):
            found |= {f"{field.name}/{key}": each for key, each in value.items() if isinstance(each, np.ndarray)}
        elif isinstance(value, np.ndarray) and not field.name.startswith("chunk"):
            found[f"{place}/{field.name}"] = value
    return found


def assert_same(first: Run, second: Run) -> None:
    ours, theirs = results_of(first), results_of(second)
    assert ours.keys() == theirs.keys()
    for name, values in ours.items():
        assert np.array_equal(values, theirs[name]), name


@pytest.mark.parametrize("scene", [PEG, ARM], ids=lambda scene: scene.name)
@pytest.mark.parametrize("coupling", COUPLINGS)
@pytest.mark.parametrize("law", LAWS, ids=name_of)
def test_the_compiled_loop_is_the_loop_stepped_from_python_bit_for_bit(scene, law, coupling):
    chosen = coupling_of(scene, coupling)
    run = simulate(scene, law, chosen, steps=STEPS)
    stepped = Simulation(scene, law, chosen)
    for k in range(STEPS):
        result = stepped.step()
        for name in STEP_VECTORS:
            assert np.array_equal(getattr(result, name), getattr(run, name)[k + (name in "qv")]), (k, name)
        assert np.array_equal(stepped.port.device_q, run.device_q[k + 1])
        assert np.array_equal(stepped.port.device_v, run.device_v[k + 1])
        assert np.array_equal(stepped.port.device_force, run.device_force[k])
        assert result.state == run.state[k]
    assert stepped.time == run.time[-1]
    assert np.any(run.state != FREE)


@pytest.mark.parametrize("coupling", COUPLINGS)
def test_a_run_repeats_bit_for_bit_whatever_the_chunks(coupling, monkeypatch):
    law, chosen = ImpulseAugmented(rendering="spread"), coupling_of(PEG, coupling)
    run = simulate(PEG, law, chosen, steps=STEPS)
    assert_same(run, simulate(PEG, law, chosen, steps=STEPS))
    monkeypatch.setattr(recording, "_STEPS_PER_CHUNK", 23)
    rooms = count_calls(monkeypatch, {recording: "Room"})
    for size, most in ((recording._ROOM, 1), (1.0, 16), (60.0 * recording._line_bytes(
            recording.coordinates_of(Simulation(PEG, law, chosen)), system_of(PEG).capacity, 1), 8)):
        rooms.clear()
        monkeypatch.setattr(recording, "_ROOM", size)
        chunked = simulate(PEG, law, chosen, steps=STEPS)
        assert len(chunked.chunk_steps) == -(-STEPS // 23) and chunked.chunk_steps.sum() == STEPS
        assert_same(run, chunked)
        assert rooms["Room"] == most


class Wrapped:
    """The engine's law as a law of the caller's own, known by its protocol alone."""

    name, rendering, settings = "wrapped", "full", {}

    def advance(self, system, state, applied_force, dt):
        return ImpulseAugmented().advance(system, state, applied_force, dt)


@pytest.mark.parametrize("coupling", COUPLINGS)
def test_a_law_written_in_python_is_run_and_recorded_as_the_compiled_one(coupling):
    chosen = coupling_of(PEG, coupling)
    ours, theirs = simulate(PEG, Wrapped(), chosen, steps=STEPS), simulate(PEG, steps=STEPS, coupling=chosen)
    assert (ours.kernel, theirs.kernel) == ("python", "compiled")
    assert_same(ours, theirs)


def test_a_subclass_with_a_step_of_its_own_is_not_run_as_the_engines_law():
    class Stays(Penalty):
        def advance(self, system, state, applied_force, dt):
            return StepResult(state.q, 0.0 * state.v, *(np.zeros(3) for _ in range(3)), FREE)

    run = simulate(PEG, Stays(), steps=3)
    assert run.kernel == "python" and np.array_equal(run.q, np.tile(run.q[0], (4, 1)))


def test_results_of_steps_stay_as_they_were():
    simulation = Simulation(PEG)
    first = simulation.step()
    before = [values.copy() for values in first[:5]]
    for _ in range(200):
        simulation.step()
    assert all(np.array_equal(kept, values) for kept, values in zip(before, first[:5], strict=True))


def test_the_hand_force_stays_until_the_next_one():
    simulation = Simulation(PEG.with_values({"hand.force": [0, 0, 0], "bodies.peg.position": [1, -1, 0.0]}))
    rest = simulation.step().v
    pushed = simulation.step([2.0, -4.0, 0.01]).v
    again = simulation.step().v
    spatial = simulation.step([0, 0, 0, 0, 0, -0.01]).v
    dt, mass = simulation.system.dt, np.array([2.0, 2.0, 0.005])
    assert np.array_equal(rest, np.zeros(3))
    assert pushed == pytest.approx(dt * np.array([2.0, -4.0, 0.01]) / mass, rel=1e-12)
    assert again == pytest.approx(2.0 * pushed, rel=1e-12)
    assert spatial == pytest.approx(again - dt * np.array([0, 0, 0.01]) / mass, rel=1e-12)


@pytest.mark.parametrize("force", [
    [1.0], [1.0, 2.0, float("nan")], np.zeros((3, 1)), [np.inf] * 6, "abc", ["1", "2", "3"], [True, False, True],
    [1j, 0, 0], [10**400, 0, 0], {"x": 1.0}, (x for x in (1.0, 2.0, 3.0)), np.ma.masked_array(np.zeros(3)),
    [[1], [2, 3]], np.zeros(3, "m8[s]")])
def test_a_wrong_hand_force_is_named(force):
    with pytest.raises(ArgumentError, match="hand_force = .*expected 3 .plane. or 6 .space. finite numbers"):
        Simulation(PEG).step(force)


@pytest.mark.parametrize(
    ("argument", "arguments"),
    [
        ("steps", {"steps": 0}),
        ("steps", {"steps": -3}),
        ("steps", {"steps": 2.5}),
        ("steps", {"steps": True}),
        ("law", {"law": "IAPB"}),
        ("law", {"law": Penalty}),
        ("coupling", {"coupling": "four-channel"}),
        ("coupling stiffness", {"coupling": FourChannel((1.0,), (1.0,))}),
        ("coupling", {"scene": find_scene("two_discs"), "coupling": FourChannel((1.0,), (1.0,))}),
    ],
)
def test_wrong_arguments_are_named_with_value_and_expectation(argument, arguments):
    with pytest.raises(ArgumentError) as caught:
        simulate(**{"scene": PEG, **arguments})
    assert caught.value.argument == argument and caught.value.expected
    assert str(caught.value).startswith(f"{argument} = ")


def test_a_hand_force_without_a_hand_is_refused():
    with pytest.raises(ArgumentError, match="hand_force"):
        Simulation(find_scene("two_discs")).step([0, 0, 0])


def test_without_a_coupling_no_device_moves():
    run = simulate(PEG, coupling=NoCoupling(), steps=20)
    assert run.coupling == "none" and np.array_equal(run.device_q, np.tile(run.device_q[0], (21, 1)))


def test_a_scene_has_a_name_and_a_world_selects_the_law_and_its_coupling():
    run = simulate("peg_corner", world="PB", steps=3)
    assert (run.world, run.law, run.coupling) == ("PB", "penalty", "four-channel")
    assert simulate(PEG, Penalty(), world="my own", steps=3).world == "my own"
    assert simulate(PEG, world="PB", coupling=NoCoupling(), steps=3).coupling == "none"
    assert simulate(load_scene(find_scene("two_discs")), world="IAPB-push", steps=3).coupling == "none"
    with pytest.raises(ArgumentError, match=r"world = 'nonsense': expected one of IAPB, PB"):
        simulate("peg_corner", world="nonsense")
    with pytest.raises(ArgumentError, match="peg_corner"):
        simulate("peg_korner")


def test_a_record_that_would_not_fit_is_refused_with_its_size_before_it_is_allocated():
    with pytest.raises(ArgumentError, match=r"bytes a step.*TB in all.*max_memory"):
        simulate("peg_corner", steps=10**12)
    each = recording.bytes_per_step(Simulation("peg_corner"))
    assert simulate("peg_corner", steps=10, max_memory=10 * each).steps == 10
    with pytest.raises(ArgumentError, match="at most 9:"):
        simulate("peg_corner", steps=10, max_memory=10 * each - 1)


@pytest.mark.parametrize(("name", "value"), [
    ("max_memory", float("nan")), ("max_memory", "1GB"), ("max_memory", -1), ("max_memory", True), ("progress", 1),
    ("checkpoint", 1), ("checkpoint", print), ("world", ["IAPB"]), ("world", None)])
def test_a_wrong_argument_of_simulate_is_named(name, value):
    with pytest.raises(ArgumentError, match=f"^{name} = "):
        simulate("peg_corner", steps=2, **{name: value})


def test_a_run_shows_itself_in_a_line_a_table_a_picture_and_as_a_dataset():
    run = simulate("peg_corner", steps=STEPS)
    assert repr(run).startswith("<Run of peg_corner in") and len(repr(run)) < 200 and "\n" not in repr(run)
    assert "<table>" in run._repr_html_() and "peg.theta" in run._repr_html_()
    data = run.to_xarray()
    assert data.q.dims == ("time", "coordinate") and list(data.coordinate.values) == list(run.coordinate_names)
    assert data.q.attrs["units"] == "m, m, rad" and data.contact_gap.attrs["units"] == "m"
    assert np.array_equal(data.energy_kinetic.values, run.energy["kinetic"])
    assert data.sizes["contact"] == len(run.contacts.gap) > 0
    assert len(run.plot().axes) == 3


def test_a_run_is_saved_by_what_an_installed_package_offers(monkeypatch):
    from iapb import lazy
    from iapb.errors import MissingDependencyError

    run = simulate("peg_corner", steps=3)
    monkeypatch.setattr(lazy, "entry_points", lambda **asked: [])
    with pytest.raises(MissingDependencyError, match=r"iapb\[report\]"):
        run.save("run.h5")

    class Offered:
        def load(self):
            return lambda path, given, replace: (path, given is run, replace)

    monkeypatch.setattr(lazy, "entry_points", lambda **asked: [Offered()])
    assert run.save("run.h5", replace=True) == ("run.h5", True, True)


@pytest.mark.parametrize("name", ["peg_corner", "bernoulli_balls", "box_stack"])
def test_a_scene_simulated_again_gives_the_same_bits_whatever_ran_between(name: str) -> None:
    """`simulate` keeps the system of a scene: nothing of one run may reach the next."""
    scene = load_scene(find_scene(name))
    laws = [ImpulseAugmented(), ImpulseAugmented(pushing=True), Penalty(), ImpulseAugmented(integrator="midpoint")]
    alone = [simulate(load_scene(find_scene(name)), law, steps=300) for law in laws]
    for law, first in [*zip(laws, alone, strict=True), *zip(laws[::-1], alone[::-1], strict=True)]:
        again = simulate(scene, law, steps=300)
        for array in ("q", "v", "impulse", "penalty_force", "state"):
            assert getattr(again, array).tobytes() == getattr(first, array).tobytes(), (law, array)


def count_calls(monkeypatch, owners) -> Counter[str]:
    """Count from now on the calls of functions of modules, by name."""
    calls: Counter[str] = Counter()

    def counted(name, function):
        def call(*arguments, **named):
            calls[name] += 1
            return function(*arguments, **named)
        return call

    for owner, names in owners.items():
        for name in names.split():
            monkeypatch.setattr(owner, name, counted(name, getattr(owner, name)))
    return calls


MADE = {compiled: "typeof", system: "Parts make_world _make_port decide_for", mechanism: "Mechanism",
        simulation: "load_scene"}


def forget() -> None:
    """As if nothing had been simulated yet."""
    for store in (system._PARTS, system._SYSTEMS, mechanism._MECHANISMS):
        store.clear()
    system._blank_state.cache_clear()


def test_a_second_run_and_one_with_a_changed_value_make_only_what_is_new(monkeypatch) -> None:
    scene = load_scene(find_scene("peg_corner"))
    path = find_scene("peg_corner")
    forget()
    for known in (scene, scene.with_values({"contact.stiffness": 900.0}), path):
        simulate(known, world="IAPB", steps=5)
    blanks = system._blank_state.cache_info().misses, recording._first_record.cache_info().misses
    calls = count_calls(monkeypatch, MADE)
    simulate(scene, world="IAPB", steps=5)
    simulate(path, world="IAPB", steps=5)
    assert not calls
    for values, more in {("contact.stiffness", 800.0): {}, ("hand.force.0", -0.3): {}, ("gravity", (0.0, -1.0)): {},
                         ("bodies.peg.position.0", 0.021): {"_make_port": 1},
                         ("walls.floor.restitution", 0.2): {"_make_port": 1, "Parts": 1},
                         ("bodies.peg.mass", 3.0): {"_make_port": 1, "Parts": 1, "Mechanism": 1}}.items():
        calls.clear()
        simulate(scene.with_values(dict([values])), world="IAPB", steps=5)
        assert calls == {"make_world": 1, "decide_for": 1} | more, values
    assert blanks == (system._blank_state.cache_info().misses, recording._first_record.cache_info().misses)


LIMITS = "bodies.0.joint_limits"
CHANGES = {
    "peg_corner": [
        {"contact.friction": 0.2}, {"contact.friction": 0.2, "contact.friction_law": "coulomb"},
        {"contact.stiffness": 2000.0}, {"contact.damping": 10.0},
        {"contact.restitution": 0.5}, {"contact.approach_velocity": 0.05}, {"contact.cluster_distance": 0.03},
        {"contact.coherence_distance": 0.03}, {"walls.floor.restitution": 0.6}, {"walls.floor.friction": 0.5},
        {"contact.friction_pairs": [{"between": ["peg", "floor"], "friction": 0.4}]},
        {"walls.floor.point": [0.0, -0.001]}, {"walls.right_wall.normal": [1.0, 0.05]},
        {"bodies.peg.restitution": 0.4}, {"bodies.peg.mass": 1.5}, {"bodies.peg.inertia": 0.004},
        {"bodies.peg.shapes.0.size": [0.03, 0.0105]}, {"bodies.peg.position": [0.021, -0.0135, 0.02]},
        {"bodies.peg.position.2": 0.0}, {"bodies.peg.position.2": -0.0}, {"bodies.peg.velocity": [-0.05, 0.02, 0.1]},
        {"bodies.peg.joint_damping": [1.0, 1.0, 0.0]}, {"gravity": [0.0, 2.0]}, {"rate": 700.0},
        {"hand.force": [-0.5, 0.3, 0.001]}, {"hand.point": [0.005, 0.002]},
        {"hand.force_table": [[0.0, 0, 0, 0], [0.3, -0.2, 0.2, 0]]},
        {"hand.force_function": ["0.1*sin(9*t)", "0", "0"]}, {"device.delay": 3},
        {"device.damping": [1.0, 1.0, 0.0]}, {"device.force_limit": [0.2, 0.2, 0.01]},
        {"device.position_resolution": [1e-4, 1e-4, 0.0]},
        {"device.waveform": "brake"},
        {"device.damping": [1.0, 1.0, 0.0], "couplings.four_channel.stiffness": [50.0, 60.0, 0.4]},
    ],
    "double_pendulum": [
        {LIMITS: [-0.3, 0.3]}, *({LIMITS: [-0.5, 0.5], **more} for more in (
            {}, {"bodies.1.position": [1.3]}, {"bodies.1.velocity": [0.5]}, {"bodies.0.mass": 0.7})),
    ],
    "two_discs": [{"contact.self_collision_rows": "per_body"}, {"contact.restitution": 0.25},
                  {"bodies.0.shapes.0.radius": 0.01}],
}


@pytest.mark.parametrize("name", CHANGES)
def test_a_changed_value_gives_the_bits_of_a_scene_that_is_read_anew(name: str) -> None:
    """What scenes share must not hold what one of them has changed: each after all others, and alone."""
    scene, law = load_scene(find_scene(name)), ImpulseAugmented(rendering="scale")

    def run_of(changed: Scene) -> Run:
        coupled = changed.hand is not None and changed.couplings.four_channel is not None
        return simulate(changed, law, coupling_of(changed, "four-channel" if coupled else "none"), steps=STEPS)

    first = results_of(run_of(scene))
    after = [run_of(scene.with_values(values)) for values in CHANGES[name]]
    for values, run in zip(CHANGES[name], after, strict=True):
        forget()
        alone = run_of(scene_from_text(scene.with_values(values).source_text))
        ours, theirs = results_of(run), results_of(alone)
        assert ours.keys() == theirs.keys() and run.effects == alone.effects and run.distrust == alone.distrust, values
        for array, numbers in ours.items():
            assert numbers.tobytes() == theirs[array].tobytes(), (values, array)
        assert any(ours[array].tobytes() != first[array].tobytes() for array in ours.keys() & first.keys()), values


@pytest.mark.parametrize("copied", [copy.deepcopy, pickle.dumps], ids=["deepcopy", "pickle"])
def test_a_simulation_refuses_to_be_copied(copied) -> None:
    """A copy would step the original's memory: its blocks hold addresses."""
    with pytest.raises(TypeError, match="cannot be copied or pickled"):
        copied(Simulation(PEG))


def test_what_follows_from_a_run_is_computed_when_it_is_asked_for(monkeypatch) -> None:
    scene = load_scene(find_scene("peg_corner")).with_values({"contact.stiffness": 1e4})
    texts = count_calls(monkeypatch, {model: "scene_text", recording: "energy_of_run distrust_of"})
    run = simulate(scene, steps=STEPS)
    assert not texts and not {"pose", "energy", "distrust", "scene_source"} & vars(run).keys()
    copies = [copy.deepcopy(run), pickle.loads(pickle.dumps(simulate(scene, steps=STEPS))), replace(run, world="w")]
    mechanics = system_of(scene).mechanism
    for each in (run, *copies):
        assert each.pose.tobytes() == mechanics.poses(run.q, planar=True).tobytes()
        assert each.energy["kinetic"].tobytes() == mechanics.energies(run.q, run.v, np.zeros(3))[0].tobytes()
        assert each.scene_source == scene.source_text and each.distrust == distrust_of(run)
        assert_same(run, each)
    assert run.pose is run.pose and run.energy is run.energy and texts["energy_of_run"] == 2
    with pytest.raises(AttributeError, match="no attribute 'poses'"):
        run.poses  # noqa: B018


def test_what_follows_from_a_run_is_its_own_whatever_ran_after_it() -> None:
    """All runs have the same sizes; one is asked in between, one only after the last was made."""
    heavy = PEG.with_values({"gravity": [0.0, 9.81]})  # sinks into the floor, so this run is not to be trusted

    def followed(run: Run) -> list[object]:
        return [run.pose.tobytes(), {name: each.tobytes() for name, each in run.energy.items()}, run.distrust]

    alone = [followed(simulate(scene, steps=STEPS)) for scene in (PEG, heavy)]
    assert all(ours != theirs for ours, theirs in zip(*alone, strict=True))
    early, late = simulate(PEG, steps=STEPS), simulate(PEG, steps=STEPS)
    assert early.pose.tobytes() == alone[0][0]
    last = simulate(heavy, steps=STEPS)
    assert [followed(early), followed(late), followed(last)] == [alone[0], *alone]


@pytest.mark.parametrize("name", ["peg_corner", "arm_pushing"])
def test_simulations_share_nothing_that_changes(name: str) -> None:
    """Of one scene, and of two that differ in a value: what one writes no other sees, and what both read stays."""
    scene = load_scene(find_scene(name))
    alike = scene.with_values({"contact.friction": 0.25})
    coupling = coupling_of(scene, "four-channel")
    moving, *others = (Simulation(system_of(each), coupling=coupling) for each in (scene, scene, alike))
    arrays = [array for each in (moving, *others) for array in each.arrays() if array.nbytes]
    places = sorted((array.__array_interface__["data"][0], array.nbytes) for array in arrays)
    assert all(start + size <= following for (start, size), (following, _) in itertools.pairwise(places))

    def seen() -> list[bytes]:
        read = [each.world.arrays() + each.system.mechanism.block.arrays() for each in others]
        return [array.tobytes() for array in itertools.chain(*read, *(each.arrays() for each in others))]

    before = seen()
    stopped = recording.Recorder(moving).chunk(moving.scene.steps)
    assert stopped is None and moving.state.q.tobytes() != others[0].state.q.tobytes()
    assert seen() == before
    again = Simulation(system_of(scene), coupling=coupling)
    for ours, theirs in zip(again.arrays(), others[0].arrays(), strict=True):
        assert ours.tobytes() == theirs.tobytes()


def test_a_changed_file_is_read_again(tmp_path: Path) -> None:
    path = tmp_path / "wall.yaml"
    text = find_scene("wall_1d").read_text(encoding="utf-8")
    path.write_text(text, encoding="utf-8")
    first = simulate(path, steps=5)
    assert simulate(path, steps=5).q.tobytes() == first.q.tobytes()
    path.write_text(text.replace("name: wall_1d", "name: another_wall"), encoding="utf-8")
    assert simulate(path, steps=5).scene_name == "another_wall"
