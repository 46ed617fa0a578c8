"""System: a scene as the arrays that the compiled step, the hand and the device read and write."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.advice.checks import settled
from iapb.advice.effects import EFFECT_NAMES, Effect, Facts, active_names, count_pairs, decide_for
from iapb.compiled import Entry, block, columns, flag
from iapb.contact.geometry import ContactBuffer, contact_capacity, make_contact_buffer
from iapb.contact.kernels.broadphase import WORTHWHILE_PAIRS, make_broad_phase
from iapb.contact.kernels.coulomb import make_step_friction
from iapb.contact.kernels.impact import make_impact_work
from iapb.contact.kernels.impact_friction import make_friction_work
from iapb.contact.kernels.implicit import make_rest_work
from iapb.contact.kernels.narrow_phase import detect
from iapb.contact.kernels.step import STATUS_TEXT, TOO_MANY_CONTACTS, advance
from iapb.contact.kernels.unilateral import make_push_work
from iapb.contact.kernels.world import State, Stops, Switches, World
from iapb.contact.laws import ImpulseAugmented, Penalty
from iapb.errors import ArgumentError, IapbError
from iapb.haptics.coupling import Coupling, FourChannel, NoCoupling, UnilateralCoupler
from iapb.haptics.kernels import PLANNED, Port
from iapb.haptics.waveforms import waveform_weights
from iapb.linalg import cholesky
from iapb.mechanics.free_motion import make_free_motion
from iapb.mechanics.integrators import INTEGRATORS
from iapb.mechanics.kernels.arrays import make_workspace
from iapb.mechanics.mechanism import Mechanism
from iapb.run import ImpactTable, blank, quantities
from iapb.scene import Scene, SpatialScene
from iapb.scene.mechanism import (
    frictions_of,
    joint_damping_of,
    kept,
    mechanism_of,
    pairs_of,
    restitution_by_shape,
    restitutions_of,
    shapes_of,
    start_of,
    stops_of,
)

Floats = NDArray[np.float64]

_factored = Entry(cholesky)

# Effects whose kernels are compiled only where they are on.
_COMPILED = ("impact_friction", "unequal_restitution", "joint_damping")


class Parts:
    """Everything that follows from bodies and walls alone, shared by scenes whose bodies and walls are identical.

    Attributes
    ----------
    mechanism, shapes, pairs, stops, capacity, joint_damping : see `System`
    own_restitution : (r,), see `World`; pair_counts : see `iapb.advice.effects.Facts`
    firsts : blocks such as ports and switches, of which twins are used
    """

    def __init__(self, scene: Scene) -> None:
        self.mechanism: Mechanism = mechanism_of(scene)
        self.shapes = shapes_of(scene)
        self.pairs = pairs_of(scene, self.shapes)
        self.pair_counts = count_pairs(self.mechanism, self.shapes, self.pairs)
        self.stops = make_stops(scene, self.mechanism, len(self.shapes.kind))
        self.capacity = contact_capacity(self.shapes, self.pairs) + len(self.stops.bound)
        self.joint_damping = joint_damping_of(scene)
        self.own_restitution = restitution_by_shape(scene)
        self.firsts: dict[Any, Any] = {}

    @cached_property
    def of_world(self) -> dict[str, Any]:
        """Fields of a world that are the same under every law."""
        ranges = np.array(self.mechanism.tree_dofs, dtype=np.int64).reshape(-1, 2)
        return {"mechanism": self.mechanism.block, "shapes": block(self.shapes),
                "tree_of_body": self.mechanism.tree_of_body, "joint_damping": self.joint_damping,
                "tree_start": np.ascontiguousarray(ranges[:, 0]), "tree_stop": np.ascontiguousarray(ranges[:, 1]),
                "own_restitution": self.own_restitution, "stops": block(self.stops),
                "free": block(make_free_motion(self.mechanism.arrays, self.mechanism.tree_of_body))}

    def broad_phase(self, pairs: NDArray[np.int32], used: bool) -> Any:
        """Return a new broad phase, because a world writes into it; if unused, a shared empty one."""
        if not used:
            return kept(self.firsts, "stub", lambda: block(make_broad_phase(self.shapes, self.pairs[:0])))
        if pairs is not self.pairs:  # the caller has left pairs out
            return block(make_broad_phase(self.shapes, pairs))
        return kept(self.firsts, "broad phase", lambda: block(make_broad_phase(self.shapes, pairs)).twin()).twin()


_PARTS: dict[str, Parts] = {}  # by the scene's bodies and walls as text


def parts_of(scene: Scene) -> Parts:
    """Return the parts of a scene, which scenes with identical bodies and walls share.

    Start positions count only if joints have limits, because the arm of a stop depends on the start.
    """
    moved = {"__all__": {"position", "velocity"}}
    stopped = any(body.joint_limits is not None for body in scene.bodies)
    said = scene.model_dump_json(include={"bodies", "walls"}, exclude=None if stopped else {"bodies": moved})
    return kept(_PARTS, f"{type(scene).__name__} {scene.contact.self_collisions} {said}", lambda: Parts(scene))


class System:
    """A scene as mechanism, shapes and parameters.

    Attributes
    ----------
    scene : Scene, with the values that `contact.auto` chooses
    remarks : sentences on the chosen values
    mechanism : Mechanism
    tool_tree : int, index of the tree that the hand holds; −1 without a hand
    tool_dofs, tool_coordinates : (start, stop) of the tool in v and in q
    dt : float [s]
    restitutions : (r,) the distinct values of e among the pairs of shapes that can touch, ascending
    frictions : Frictions, of all pairs of shapes
    start : (q, v)
    joint_damping : (d,) [N s/m, N m s/rad]; stops : Stops, the limits of the joints
    """

    def __init__(self, scene: Scene) -> None:
        self.given = scene
        self.scene, self.remarks = settled(scene)
        scene, self.parts = self.scene, parts_of(self.scene)
        self.mechanism, self.shapes, self.pairs = self.parts.mechanism, self.parts.shapes, self.parts.pairs
        self.stops, self.capacity = self.parts.stops, self.parts.capacity
        self.joint_damping, self.start = self.parts.joint_damping, start_of(scene)
        self.restitutions, self.frictions = restitutions_of(scene, self.pairs), frictions_of(scene)
        self.dt = 1.0 / scene.rate
        self.gravity = np.array([*(scene.gravity or ()), 0.0, 0.0, 0.0])[:3]
        self.tool_tree = -1 if scene.hand is None else int(self.mechanism.tree_of_body[self._held_body()])
        self.tool_dofs, self.tool_coordinates = self._tool_ranges()
        self._worlds: dict[Any, World] = {}
        self._effects: dict[Any, tuple[Effect, ...]] = {}
        self._advances: dict[Any, Entry] = {}

    def _held_body(self) -> int:
        if self.scene.hand is None:
            raise ArgumentError("scene", self.scene.name, "a scene with a hand")
        return self.mechanism.index(self.scene.hand.body)

    def _tool_ranges(self) -> tuple[tuple[int, int], tuple[int, int]]:
        if self.tool_tree < 0:
            return (0, 0), (0, 0)
        bodies = np.flatnonzero(self.mechanism.tree_of_body == self.tool_tree)
        start = int(self.mechanism.arrays.q_start[bodies[0]])
        size = sum(self.mechanism.bodies[b].joint.layout.nq for b in bodies)
        v_start, v_stop = self.mechanism.tree_dofs[self.tool_tree]
        return (int(v_start), int(v_stop)), (start, start + size)

    def device_mechanism(self) -> Mechanism:
        """Return the mechanism of the device, which equals the tree in the hand (paper VI)."""
        return self.mechanism.alone(self.tool_tree)

    def contacts_at(self, q: ArrayLike, margin: float = 0.0) -> ContactBuffer:
        """Return the contacts with gap <= `margin` [m] (infinity allowed) at configuration q, from geometry alone.

        Raises
        ------
        ArgumentError
            q is not a valid configuration, or the margin is NaN.
        IapbError
            There are more contacts than `capacity`.
        """
        if np.isnan(margin):
            raise ArgumentError("margin", margin, "a distance in metres, infinity allowed")
        buffer, count = make_contact_buffer(self.capacity), 0
        if len(self.pairs):
            count = int(detect(block(self.shapes), self.pairs, *self.mechanism.placements(q), float(margin), buffer))
        if count < 0:
            raise IapbError(STATUS_TEXT[TOO_MANY_CONTACTS])
        columns: list[Any] = [column[:count] for column in buffer]
        return ContactBuffer(*columns)

    def world_under(self, law: Any, effects: Sequence[Effect] | None = None) -> World:
        """Return the constant arrays of the step under one of the engine's laws (cached).

        `effects` is the result of `decide` for the law and any coupling.
        """
        law = law.within(self.scene)
        key = _key(law)
        if key not in self._worlds:
            self._worlds[key] = make_world(self, law, self.decide(law) if effects is None else effects)
        return self._worlds[key]

    def make_state(self) -> State:
        """Return a new state at the scene's start."""
        contact, mechanism = self.scene.contact, self.mechanism
        rows = self.capacity * (2 if contact.self_collision_rows == "per_body" else 1)  # (13)-(14): two each
        state: State = _blank_state(
            (len(mechanism.bodies), len(mechanism.tree_dofs), mechanism.nq, mechanism.nv, _largest_tree(mechanism)),
            self.capacity, rows, 2 if isinstance(self.scene, SpatialScene) else 1, slides_in_impacts(self.scene),
            self.scene.largest_friction > 0.0 and contact.friction_law == "coulomb", contact.forces == "implicit",
        ).twin()
        q, v = self.start
        for name, values in (("q", q), ("v", v), *self._mass_at_start.items()):
            getattr(state, name)[:] = values
        return state

    @cached_property
    def _mass_at_start(self) -> dict[str, Floats]:
        mass = self.mechanism.mass_matrix(self.start[0])
        lower = np.zeros_like(mass)
        if _factored(mass, lower):
            raise ArgumentError("scene", self.scene.name, "bodies whose mass matrix is positive definite at the start")
        return {"mass_matrix": mass, "lower": lower}

    def advance_under(self, law: Any) -> Entry:
        """Return the compiled step of one of the engine's laws, for repeated calls (cached)."""
        return self._advances.setdefault(_key(law.within(self.scene)), Entry(advance))

    def make_port(self, coupling: Coupling, effects: Sequence[Effect] | None = None, external: bool = False) -> Port:
        """Return hand, coupling and device at the scene's start; an `external` device moves by itself.

        `effects` is the result of `decide` for the law; default: for ImpulseAugmented().
        """
        decided = self.decide(ImpulseAugmented(), coupling) if effects is None else effects
        on = active_names(decided) & _OF_PORT
        key = ("port", *self._of_port, *_gains_of(coupling), on, external)
        port: Port = kept(self.parts.firsts, key, lambda: _make_port(self, coupling, on, external)).twin()
        if self.scene.hand is not None:
            port.wrench[:] = wrenches_of(self.scene, [0.0])[0]
        return port

    @cached_property
    def _of_port(self) -> tuple[Any, ...]:
        """The scene's values for hand and device, without the force of the hand."""
        hand, places = self.scene.hand, (values.tobytes() for values in self.start)
        held = None if hand is None else (hand.body, repr(hand.point), hand.changes)
        return held, self.scene.model_dump_json(include={"device", "rate"}), *places

    def decide(self, law: Any, coupling: Coupling | None = None) -> tuple[Effect, ...]:
        """Return the effects under a law and a coupling; the world, the port and the record are made from them."""
        if type(law) not in (ImpulseAugmented, Penalty):  # a law of the user may answer differently each time
            return decide_for(self.scene, self._facts, law, coupling)
        law = law.within(self.scene)
        key = law, *_gains_of(coupling)
        if key not in self._effects:
            self._effects[key] = decide_for(self.scene, self._facts, law, coupling)
        return self._effects[key]

    @cached_property
    def _facts(self) -> Facts:
        frictions = np.unique(self.frictions.by_pair(self.pairs))
        return Facts(self.mechanism, *self.parts.pair_counts, tuple(self.restitutions.tolist()),
                     tuple(frictions.tolist()))


