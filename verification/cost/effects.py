"""The effects that a scene needs, the time of a step, the share of each effect in it, and the motion without it.

Only this module measures the time of a scene's step in seconds; other modules give ratios of times.

The variants run in turns: the scene with its effects, the scene with every switch on, and the scene without one of its
effects. `LEFT_OUT` defines how an effect is left out: by other values of the scene, another law or coupling, a switch
of the compiled step, or fewer pairs of shapes that may touch. Times are compared in each round, positions over the
whole run.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb import decide_effects, find_scene, load_scene
from iapb.advice.effects import EFFECT_NAMES
from iapb.compiled import block
from iapb.contact.kernels.world import Switches
from iapb.contact.laws import Penalty
from iapb.errors import IapbError
from iapb.haptics.coupling import NoCoupling
from iapb.scene import Scene, scene_names
from iapb.simulation import Simulation
from reference.worlds import World, find_world
from verification.clock import Times, take_turns
from verification.cost.loop import RecordedLoop
from verification.finding import Column, Failure, Row, Table, attempt, table_of

Floats = NDArray[np.float64]

ROUNDS = 9  # number of rounds; each loop runs once per round
SAMPLES = 400  # number of instants at which positions are compared
_TINY = np.finfo(float).tiny


@dataclass(frozen=True)
class Variant:
    """A variant of a scene: changed values and switches, without impulses or coupling, or without a kind of pairs."""

    values: tuple[tuple[str, Any], ...] = ()
    impulses: bool = True
    coupled: bool = True
    switches: tuple[str, ...] = ()
    on: bool = False  # the new value of the switches
    untouched: str = ""


LEFT_OUT: dict[str, Variant] = {
    "gravity": Variant((("gravity", None),)),
    "varying_inertia": Variant(switches=("varying_inertia",)),
    "velocity_terms": Variant(switches=("velocity_terms",)),
    "hand_force": Variant((("hand.force", None), ("hand.force_table", ()), ("hand.force_function", ()))),
    "joint_damping": Variant(switches=("joint_damping",)),
    "joint_limits": Variant(switches=("joint_limits",)),
    "wall_contacts": Variant(untouched="wall"),
    "body_contacts": Variant(untouched="body"),
    "self_collisions": Variant((("contact.self_collisions", False),)),
    "impulses": Variant(impulses=False),
    "unequal_restitution": Variant(switches=("unequal_restitution",)),
    "penalty_stiffness": Variant((("contact.stiffness", 0.0),)),
    "contact_damping": Variant((("contact.damping", 0.0),)),
    "friction": Variant((("contact.friction", 0.0),)),
    "clustering": Variant((("contact.cluster_distance", 0.0),)),
    "coherence": Variant((("contact.coherence_distance", 0.0),)),
    "coupling": Variant(coupled=False),
    "delay": Variant((("device.delay", 0),)),
    "quantisation": Variant((("device.position_resolution", None),)),
    "device_damping": Variant((("device.damping", None),)),
    "device_limits": Variant((("device.force_limit", None),)),
    "waveform": Variant((("device.waveform", "step"),)),
}
# Effects that a switch of the step can turn on in a scene that does not need them; they then change nothing. Friction
# in impacts is not among them, because its law needs arrays of its own.
SWITCHED = tuple(name for name in Switches._fields if name in EFFECT_NAMES and name != "impact_friction")
_WHOLE, _ALL_ON = "with its effects", "all switched on"
SCENES = ("peg_corner", "arm_pushing", "arm_obstacles")  # scenes whose effects are shown one by one
_BELOW = "below the noise"
NOTHING = "nothing in this run"  # first words for an effect that is on and changes nothing
# Effects that act only through contacts: the kind of contact that they need ("": any), and the words if there is none.
_THROUGH_CONTACTS = {
    "wall_contacts": ("wall", "no body touches a wall"),
    "body_contacts": ("body", "no two separate bodies touch"),
    "self_collisions": ("tree", "no two links of one tree touch"),
} | dict.fromkeys(
    ("impulses", "unequal_restitution", "penalty_stiffness", "contact_damping", "friction", "clustering", "coherence"),
    ("", "nothing touches"),
)


# One effect: whether it is on, the reason, and the general consequence of leaving it out; then the measurements in this
# scene. An effect has no numbers if it is off, cannot be left out, or if the scene cannot run without it; in the last
# case `change` gives the reason.
COLUMNS = (
    Column("effect", condition=True),
    Column("active"),
    Column("reason", prose=True),
    Column("left out", prose=True),
    Column("step", "µs", timed=True),  # time of the scene with its effects, the same in each row
    Column("all on", "µs", timed=True),  # time of the scene with all of SWITCHED on
    Column("faster than real time", "times", timed=True),
    Column("time saved", "%", timed=True),  # share of the step that leaving the effect out saves; None within the noise
    Column("position", "mm"),  # largest distance of the tool (without a hand: of any body) from that with the effect
    Column("device", "mm"),  # the same distance of the device
    Column("energy", "%"),  # largest change of kinetic energy, relative to its largest value with the effect
    Column("cost", prose=True, timed=True),
    Column("change", prose=True),
)


def effects_of_scenes(
    progress: Callable[[int, int], None] | None = None, failures: list[Failure] | None = None
) -> dict[str, Table]:
    """Return the measured effects of each shipped scene in the IAPB world."""
    found, names = {}, scene_names()
    for done, name in enumerate(names, start=1):
        found[name] = attempt(name, lambda name=name: effects_of(_scene(name), failures=failures), failures)  # type: ignore[misc]
        if progress is not None:
            progress(done, len(names))
    return {name: effects for name, effects in found.items() if effects is not None}


def _scene(name: str) -> Scene:
    return load_scene(find_scene(name))


def effects_of(
    scene: Scene, world: str = "IAPB", progress: Callable[[int, int], None] | None = None,
    failures: list[Failure] | None = None, rounds: int = ROUNDS,
) -> Table:
    """Return every effect of a scene; effects that are on and can be left out are measured.

    `failures` receives effects that raise an exception other than `IapbError`; if it is None, the exception propagates.
    """
    chosen = find_world(world)
    effects = decide_effects(scene, chosen.law, chosen.coupling_in(scene))
    whole = Loop(scene, chosen, Variant())
    tried: dict[str, Any] = {_ALL_ON: _loop(scene, chosen, Variant(switches=SWITCHED, on=True))}
    for effect in effects:
        if effect.active and effect.name in LEFT_OUT:
            loop = partial(_loop, scene, chosen, LEFT_OUT[effect.name])
            tried[effect.name] = attempt(f"{scene.name}, {effect.name}", loop, failures)
    loops = {name: loop for name, loop in tried.items() if isinstance(loop, Loop)}
    times = take_turns({_WHOLE: whole.sample} | {name: loop.sample for name, loop in loops.items()}, rounds,
                       progress=progress)
    steps = {"step": 1e6 * times[_WHOLE].median, "all on": 1e6 * times[_ALL_ON].median,
             "faster than real time": scene.step / times[_WHOLE].median}
    ratios = {name: times[name].over(times[_WHOLE]) for name in loops}
    measured = {name: {"change": f"without it no run: {loop}"} if isinstance(loop, IapbError) else
                difference(whole, loop, name, ratios[name]) for name, loop in tried.items()
                if loop is not None and name != _ALL_ON}
    return table_of(COLUMNS, (
        {"effect": effect.name, "active": effect.active, "reason": effect.reason, "left out": effect.left_out,
         **steps, **measured.get(effect.name, {})} for effect in effects), digits=3)  # fmt: skip


def _loop(scene: Scene, world: World, variant: Variant) -> Loop | IapbError:
    """Return the loop after its first run, or the error that stopped this run."""
    try:
        loop = Loop(scene, world, variant)
        loop.sample()
    except IapbError as error:
        return error
    return loop


def saved(ratio: Times) -> float | None:
    """Return the share of the step [%] that a loop saves; None if the difference is within the noise.

    `ratio` is the loop's time divided by the time with the effect, per round. The smallest and the largest ratio are
    ignored. The difference is noise unless all other ratios are on the same side of 1. With nine rounds, pure noise
    passes this test in one of 26 cases.
    """
    rounds = sorted(ratio.samples)
    inner = rounds[1:-1] if len(rounds) > 2 else rounds
    return None if inner[0] <= 1.0 <= inner[-1] else 100.0 * (1.0 - ratio.median)


def summary(effects: Mapping[str, Table]) -> Table:
    """Return the data of the figure of time and error, one row per scene and measured effect."""
    columns = (Column("scene", condition=True), Column("effect", condition=True), Column("time saved", "%", timed=True),
               Column("error", "mm"), Column("best of its error", timed=True))  # fmt: skip
    rows = []
    for scene, table in effects.items():
        measured = [row | {"time saved": row["time saved"] or 0.0} for row in table.records()
                    if row["position"] is not None]
        front = {row["effect"] for row in measured if not any(_beats(other, row) for other in measured)}
        rows += [(scene, row["effect"], row["time saved"], row["position"], "yes" if row["effect"] in front else "no")
                 for row in measured]  # fmt: skip
    return Table(columns, tuple(rows), digits=3,
                 note="Best of its error: no other effect saves more time without a larger error. "
                      f"A time saved of 0: {_BELOW}.")  # fmt: skip


def steps(effects: Mapping[str, Table]) -> Table:
    """Return the data of the figure of step times, one row per scene."""
    columns = (Column("scene", condition=True), Column("effects on"), Column("step", "µs", timed=True),
               Column("all on", "µs", timed=True), Column("faster than real time", "times", timed=True),
               Column("shares of the step", prose=True, timed=True))
    rows = []
    for scene, table in effects.items():
        on = [row for row in table.records() if row["active"]]
        shares = sorted(((row["time saved"], row["effect"]) for row in on if (row["time saved"] or 0.0) > 0.0),
                        reverse=True)
        told = ", ".join(f"{effect.replace('_', ' ')} {share:.0f} % ({0.01 * share * on[0]['step']:.2g} µs)"
                         for share, effect in shares)  # fmt: skip
        times = (on[0][key] for key in ("step", "all on", "faster than real time"))
        rows.append((scene, len(on), *times, told or f"each {_BELOW}"))
    return Table(columns, tuple(rows), digits=3,
                 note=f"Medians of {ROUNDS} rounds. A share is the time that a step saves without the effect. Effects "
                      f"that are not named are {_BELOW} or cannot be left out. Shares need not add up.")


def _beats(other: Row, row: Row) -> bool:
    """Whether leaving out `other` saves at least as much time with at most the same error, and is better in one."""
    one, two = ((each["time saved"], -each["position"]) for each in (other, row))
    return one[0] >= two[0] and one[1] >= two[1] and one != two


def difference(whole: Loop, other: Loop, name: str, ratio: Times) -> dict[str, Any]:
    """Return the measured cells of one effect from the loops with it (`whole`) and without it (`other`)."""
    kinetic = whole.kinetic()
    found = {
        "time saved": saved(ratio),
        "position": _farthest(whole.places(), other.places()),
        "device": _farthest(whole.device_places(), other.device_places()),
        "energy": 100.0 * float(np.abs(other.kinetic() - kinetic).max() / max(float(kinetic.max()), _TINY)),
    }
    words = in_words(found)
    if whole.same_motion(other):
        words["change"] = f"{NOTHING}: {_why_nothing(name, whole.touching())}"
    return found | words


def _why_nothing(name: str, touching: frozenset[str]) -> str:
    """Return the reason why the run does not change without the effect, judged by the contacts of the run."""
    kind, absent = _THROUGH_CONTACTS.get(name, ("", ""))
    if absent and not (touching if not kind else touching & {kind}):
        return absent
    return "all states are the same to the last bit"


def in_words(found: Row) -> dict[str, str]:
    """Return in words the effect's cost per step and the change of the motion without it."""
    moved = f"up to {_length(found['position'])} elsewhere"
    if found["device"] is not None:
        moved += f", the device {_length(found['device'])}"
    return {"cost": _BELOW if found["time saved"] is None else f"{found['time saved']:+.0f} % of the step",
            "change": f"{moved}; kinetic energy up to {found['energy']:.3g} % of its largest off"}  # fmt: skip


