"""No kernel reads or writes beyond its arrays, or reads what was never written; a law's count
cannot make one do so.

`python -m tests.robustness.test_bounds N` runs all shipped scenes in the engine's worlds, and N
random ones that mix joints, couplings, renderings, devices, forces and integrators. Interpreted
kernels refuse an index beyond an array or below zero; compiled ones do not check it, and do not
count from the end. `N twice` runs each scene twice and prints both hashes.
"""

import os
import subprocess
import sys
import warnings

import numpy as np
import pytest

from iapb.contact.laws import RENDERINGS, ImpulseAugmented, Penalty
from iapb.errors import ArgumentError, IapbError
from iapb.numerics import compiled
from iapb.scene import find_scene, load_scene, scene_names
from iapb.scene.model import scene_kind
from iapb.simulation import simulate
from iapb.system import coupling_of
from reports.store import content_hash
from verification.laws.scenes import draw_scene, draw_spatial_scene

COUNT = {"quick": 25, "deep": 1000}[os.environ.get("IAPB_HYPOTHESIS_PROFILE", "quick")]
STEPS = 8
pytestmark = pytest.mark.thorough
JOINTS = {
    True: ("continuous", "spherical", "free_flyer", "free_flyer", "prismatic", "revolute"),
    False: ("planar", "planar", "prismatic", "revolute"),
}  # by whether the scene is in space


def cases(count):
    """Yield name, scene, law and coupling."""
    for name in scene_names():
        scene = load_scene(find_scene(name))
        struck = scene.with_values({"duration": STEPS / scene.rate})
        gains = "four-channel" if scene.couplings.four_channel else "none"
        for law in (ImpulseAugmented(), ImpulseAugmented(pushing=True), Penalty("momentum")):
            yield name, struck, law, gains
    falling = {"bodies.peg.position": [0.02, -0.0059, 0.0], "bodies.peg.velocity": [0.0, 0.1, 0.0]}
    scene = load_scene(find_scene("peg_corner")).with_values(falling)
    for e in (-1.0, -0.5):  # scene files have no negative e, claim C09 has
        contact = scene.contact.model_copy(update={"restitution": e})
        struck = scene.model_copy(update={"contact": contact})
        yield f"peg that falls, e = {e}", struck, ImpulseAugmented(), "none"
        yield f"peg that is pushed, e = {e}", struck, ImpulseAugmented(pushing=True), "none"
    for seed in range(count):
        yield f"seed {seed}", *drawn(np.random.default_rng(seed))


def drawn(rng):
    """Return a random scene with overlapping bodies, and a device at a joint of any kind."""
    values = dict((draw_spatial_scene if rng.random() < 0.7 else draw_scene)(rng, STEPS).values)
    forces = str(rng.choice(["implicit", "paper"]))
    values["contact"] = values["contact"] | {"forces": forces}
    values["integrator"] = str(rng.choice(["momentum", "semi_implicit_euler"]))
    space = "dimensions" in values
    kind = str(rng.choice(JOINTS[space]))
    d = {"free_flyer": 6, "planar": 3, "spherical": 3}.get(kind, 1)
    tool = {
        "name": "tool",
        "joint": kind,
        "mass": 0.5,
        "velocity": [0.3] * d,
        "inertia": [1e-3, 2e-3, 2.5e-3] if space else 1e-3,
        "center_of_mass": [0.01] * (2 + space),
        "shapes": [{"kind": "sphere" if space else "circle", "radius": 0.3}],
    }
    if kind in ("continuous", "prismatic", "revolute") and (space or kind == "prismatic"):
        tool["axis"] = [0.0, 1.0, 0.0][: 2 + space]
    values["bodies"] = [*values["bodies"], tool]
    values["hand"] = {"body": "tool", "force": [1.0] * (6 if space else 3)}
    gains = {"stiffness": [50.0] * d, "damping": [1.0] * d}
    values["couplings"] = {"four_channel": gains, "unilateral": gains}
    values["device"] = {
        "position_resolution": [1e-3] * d,
        "delay": int(rng.integers(0, 3)),
        "force_limit": [2.0] * d,
        "damping": [0.1] * d,
    }
    scene = scene_kind(values).model_validate(values)
    law = (
        ImpulseAugmented(rendering=str(rng.choice(RENDERINGS))) if rng.random() < 0.7 else Penalty()
    )
    return scene, law, str(rng.choice(["none", "four-channel", "unilateral"]))


def program(*words, **environment):
    """Run this file as a program; return the lines that it prints."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.robustness.test_bounds", str(COUNT), *words],
        text=True,
        capture_output=True,
        env=os.environ | environment,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout.splitlines()


def test_kernels_stay_within_their_arrays():
    assert int(program(NUMBA_DISABLE_JIT="1")[-1]) >= COUNT


def test_runs_do_not_depend_on_what_was_in_memory_before():
    """Each scene twice in a process, and in two whose fresh memory holds other bytes."""
    one, other = (program("twice", MALLOC_PERTURB_=byte) for byte in ("1", "165"))
    hashes = [line.split()[-2:] for line in one[:-1]]
    assert (
        one == other and len(hashes) >= COUNT and all(first == second for first, second in hashes)
    )


class Overcounting:
    """A law whose step is the engine's, and which then claims that many contacts or impacts."""

    name = "overcounting"
    settings = {}

    def __init__(self, contacts=0, impacts=0):
        self.contacts = contacts
        self.impacts = impacts

    def advance(self, system, state, applied_force, dt):
        made = Penalty().advance(system, state, applied_force, dt)
        state.contact_count[0] = self.contacts
        state.impacts.logged[0] = self.impacts
        return made


@pytest.mark.parametrize(
    "law", [Overcounting(contacts=200), Overcounting(contacts=-1), Overcounting(impacts=10**6)]
)
def test_a_count_beyond_its_buffer_is_named(law):
    with pytest.raises(ArgumentError, match="the law 'overcounting' returned"):
        simulate(load_scene(find_scene("peg_corner")), law, steps=3)


class FromTheStart(np.ndarray):
    """An array that refuses an index below zero."""

    def __getitem__(self, key):
        return super().__getitem__(not_negative(key))

    def __setitem__(self, key, value):
        super().__setitem__(not_negative(key), value)


def not_negative(key):
    for index in key if isinstance(key, tuple) else (key,):
        if isinstance(index, int | np.integer) and index < 0:
            raise IndexError(f"index {key}")
    return key


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    member = compiled._member
    if compiled.AS_PYTHON:
        compiled._member = lambda value: (
            value.view(FromTheStart) if isinstance(value, np.ndarray) else member(value)
        )
    done = 0
    for name, scene, law, gains in cases(int(sys.argv[1])):
        try:
            runs = [
                simulate(scene, law, coupling_of(scene, gains), steps=STEPS) for _ in sys.argv[1:]
            ]
            print(name, *map(content_hash, runs), flush=True)
        except IapbError as stop:
            print(f"{name}: {stop}")
        except IndexError as error:
            raise SystemExit(f"{name}, {scene.name}: {error!r}, written out of range") from error
        done += 1
    print(done)