_OF_PORT = frozenset({"delay", "quantisation", "waveform", "device_damping", "device_limits"})  # effects of a port


def _gains_of(coupling: Coupling | None) -> tuple[Any, ...]:
    """Return the key of a coupling: what a port and the effects depend on besides scene and law."""
    return (None,) if coupling is None else (coupling.kind, *map(tuple, coupling.settings.values()))


def _key(law: Any) -> tuple[Any, ...]:
    """Return the key of a law: what a world depends on besides the scene."""
    return law.impulses, law.integrator, law.rendering, law.friction_in_impacts, law.impulses and law.pushing


_SYSTEMS: dict[int, System] = {}  # by the identity of the scene, which the system keeps alive


def system_of(scene: Scene) -> System:
    """Return the system of a scene, cached by the scene's identity; neither of them ever changes."""
    return kept(_SYSTEMS, id(scene), lambda: System(scene))


def coupling_of(scene: Scene, name: str) -> Coupling:
    """Return the coupling `none`, `four-channel` or `unilateral` with the gains of the scene (Table I)."""
    if name == "none":
        return NoCoupling()
    kinds: dict[str, tuple[Callable[..., Coupling], Any]] = {
        "four-channel": (FourChannel, scene.couplings.four_channel),
        "unilateral": (UnilateralCoupler, scene.couplings.unilateral),
    }
    if name not in kinds:
        raise ArgumentError("coupling", name, "one of none, four-channel, unilateral")
    kind, gains = kinds[name]
    if gains is None:
        raise ArgumentError("coupling", name, f"a scene with couplings.{name.replace('-', '_')}; "
                                              f"{scene.name} gives no gains for it")
    return kind(tuple(gains.stiffness), tuple(gains.damping))


