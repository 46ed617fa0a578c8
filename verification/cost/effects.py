"""The effects that a scene needs, the motion without each of them, and the time that the others
save.

Times are compared on one and the same motion: with the effects that the scene needs, and with every
effect that has a switch, which then changes nothing. left_out.yaml says how an effect is left out.
A motion without an effect is another motion, so its time is not compared.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
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
from verification.clock import LEAST_ROUNDS, Times, take_turns
from verification.cost.steps import RecordedLoop
from verification.data import data_of
from verification.finding import Failure, attempt, counted
from verification.numbers import quoted
from verification.scenes.points import placed, points_of
from verification.table import Columns, Row, Table, table_from

ROUNDS = 9  # number of rounds; each loop runs once per round
SLOW = 0.5  # [s] a scene whose run takes longer has the least number of rounds
SAMPLES = 400  # number of instants at which positions are compared


# effect -> the variant of the scene without it
LEFT_OUT: dict[str, dict[str, Any]] = data_of(__file__, "left_out.yaml")
# Effects that a switch of the step can turn on in a scene that does not need them; they then change
# nothing. Friction in impacts and implicit contact are not among them, because they need arrays of
# their own.
_OWN_ARRAYS = ("impact_friction", "implicit_contact", "supports", "touch")
SWITCHED = tuple(
    name for name in engine.Switches._fields if name in EFFECT_NAMES and name not in _OWN_ARRAYS
)
# What happens without an effect: the same states to the last bit, another motion, or no run at all.
SAME = "same bits"
MOVES = "another motion"
STOPS = "no run"


def effects_of_scenes(
    progress: Callable[[int, int], None] | None = None, failures: list[Failure] | None = None
) -> dict[str, Table]:
    """Return the effects of each shipped scene in the IAPB world, and under STEPS their times."""
    names = scene_names()
    found = dict[str, Table]()
    rows = list[Row]()
    for name in counted(names, progress) if progress else names:
        measured = attempt(name, partial(_of_shipped, name, failures), failures)
        if measured is not None:
            found[name], times = measured
            rows.append(times)
    return {STEPS: steps_table(rows), **found}


def _of_shipped(name: str, failures: list[Failure] | None) -> tuple[Table, Row]:
    scene = load_scene(find_scene(name))
    return effects_of(scene, failures=failures), step_of(scene)


def effects_of(scene: Scene, world: str = "IAPB", failures: list[Failure] | None = None) -> Table:
    """Return every effect of a scene, and what its run is without each effect that is on.

    `failures` receives effects that raise an exception other than `IapbError`; if it is None, the
    exception propagates.
    """
    chosen = find_world(world)
    effects = decide_effects(scene, chosen.law, chosen.coupling_in(scene))
    whole = run_loop(scene, chosen, {})
    without: dict[str, Row] = {}
    for effect in effects:
        if effect.active and effect.name in LEFT_OUT and isinstance(whole, Loop):
            tried = partial(_without, whole, scene, chosen, LEFT_OUT[effect.name])
            without[effect.name] = attempt(f"{scene.name}, {effect.name}", tried, failures) or {}
    return table_from(
        (
            {
                "effect": effect.name,
                "active": effect.active,
                "reason": effect.reason,
                "left out": effect.left_out,
                **dict.fromkeys(MEASURED),
                **without.get(effect.name, {}),
            }
            for effect in effects
        ),
        kinds=Columns(prose=("reason", "left out")),
    )


# What is measured of an effect that is on and can be left out.
MEASURED = (
    "without it",  # SAME, MOVES or STOPS
    # largest distance of the tool (without a hand: of any body) from that with the effect
    "position [mm]",
    "energy [%]",  # largest change of kinetic energy, relative to its largest value with the effect
)


def _without(whole: Loop, scene: Scene, world: World, variant: Mapping[str, Any]) -> Row:
    other = run_loop(scene, world, variant)
    return difference(whole, other) if isinstance(other, Loop) else {MEASURED[0]: STOPS}


def run_loop(scene: Scene, world: World, variant: Mapping[str, Any]) -> Loop | IapbError:
    """Return the loop after one run, or the error that stopped this run."""
    try:
        loop = Loop(scene, world, **variant)
        loop.sample()
    except IapbError as error:
        return error
    return loop


def difference(whole: Loop, other: Loop) -> Row:
    """Return the measured cells of one effect from the loops with it and without it."""
    kinetic = whole.kinetic()
    change = np.abs(other.kinetic() - kinetic).max() / max(kinetic.max(), np.finfo(float).tiny)
    values = (
        SAME if whole.same_motion(other) else MOVES,
        _farthest(whole.places(), other.places()),
        100.0 * float(change),
    )
    return dict(zip(MEASURED, values, strict=True))


def _farthest(one: Floats, other: Floats) -> float | None:
    """Return the largest distance of two arrays of points [mm]; None if they are empty or differ in
    shape."""
    return (
        1e3 * float(np.linalg.norm(one - other, axis=-1).max())
        if one.shape == other.shape and one.size
        else None
    )


STEPS = "time of a step"
QUOTES = data_of(__file__, "numbers.yaml")
UNMOVED = 1e-6  # [mm] rounding of positions, where another order of sums is chosen
TIMED = ("step", "all on", "saved", "saved, lower", "saved, upper", "noise", "clear")


def step_of(scene: Scene, world: str = "IAPB", rounds: int = ROUNDS) -> Row:
    """Time the step of a scene with its effects, again, and with all of SWITCHED on.

    The motion is the same in all three, so their times compare. The second timing of the same step
    is the noise: the larger quartile of its difference from the first.
    """
    chosen = find_world(world)
    effects = decide_effects(scene, chosen.law, chosen.coupling_in(scene))
    needed = Loop(scene, chosen)
    again = Loop(scene, chosen)
    every = Loop(scene, chosen, switches=SWITCHED, on=True)
    loops = {"needed": needed, "again": again, "every": every}
    if needed.sample() * needed.steps > SLOW:
        rounds = LEAST_ROUNDS
    times = take_turns({name: loop.sample for name, loop in loops.items()}, rounds)
    saved = _shares(times["needed"].over(times["every"]))
    noise = max(map(abs, _shares(times["again"].over(times["needed"]))[1:]))
    return {
        "scene": scene.name,
        "effects on": sum(effect.active for effect in effects),
        "effects": len(effects),
        "step [µs]": 1e6 * times["needed"].median,
        "all on [µs]": 1e6 * times["every"].median,
        "saved [%]": saved[0],
        "saved, lower [%]": saved[1],
        "saved, upper [%]": saved[2],
        "noise [%]": noise,
        "clear": saved[1] > noise,
        "apart with all on [mm]": _farthest(needed.places(), every.places()),
    }


def _shares(ratio: Times) -> tuple[float, float, float]:
    """Return median, lower and upper quartile of the time that is saved [%]."""
    return tuple(100.0 * (1.0 - share) for share in (ratio.median, ratio.upper, ratio.lower))  # type: ignore[return-value]


def steps_table(rows: Iterable[Row]) -> Table:
    """Return the times of the steps, the largest saving first."""
    ordered = sorted(rows, key=lambda row: -float(row["saved [%]"]))
    return table_from(ordered, kinds=Columns(timed=TIMED, timed_rows=True))


def numbers_of(times: Table) -> Row:
    """Return the main numbers of the page: effects that are on, and the time that the others
    save."""
    found = quoted({STEPS: QUOTES[STEPS]}, {STEPS: times})
    return {
        **found,
        "saves": found["saved_median"] > found["noise_median"],
        "alone": found["apart_largest_mm"] <= UNMOVED,
    }


def matrix(effects: Mapping[str, Table]) -> Table:
    """Return a row for each scene, and a column for each effect that some scene needs: "on",
    "idle" (on, and without it the run has the same bits), or "off"."""
    found = {
        scene: {row["effect"]: row for row in table.records()} for scene, table in effects.items()
    }
    names = dict.fromkeys(name for rows in found.values() for name in rows)
    needed = [name for name in names if any(rows[name]["active"] for rows in found.values())]
    return table_from(
        {"scene": scene} | {name: _state(rows[name]) for name in needed}
        for scene, rows in found.items()
    )


def _state(row: Row) -> str:
    if not row["active"]:
        return "off"
    return "idle" if row["without it"] == SAME else "on"


class Loop(RecordedLoop):
    """The simulation loop of a scene, or of a variant of it: with other values, without impulses or
    coupling, or with some switches turned on or off."""

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
    ) -> None:
        # zeros instead of a hand force
        force = [0.0] * len(scene.hand.force) if scene.hand is not None else None
        values = {name: force if name == "hand.force" else value for name, value in values.items()}
        changed = scene.with_values(values) if values else scene
        law = world.law if impulses else Penalty()
        coupling = world.coupling_in(changed) if coupled else NoCoupling()
        super().__init__(Simulation(changed, law, coupling), scene.steps)
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
        held = self.simulation.port.hand_body
        mechanism = self.simulation.system.mechanism
        chosen = slice(None) if held < 0 else slice(held, held + 1)
        place, turn = placed(mechanism, self.states("q"))
        bodies = mechanism.bodies
        arms = [np.sqrt(np.trace(one.inertia) / (2.0 * (one.mass or np.inf))) for one in bodies]
        offset = np.array([one.center_of_mass for one in bodies])
        center = place + (turn @ offset[:, :, None])[..., 0]
        found = points_of(center, turn, np.array(arms)[:, None, None])[:, chosen]
        return found.reshape(len(found), -1, 3)

    def kinetic(self) -> Floats:
        """Return the kinetic energy at the compared instants (n,) [J]."""
        mechanism = self.simulation.system.mechanism
        return mechanism.energies(self.states("q"), self.states("v"), np.zeros(3))[0]