def _length(millimetres: float) -> str:
    return f"{millimetres:.3g} mm" if millimetres < 1e3 else f"{millimetres / 1e3:.3g} m"


def _farthest(one: Floats, other: Floats) -> float | None:
    """Return the largest distance of two arrays of points [mm]; None if they are empty or differ in shape."""
    return 1e3 * float(np.linalg.norm(one - other, axis=-1).max()) if one.shape == other.shape and one.size else None


class Loop(RecordedLoop):
    """The simulation loop of a variant of a scene; it keeps the states of the last sample."""

    def __init__(self, scene: Scene, world: World, variant: Variant) -> None:
        changed = scene.with_values(_values(scene, variant)) if variant.values else scene
        law = world.law if variant.impulses else Penalty()
        coupling = world.coupling_in(changed) if variant.coupled else NoCoupling()
        super().__init__(Simulation(changed, law, coupling), scene.steps)
        if variant.untouched:
            _leave_out_pairs(self.simulation, variant.untouched)
        if variant.switches:
            self.simulation.world = _switched(self.simulation.world, variant.switches, variant.on)
        self.q = self.v = self.device_q = np.zeros((0, 0))

    def same_motion(self, other: Loop) -> bool:
        """Whether positions and velocities of tool and device are equal to the last bit in all steps."""
        ours, theirs = (each.recording.joined("steps") for each in (self, other))
        return all(np.array_equal(ours[name], theirs[name]) for name in ("q", "v", "device_q", "device_v"))

    def touching(self) -> frozenset[str]:
        """Return the kinds of contacts in the last sample: "wall", "body" (two trees) and "tree" (within one tree)."""
        contacts = self.recording.joined("contacts")
        a, b = contacts["body_a"], contacts["body_b"]
        tree = self.simulation.system.mechanism.tree_of_body
        kinds = np.where(b < 0, "wall", np.where(tree[a] == tree[np.maximum(b, 0)], "tree", "body"))
        return frozenset(np.unique(kinds).tolist())

    def sample(self) -> float:
        """Return the time per step of one whole run [s]."""
        seconds, every = super().sample(), slice(None, None, max(1, self.steps // SAMPLES))
        self.q, self.v, self.device_q = (
            np.concatenate([getattr(record.steps, name) for record in self.recording.records])[every]
            for name in ("q", "v", "device_q")
        )
        return seconds

    def places(self) -> Floats:
        """Return points of the held body, or of all bodies without a hand, at the compared instants (n, k, 3) [m]."""
        held = self.simulation.port.hand_body
        bodies = slice(None) if held < 0 else slice(held, held + 1)
        return np.array([_points(self.simulation.system.mechanism, q, bodies) for q in self.q])

    def device_places(self) -> Floats:
        """Return positions of the device's bodies at the compared instants (n, k, 3) [m]; empty without a device."""
        if self.simulation.coupling.name == "none":
            return np.zeros((0, 0, 3))
        device = self.simulation.system.device_mechanism()
        return np.array([device.placements(q)[1] for q in self.device_q])

    def kinetic(self) -> Floats:
        """Return the kinetic energy at the compared instants (n,) [J]."""
        mechanism = self.simulation.system.mechanism
        return np.array([mechanism.kinetic_energy(q, v) for q, v in zip(self.q, self.v, strict=True)])


def _points(mechanism: Any, q: Floats, bodies: slice) -> Floats:
    """Return four points of each body [m]: its centre of mass, and points one radius of gyration away along its axes.

    The body's origin is not enough, because the origin of a hinged body lies in the hinge and never moves.
    """
    found = []
    rotation, position = mechanism.placements(q)
    for body, R, p in zip(mechanism.bodies[bodies], rotation[bodies], position[bodies], strict=True):
        radius = float(np.sqrt(np.trace(body.inertia) / (2.0 * body.mass))) if body.mass > 0.0 else 0.0
        center = p + R @ np.asarray(body.center_of_mass)
        found += [center, *(center + radius * R.T)]
    return np.array(found)


def _values(scene: Scene, variant: Variant) -> dict[str, Any]:
    """Return the changed values of a variant; a hand force becomes zeros of the same length."""
    force = [0.0] * len(scene.hand.force) if scene.hand is not None else None
    return {name: force if name == "hand.force" else value for name, value in variant.values}


def _switched(world: Any, names: tuple[str, ...], on: bool) -> Any:
    """Return the world with these switches of the compiled step on or off."""
    switches = world.switches._content._replace(**dict.fromkeys(names, on))
    return block(world._content._replace(switches=switches))


def _leave_out_pairs(simulation: Any, kind: str) -> None:
    """Remove the pairs of shapes with a wall (`kind` "wall"), or the pairs of two trees ("body")."""
    system = simulation.system
    bodies, tree = system.shapes.body, system.mechanism.tree_of_body
    a, b = bodies[system.pairs[:, 0]], bodies[system.pairs[:, 1]]
    walls = b < 0
    gone = walls if kind == "wall" else ~walls & (tree[a] != tree[np.maximum(b, 0)])
    system.pairs = np.ascontiguousarray(system.pairs[~gone])
    system._worlds.clear()
    simulation.world = system.world_under(simulation.law)