def make_world(system: System, law: Any, effects: Sequence[Effect]) -> World:
    """Return the parameters of the scene and the switches of its effects under a law."""
    scene, contact, mechanism = system.scene, system.scene.contact, system.mechanism
    limit = np.full(mechanism.nv, np.inf)
    on = active_names(effects)
    scaled = "device_limits" in on and law.rendering in ("scale", "spread")
    if scaled:
        limit[slice(*system.tool_dofs)] = _force_limit(scene)
    switches = Switches(
        **{name: flag(name in on) if name in _COMPILED else name in on
           for name in Switches._fields if name in EFFECT_NAMES},
        pushing=flag(law.impulses and law.pushing),
        impulse_limit=scaled,
        spreading=scaled and law.rendering == "spread",
        contacts=not on.isdisjoint(("wall_contacts", "body_contacts", "self_collisions", "joint_limits")),
        broad_phase=len(system.pairs) > WORTHWHILE_PAIRS,
    )
    integrator = INTEGRATORS[law.integrator]
    return block(World(
        **system.parts.of_world, pairs=system.pairs,
        broad_phase=system.parts.broad_phase(system.pairs, switches.broad_phase),
        switches=kept(system.parts.firsts, ("switches", *switches), lambda: block(switches)),
        dt=system.dt, gravity=system.gravity,
        stiffness=float(contact.stiffness), damping=float(contact.damping), clamped=contact.penalty == "clamped",
        friction_class=system.frictions.class_of_shape, friction=system.frictions.table,
        coulomb=flag("friction" in on and (contact.friction_law == "coulomb" or contact.forces == "implicit")),
        implicit=flag(contact.forces == "implicit"), tangents=2 if isinstance(scene, SpatialScene) else 1,
        friction_velocity=float(contact.friction_velocity),
        restitution=float(system.restitutions[0] if len(system.restitutions) == 1 else contact.restitution),
        approach_velocity=float(contact.approach_velocity),
        cluster_distance=float(contact.cluster_distance), coherence_distance=float(contact.coherence_distance),
        per_body_rows=contact.self_collision_rows == "per_body", impulse_limit=limit,
        stage_fraction=np.array(integrator.fraction), stage_weight=np.array(integrator.weight),
        semi_implicit=integrator.semi_implicit, conserving=integrator.conserving,
    ))


