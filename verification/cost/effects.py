"""The effects that a scene needs, the time of a step, the share of each effect in it, and the
motion without it.

Only this module measures the time of a scene's step in seconds; other modules give ratios of times.

The variants run in turns: the scene with its effects, the scene with every switch on, and the scene
without one of its effects. `LEFT_OUT` defines how an effect is left out: by other values of the
scene, another law or coupling, a switch of the compiled step, or fewer pairs of shapes that may
touch. Times are compared in each round, positions over the whole run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np

from iapb import decide_effects, find_scene, load_scene
from iapb.contact.kernels import world as engine
from iapb.contact.laws import Penalty
from iapb.effects import EFFECT_NAMES
from iapb.errors import IapbError
from iapb.haptics.coupling import NoCoupling
from iapb.numerics.compiled import block
from iapb.scene import Scene, scene_names
from iapb.simulation import Simulation
from reference import Floats
from reference.worlds import World, find_world
from verification.clock import Times, take_turns
from verification.cost.steps import RecordedLoop
from verification.finding import Failure, attempt, counted
from verification.table import Row, Table, table_from

ROUNDS = 9  # number of rounds; each loop runs once per round
SAMPLES = 400  # number of instants at which positions are compared


LEFT_OUT: dict[str, dict[str, Any]] = {  # effect -> the variant of the scene without it, see `Loop`
    **{
        name: {"switches": (name,)}
        for name in (
            "varying_inertia",
            "velocity_terms",
            "joint_damping",
            "joint_friction",
            "joint_limits",
            "unequal_restitution",
        )
    },
    "hand_force": {
        "values": {"hand.force": None, "hand.force_table": (), "hand.force_function": ()}
    },
    "wall_contacts": {"untouched": "wall"},
    "body_contacts": {"untouched": "body"},
    "impulses": {"impulses": False},
    "coupling": {"coupled": False},
    **{
        name: {"values": {path: value}}
        for name, path, value in (
            ("gravity", "gravity", None),
            ("self_collisions", "contact.self_collisions", False),
            ("penalty_stiffness", "contact.stiffness", 0.0),
            ("contact_damping", "contact.damping", 0.0),
            ("friction", "contact.friction", 0.0),
            ("clustering", "contact.cluster_distance", 0.0),
            ("touch", "contact.impact_time", "step"),
            ("coherence", "contact.coherence_distance", 0.0),
            ("delay", "device.delay", 0),
            ("quantisation", "device.position_resolution", None),
            ("device_damping", "device.damping", None),
            ("device_limits", "device.force_limit", None),
        )
    },
}
# Effects that a switch of the step can turn on in a scene that does not need them; they then change
# nothing. Friction in impacts and implicit contact are not among them, because they need arrays of
# their own.
_OWN_ARRAYS = ("impact_friction", "implicit_contact", "supports", "touch")
SWITCHED = tuple(
    name for name in engine.Switches._fields if name in EFFECT_NAMES and name not in _OWN_ARRAYS
)
_WHOLE, _ALL_ON = "with its effects", "all switched on"
SCENES = ("peg_corner", "arm_pushing", "arm_obstacles")  # scenes whose effects are shown one by one
_BELOW = "below the noise"
NOTHING = "nothing in this run"  # first words for an effect that is on and changes nothing
# Effects that act only through contacts: the kind of contact that they need ("": any), and the
# words if there is none.
_THROUGH_CONTACTS = {
    "wall_contacts": ("wall", "no body touches a wall"),
    "body_contacts": ("body", "no two separate bodies touch"),
    "self_collisions": ("tree", "no two links of one tree touch"),
} | dict.fromkeys(
    (
        "impulses",
        "touch",
        "unequal_restitution",
        "penalty_stiffness",
        "contact_damping",
        "friction",
        "clustering",
        "coherence",
    ),
    ("", "nothing touches"),
)


# What is measured of an effect. It has no numbers if it is off, cannot be left out, or if the scene
# cannot run without it; in the last case `change` gives the reason.
MEASURED = (
    "time saved [%]",  # share of the step that leaving the effect out saves; None within the noise
    # largest distance of the tool (without a hand: of any body) from that with the effect
    "position [mm]",
    "device [mm]",  # the same distance of the device
    "energy [%]",  # largest change of kinetic energy, relative to its largest value with the effect
    "cost",
    "change",
)


def effects_of_scenes(
    progress: Callable[[int, int], None] | None = None, failures: list[Failure] | None = None
) -> dict[str, Table]:
    """Return the measured effects of each shipped scene in the IAPB world."""
    names, found = scene_names(), dict[str, Table]()
    for name in counted(names, progress) if progress else names:
        measure = partial(_effects_of_shipped, name, failures)
        table = attempt(name, measure, failures)
        if table is not None:
            found[name] = table
    return found


def _effects_of_shipped(name: str, failures: list[Failure] | None) -> Table:
    return effects_of(load_scene(find_scene(name)), failures=failures)


def effects_of(
    scene: Scene, world: str = "IAPB", failures: list[Failure] | None = None, rounds: int = ROUNDS
) -> Table:
    """Return every effect of a scene; effects that are on and can be left out are measured.

    Step, all on: the time of the scene with its effects, and with all of SWITCHED on; the same in
    each row. `failures` receives effects that raise an exception other than `IapbError`; if it is
    None, the exception propagates.
    """
    chosen = find_world(world)
    effects = decide_effects(scene, chosen.law, chosen.coupling_in(scene))
    whole = Loop(scene, chosen)
    tried: dict[str, Any] = {_ALL_ON: _loop(scene, chosen, {"switches": SWITCHED, "on": True})}
    for effect in effects:
        if effect.active and effect.name in LEFT_OUT:
            loop = partial(_loop, scene, chosen, LEFT_OUT[effect.name])
            tried[effect.name] = attempt(f"{scene.name}, {effect.name}", loop, failures)
    loops = {name: loop for name, loop in tried.items() if isinstance(loop, Loop)}
    times = take_turns(
        {_WHOLE: whole.sample} | {name: loop.sample for name, loop in loops.items()}, rounds
    )
    steps = {
        "step [µs]": 1e6 * times[_WHOLE].median,
        "all on [µs]": 1e6 * times[_ALL_ON].median,
        "faster than real time [times]": scene.step / times[_WHOLE].median,
    }
    measured: dict[str, Row] = {
        name: difference(whole, loop, name, times[name].over(times[_WHOLE]))
        if isinstance(loop, Loop)
        else {"change": f"without it no run: {loop}"}
        for name, loop in tried.items()
        if loop is not None and name != _ALL_ON
    }
    return table_from(
        (
            {
                "effect": effect.name,
                "active": effect.active,
                "reason": effect.reason,
                "left out": effect.left_out,
                **steps,
                **dict.fromkeys(MEASURED),
                **measured.get(effect.name, {}),
            }
            for effect in effects
        ),
        digits=3,
        timed=(*steps, "time saved", "cost"),
        prose=("reason", "left out", "cost", "change"),
    )


def _loop(scene: Scene, world: World, variant: Mapping[str, Any]) -> Loop | IapbError:
    """Return the loop after its first run, or the error that stopped this run."""
    try:
        loop = Loop(scene, world, **variant)
        loop.sample()
    except IapbError as error:
        return error
    return loop


def saved(ratio: Times) -> float | None:
    """Return the share of the step [%] that a loop saves; None if the difference is within the
    noise.

    `ratio` is the loop's time divided by the time with the effect, per round. The smallest and the
    largest ratio are ignored. The difference is noise unless all other ratios are on the same side
    of 1. With nine rounds, pure noise passes this test in one of 26 cases.
    """
    rounds = sorted(ratio.samples)
    inner = rounds[1:-1] if len(rounds) > 2 else rounds
    return None if inner[0] <= 1.0 <= inner[-1] else 100.0 * (1.0 - ratio.median)


def summary(effects: Mapping[str, Table]) -> Table:
    """Return the data of the figure of time and error, one row per scene and measured effect."""

    def rows(scene: str, table: Table) -> Iterator[Row]:
        measured = [
            (row["time saved"] or 0.0, row["position"], row["effect"])
            for row in table.records()
            if row["position"] is not None
        ]
        for time, error, effect in measured:
            beaten = any(
                t >= time and e <= error and (t, e) != (time, error) for t, e, _ in measured
            )
            yield {
                "scene": scene,
                "effect": effect,
                "time saved [%]": time,
                "error [mm]": error,
                "best of its error": "no" if beaten else "yes",
            }

    return table_from(
        (row for given in effects.items() for row in rows(*given)),
        digits=3,
        timed=("time saved", "best of its error"),
        note="Best of its error: no other effect saves more time with no larger error, or as much "
        f"time with a smaller error. Time saved 0: {_BELOW}.",
    )


def steps(effects: Mapping[str, Table]) -> Table:
    """Return the data of the figure of step times, one row per scene."""

    def row(scene: str, table: Table) -> Row:
        on = [row for row in table.records() if row["active"]]
        first = on[0]
        shares = sorted(
            ((row["time saved"], row["effect"]) for row in on if (row["time saved"] or 0.0) > 0.0),
            reverse=True,
        )
        told = ", ".join(
            f"{effect.replace('_', ' ')} {share:.0f} % ({0.01 * share * first['step']:.2g} µs)"
            for share, effect in shares
        )
        return {
            "scene": scene,
            "effects on": len(on),
            "step [µs]": first["step"],
            "all on [µs]": first["all on"],
            "faster than real time [times]": first["faster than real time"],
            "shares of the step": told or f"each {_BELOW}",
        }

    return table_from(
        (row(*given) for given in effects.items()),
        digits=3,
        prose=("shares of the step",),
        timed=("step", "all on", "faster than real time", "shares of the step"),
        note=f"Medians of {ROUNDS} rounds. A share is the time that a step saves without the effect, "
        "also because the motion changes; so shares need not add up to 100 %. Effects that are "
        "not named "
        f"are {_BELOW} or cannot be left out.",
    )


def difference(whole: Loop, other: Loop, name: str, ratio: Times) -> Row:
    """Return the measured cells of one effect from the loops with it (`whole`) and without it
    (`other`)."""
    kinetic, share = whole.kinetic(), saved(ratio)
    place, device = (
        _farthest(whole.places(), other.places()),
        _farthest(whole.device_places(), other.device_places()),
    )
    energy = 100.0 * float(
        np.abs(other.kinetic() - kinetic).max() / max(float(kinetic.max()), np.finfo(float).tiny)
    )
    moved = f"position changes by up to {_length(place or 0.0)}"
    moved += f", the device's by {_length(device)}" if device is not None else ""
    change = f"{moved}; kinetic energy changes by up to {energy:.3g} % of its largest value"
    if whole.same_motion(other):
        kind, absent = _THROUGH_CONTACTS.get(name, ("", ""))
        touching = whole.touching()
        met = kind in touching if kind else bool(touching)
        reason = "all states are the same to the last bit" if met or not absent else absent
        change = f"{NOTHING}: {reason}"
    cost = _BELOW if share is None else f"{share:+.0f} % of the step"
    return dict(zip(MEASURED, (share, place, device, energy, cost, change), strict=True))


def _length(millimetres: float) -> str:
    return f"{millimetres:.3g} mm" if millimetres < 1e3 else f"{millimetres / 1e3:.3g} m"


def _farthest(one: Floats, other: Floats) -> float | None:
    """Return the largest distance of two arrays of points [mm]; None if they are empty or differ in
    shape."""
    return (
        1e3 * float(np.linalg.norm(one - other, axis=-1).max())
        if one.shape == other.shape and one.size
        else None
    )


class Loop(RecordedLoop):
    """The simulation loop of a scene, or of a variant of it: with other values, without impulses or
    coupling, with some switches turned on or off, or with the pairs of a kind (see
    `_leave_out_pairs`) untouched."""

    def __init__(
        self,
        scene: Scene,
        world: World,
        *,
        values: Mapping[str, Any] = MappingProxyType({}),
        impulses: bool = True,
        coupled: bool = True,
        switches: Iterable[str] = (),
        on: bool = False,
        untouched: str = "",
    ) -> None:
        force = (
            [0.0] * len(scene.hand.force) if scene.hand is not None else None
        )  # zeros instead of a hand force
        values = {name: force if name == "hand.force" else value for name, value in values.items()}
        changed = scene.with_values(values) if values else scene
        law = world.law if impulses else Penalty()
        coupling = world.coupling_in(changed) if coupled else NoCoupling()
        super().__init__(Simulation(changed, law, coupling), scene.steps)
        if untouched:
            _leave_out_pairs(self.simulation, untouched)
        if switches:
            given = self.simulation.world
            turned = engine.Switches(**given.switches.members | dict.fromkeys(switches, on))
            self.simulation.world = block(engine.World(**given.members | {"switches": turned}))

    def same_motion(self, other: Loop) -> bool:
        """Whether positions and velocities of tool and device are equal to the last bit in all
        steps."""
        ours, theirs = (each.recording.joined("steps") for each in (self, other))
        return all(
            np.array_equal(ours[name], theirs[name]) for name in ("q", "v", "device_q", "device_v")
        )

    def touching(self) -> set[str]:
        """Return the kinds of contacts in the last sample: "wall", "body" (two trees) and "tree"
        (within one tree)."""
        contacts = self.recording.joined("contacts")
        a, b = contacts["body_a"], contacts["body_b"]
        tree = self.simulation.system.mechanism.tree_of_body
        kinds = np.where(b < 0, "wall", np.where(tree[a] == tree[np.maximum(b, 0)], "tree", "body"))
        return set(np.unique(kinds).tolist())

    def states(self, name: str) -> Floats:
        """Return a recorded quantity at the compared instants."""
        found: Floats = self.recording.joined("steps")[name][:: max(1, self.steps // SAMPLES)]
        return found

    def places(self) -> Floats:
        """Return points of the held body, or of all bodies without a hand, at the compared instants
        (n, k, 3) [m].

        Four of each body: its centre of mass, and points one radius of gyration away along its
        axes. The body's origin is not enough, because the origin of a hinged body lies in the hinge
        and never moves.
        """
        held, mechanism, found = (
            self.simulation.port.hand_body,
            self.simulation.system.mechanism,
            [],
        )
        bodies, states = slice(None) if held < 0 else slice(held, held + 1), self.states("q")
        for q in states:
            for body, R, p in zip(
                *(each[bodies] for each in (mechanism.bodies, *mechanism.placements(q))),
                strict=True,
            ):
                radius = (
                    float(np.sqrt(np.trace(body.inertia) / (2.0 * body.mass)))
                    if body.mass > 0.0
                    else 0.0
                )
                center = p + R @ np.asarray(body.center_of_mass)
                found.append((center, *(center + radius * R.T)))
        return np.array(found).reshape(len(states), -1, 3)

    def device_places(self) -> Floats:
        """Return positions of the device's bodies at the compared instants (n, k, 3) [m]; empty
        without a device."""
        if self.simulation.coupling.name == "none":
            return np.zeros((0, 0, 3))
        device = self.simulation.system.device_mechanism()
        return np.array([device.placements(q)[1] for q in self.states("device_q")])

    def kinetic(self) -> Floats:
        """Return the kinetic energy at the compared instants (n,) [J]."""
        states, energy = (
            zip(self.states("q"), self.states("v"), strict=True),
            self.simulation.system.mechanism,
        )
        return np.array([energy.kinetic_energy(q, v) for q, v in states])


def _leave_out_pairs(simulation: Any, kind: str) -> None:
    """Remove the pairs of shapes with a wall (`kind` "wall"), or the pairs of two trees
    ("body")."""
    system = simulation.system
    bodies, tree = system.shapes.body, system.mechanism.tree_of_body
    a, b = bodies[system.pairs[:, 0]], bodies[system.pairs[:, 1]]
    walls = b < 0
    gone = walls if kind == "wall" else ~walls & (tree[a] != tree[np.maximum(b, 0)])
    system.pairs = np.ascontiguousarray(system.pairs[~gone])
    system._worlds.clear()
    simulation.world = system.world_under(simulation.law)