def make_stops(scene: Scene, mechanism: Mechanism, shapes: int) -> Stops:
    """Return the joint limits as arrays; their numbers follow those of the `shapes`."""
    found = stops_of(scene, mechanism)
    body, parent = (np.array([getattr(stop, name) for stop in found], np.int64) for name in ("body", "parent"))
    sign, bound, arm = (np.array([getattr(stop, name) for stop in found]) for name in ("sign", "bound", "arm"))
    return Stops(body, parent, shapes + np.arange(len(found), dtype=np.int64), mechanism.arrays.q_start[body],
                 mechanism.arrays.v_start[body], sign, bound, arm)


def slides_in_impacts(scene: Scene) -> bool:
    """Whether impacts of this scene can have friction; per-body rows (13)-(14) have no slip, so they have none."""
    return scene.largest_friction > 0.0 and scene.contact.self_collision_rows == "relative"


@lru_cache(maxsize=8)
def _blank_state(sizes: tuple[int, ...], capacity: int, rows: int, tangents: int, sliding: bool, rubbing: bool,
                 implicit: bool) -> Any:
    """Make a state of these sizes, of which twins are used; scenes with equal sizes share it."""
    bodies, trees, nq, d, largest_tree = sizes
    vectors = {name: np.zeros(d) for name in (
        "v", "penalty_force", "friction_force", "impulse", "stage_penalty", "stage_friction", "bias", "acceleration",
        "start_v", "mean_v", "mean_acceleration", "group_v", "group_v_plus", "group_impulse", "row")}
    squares = {name: np.zeros((d, d)) for name in ("mass_matrix", "lower", "group_mass", "group_lower")}
    return block(State(
        q=np.zeros(nq), body=make_workspace(bodies, d),
        contacts=make_contact_buffer(capacity), previous=make_contact_buffer(capacity),
        stage_contacts=make_contact_buffer(capacity), contact_count=np.zeros(2, np.int64),
        group_of_tree=np.arange(trees, dtype=np.int64), state_of_tree=np.zeros(trees, np.int8),
        island_of_tree=np.arange(trees, dtype=np.int64), collides_of_tree=np.zeros(trees, np.bool_),
        row_budget=np.array([d], np.int64), spreading=np.zeros(trees, np.bool_), start_q=np.zeros(nq),
        contact_impulse=np.zeros(rows), rows=np.zeros(rows, np.int64), dofs=np.zeros(d, np.int64),
        row_impulse=np.zeros(rows), row_restitution=np.zeros(rows), work=make_impact_work(d, rows),
        push_work=make_push_work(d, rows),
        friction_work=make_friction_work(d * sliding, rows * sliding, tangents),
        step_friction=make_step_friction(d, capacity * (rubbing and not implicit), tangents, largest_tree),
        rest_work=make_rest_work(d * implicit, capacity * implicit, 1 + tangents, largest_tree, trees),
        located_q=np.full(nq, np.nan), root_momentum=np.zeros(9 * trees), tree_energy=np.zeros(trees),
        impacts=_make_log(trees, d), **vectors, **squares,
    )).twin()


def _largest_tree(mechanism: Mechanism) -> int:
    return max((stop - start for start, stop in mechanism.tree_dofs), default=0)


def _make_log(trees: int, d: int) -> Any:
    """Return an empty log with the defaults for fields that a law written in Python does not set."""
    lines = blank(quantities(ImpactTable)[1:], {"impact": trees, "velocity": d})
    for name in ("scale", "clamp", "friction_share", "solved"):
        lines[name][:] = 1
    lines["approaching"][:] = -1
    return columns("ImpactLog", {"logged": np.zeros(1, np.int64), **lines})


def _make_port(system: System, coupling: Coupling, on: frozenset[str], external: bool = False) -> Any:
    """Allocate hand, coupling and device; the device starts at the tool's position with the tool's velocity.

    `on` holds the names of the active effects. An `external` device has its own delay and sensor resolution, so the
    port adds neither.
    """
    on -= {"delay", "quantisation"} if external else set()
    scene, d = system.scene, system.mechanism.nv
    held = system.tool_tree >= 0
    if not held and not isinstance(coupling, NoCoupling):
        raise ArgumentError("coupling", coupling.name, f"none: scene {scene.name} has no hand, so no device")
    device = system.device_mechanism() if held else system.mechanism
    (v_start, v_stop), (q_start, q_stop) = system.tool_dofs, system.tool_coordinates
    q, v = (start[first:last].copy() for start, first, last in zip(
        system.start, (q_start, v_start), (q_stop, v_stop), strict=True))
    mass = device.mass_matrix(q) if held else np.zeros((0, 0))
    lower = np.zeros_like(mass)
    _factored(mass, lower)
    zeros: dict[str, Any] = {name: np.zeros(d) for name in (
        "hand_force", "coupling_force", "environment_force", "applied")}
    tool_zeros: dict[str, Any] = {name: np.zeros(v_stop - v_start) for name in (
        "device_hand_force", "device_force", "pulse_force", "error", "acceleration", "measured_v")}
    return block(Port(
        coupling=coupling.kind, device=flag(not isinstance(coupling, NoCoupling)), tool_tree=system.tool_tree,
        q_start=q_start, q_stop=q_stop, v_start=v_start,
        v_stop=v_stop, mechanism=device.block, body=device.workspace(),
        varying_inertia=not device.has_constant_mass_matrix,
        free=block(make_free_motion(device.arrays, device.tree_of_body)),
        trees=np.zeros(len(device.bodies), np.int64), device_q=q, device_v=v, device_mass=mass,
        device_lower=lower, sensed_q=q.copy(), measured_q=q.copy(), engaged=np.zeros(1, np.bool_),
        clock=np.zeros(1, np.int64), **_hand(system, device), **_gains(coupling, v_stop - v_start),
        **_actuators(scene, (q_stop - q_start, v_stop - v_start), on),
        **_pulses(scene, system.dt, v_stop - v_start, "waveform" in on),
        **zeros, **tool_zeros,
    )).twin()


def _force_limit(scene: Scene) -> tuple[float, ...] | None:
    """Return the device's force limits [N, N m]; None if the scene gives none."""
    return scene.device.force_limit if scene.device is not None else None


def _hand(system: System, device: Any) -> dict[str, Any]:
    """Return the port's fields for the hand: held body, point and force."""
    hand, wrench, point = system.scene.hand, np.zeros(6), np.zeros(3)
    if hand is None:
        return {"hand_body": -1, "device_body": -1, "hand_point": point, "wrench": wrench,
                "planned": np.zeros((0, 6))}
    point[: len(hand.point)] = hand.point
    return {"hand_body": system.mechanism.index(hand.body), "device_body": device.index(hand.body),
            "hand_point": point, "wrench": wrench, "planned": np.zeros((PLANNED * hand.changes, 6))}


def wrenches_of(scene: Scene, times: Sequence[float]) -> Floats:
    """Return force and torque (n, 6) of the scene's hand at n times [s] in world axes; zeros without a hand."""
    if scene.hand is None:
        return np.zeros((len(times), 6))
    forces = np.array(scene.hand.forces(times))
    wrenches = np.zeros((len(forces), 6))
    wrenches[:, [0, 1, 5] if forces.shape[1] == 3 else slice(None)] = forces
    return wrenches


def _gains(coupling: Coupling, size: int) -> dict[str, Any]:
    gains = coupling.settings if not isinstance(coupling, NoCoupling) else {}
    for name, values in gains.items():
        if len(values) != size:  # else the kernels would read past the end
            raise ArgumentError(f"coupling {name}", values, f"{size} values, one for each coordinate of the tool")
    return {name: _per_coordinate(gains.get(name), size) for name in ("stiffness", "damping")}


def _actuators(scene: Scene, sizes: tuple[int, int], on: frozenset[str]) -> dict[str, Any]:
    """Return the port's fields for the device: limits, damping, sensor resolution and delay."""
    (nq, size), settings, limit = sizes, scene.device, _force_limit(scene)
    damped, limited, quantised = ("device_damping" in on, "device_limits" in on, "quantisation" in on)
    slots = 1 + (settings.delay if settings is not None and "delay" in on else 0)
    return {
        "device_damping": _per_coordinate(settings.damping if settings and damped else None, size), "damped": damped,
        "force_limit": _per_coordinate(limit, size, np.inf), "limited": limited,
        "resolution": _per_coordinate(settings.position_resolution if settings and quantised else None, size),
        "quantised": quantised,
        "delayed_force": np.zeros((slots, size)), "delayed_q": np.zeros((slots, nq)),
        "delayed_v": np.zeros((slots, size)),
    }


def _pulses(scene: Scene, dt: float, size: int, shaped: bool) -> dict[str, Any]:
    """Return the port's fields for the waveform by which the device renders an impulse."""
    weights = waveform_weights(scene.device.waveform if shaped and scene.device else "step", dt)
    return {"pulsed": len(weights) > 1, "pulse_weights": weights, "pulse_pending": np.zeros((len(weights), size)),
            "pulse_balance": np.zeros(1), "pulse_held": np.zeros(1, np.int64)}


def _per_coordinate(values: Any, size: int, default: float = 0.0) -> Floats:
    return np.full(size, default) if values is None else np.array(values, dtype=np.float64)
