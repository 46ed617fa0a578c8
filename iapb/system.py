"""System: a scene turned into the arrays that the compiled step reads and writes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.compiled import Entry, block
from iapb.contact.broadphase import WORTHWHILE_PAIRS, make_broad_phase
from iapb.contact.geometry import contact_capacity, make_contact_buffer
from iapb.contact.kernels.impact import make_impact_work
from iapb.contact.kernels.impact_friction import make_friction_work
from iapb.contact.kernels.step import advance
from iapb.contact.kernels.unilateral import make_push_work
from iapb.contact.kernels.world import ImpactLog, State, Switches, World
from iapb.contact.laws import ImpulseAugmented
from iapb.effects import EFFECT_NAMES, Effect, active_names, decide_for
from iapb.errors import ArgumentError
from iapb.haptics.coupling import Coupling, FourChannel, NoCoupling, UnilateralCoupler
from iapb.haptics.kernels import Port
from iapb.mechanics.integrators import INTEGRATORS
from iapb.mechanics.kernels.cholesky import cholesky
from iapb.mechanics.mechanism import Mechanism
from iapb.scene import Scene, SpatialScene
from iapb.scene.mechanism import mechanism_of, pairs_of, restitution_by_pair, restitution_by_shape, shapes_of
from iapb.system_port import force_limit, make_port

Floats = NDArray[np.float64]


class System:
    """A scene as mechanism, shapes and parameters.

    Attributes
    ----------
    scene : Scene
    mechanism : Mechanism
    tool_tree : int, tree that the hand holds; −1 without a hand
    tool_dofs, tool_coordinates : (start, stop) of the tool in v and in q
    dt : float [s]
    restitutions : (r,) the different values of e among the pairs of shapes that can touch, ascending
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.mechanism: Mechanism = mechanism_of(scene)
        self.shapes = shapes_of(scene)
        self.pairs = pairs_of(scene, self.shapes)
        self.capacity = contact_capacity(self.shapes, self.pairs)
        self.restitutions = np.unique(restitution_by_pair(scene, self.pairs))
        self.dt = 1.0 / scene.rate
        self.gravity = np.array([*(scene.gravity or ()), 0.0, 0.0, 0.0])[:3]
        self.tool_tree = -1 if scene.hand is None else int(self.mechanism.tree_of_body[self._held_body()])
        self.tool_dofs, self.tool_coordinates = self._tool_ranges()
        self._worlds: dict[Any, World] = {}
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
        """The device: kinematically and inertially the hand-held tree, alone (paper VI)."""
        bodies = np.flatnonzero(self.mechanism.tree_of_body == self.tool_tree)
        return Mechanism([self.mechanism.bodies[b] for b in bodies])

    def world_under(self, law: Any) -> World:
        """The constant arrays of the step under one of the engine's laws (cached)."""
        key = _key(law)
        if key not in self._worlds:
            self._worlds[key] = make_world(self, law)
        return self._worlds[key]

    def make_state(self) -> State:
        """A fresh state at the scene's start."""
        return make_state(self)

    def advance_under(self, law: Any) -> Entry:
        """The compiled step of one of the engine's laws, to be called again and again (cached)."""
        return self._advances.setdefault(_key(law), Entry(advance))

    def make_port(self, coupling: Coupling, effects: Sequence[Effect] | None = None, external: bool = False) -> Port:
        """Hand, coupling and device at the scene's start; `external`: the device moves by itself.

        `effects` is what `decide` gives for the law; default: of ImpulseAugmented().
        """
        decided = self.decide(ImpulseAugmented(), coupling) if effects is None else effects
        return make_port(self, coupling, active_names(decided), external)

    def decide(self, law: Any, coupling: Coupling | None = None) -> tuple[Effect, ...]:
        """What is on under a law and a coupling: the world, the port and the record are made from it."""
        return decide_for(self.scene, self.mechanism, self.shapes, self.pairs, law, coupling)


def _key(law: Any) -> tuple[Any, ...]:
    """What a world depends on besides the scene."""
    return law.impulses, law.integrator, law.rendering, law.friction_in_impacts


def coupling_of(scene: Scene, name: str) -> Coupling:
    """The coupling `none`, `four-channel` or `unilateral` with the gains of the scene (Table I)."""
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


def make_world(system: System, law: Any) -> World:
    """Collect the parameters of the scene and the switches of its effects under a law."""
    scene, contact, mechanism = system.scene, system.scene.contact, system.mechanism
    limit = np.full(mechanism.nv, np.inf)
    on = active_names(system.decide(law))
    scaled = "device_limits" in on and law.rendering in ("scale", "spread")
    if scaled:
        limit[slice(*system.tool_dofs)] = force_limit(scene)
    switches = Switches(
        **{name: name in on for name in Switches._fields if name in EFFECT_NAMES},
        impulse_limit=scaled,
        spreading=scaled and law.rendering == "spread",
        contacts=not on.isdisjoint(("wall_contacts", "body_contacts", "self_collisions")),
        broad_phase=len(system.pairs) > WORTHWHILE_PAIRS,
    )
    integrator = INTEGRATORS[law.integrator]
    ranges = np.array(mechanism.tree_dofs, dtype=np.int64).reshape(-1, 2)
    return block(World(
        mechanism=mechanism.arrays, shapes=system.shapes, pairs=system.pairs,
        broad_phase=make_broad_phase(system.shapes, system.pairs[: len(system.pairs) * switches.broad_phase]),
        tree_of_body=mechanism.tree_of_body,
        tree_start=np.ascontiguousarray(ranges[:, 0]), tree_stop=np.ascontiguousarray(ranges[:, 1]),
        switches=switches, dt=system.dt, gravity=system.gravity,
        stiffness=float(contact.stiffness), damping=float(contact.damping), clamped=contact.penalty == "clamped",
        friction=float(contact.friction), friction_velocity=float(contact.friction_velocity),
        restitution=float(system.restitutions[0] if len(system.restitutions) == 1 else contact.restitution),
        own_restitution=restitution_by_shape(scene), approach_velocity=float(contact.approach_velocity),
        cluster_distance=float(contact.cluster_distance), coherence_distance=float(contact.coherence_distance),
        per_body_rows=contact.self_collision_rows == "per_body", impulse_limit=limit,
        stage_fraction=np.array(integrator.fraction), stage_weight=np.array(integrator.weight),
        semi_implicit=integrator.semi_implicit,
    ))  # fmt: skip


def slides_in_impacts(scene: Scene) -> bool:
    """Whether a law with friction in impacts has any here; rows (13)-(14) of one body alone have no slip to stop."""
    return scene.contact.friction > 0.0 and scene.contact.self_collision_rows == "relative"


def make_state(system: System) -> State:
    """Allocate everything a step writes and place the scene at its start."""
    mechanism, capacity = system.mechanism, system.capacity
    d, nq, trees = mechanism.nv, mechanism.nq, len(mechanism.tree_dofs)
    rows = capacity * (2 if system.scene.contact.self_collision_rows == "per_body" else 1)  # (13)-(14): two each
    q = np.array([x for body in system.scene.bodies for x in body.position], dtype=np.float64)
    v = np.array([x for body in system.scene.bodies for x in body.velocity], dtype=np.float64)
    mass = mechanism.mass_matrix(q)
    lower = np.zeros((d, d))
    if cholesky(mass, lower):
        raise ArgumentError("scene", system.scene.name, "bodies whose mass matrix is positive definite at the start")
    sliding, tangents = slides_in_impacts(system.scene), 2 if isinstance(system.scene, SpatialScene) else 1
    pushing = sliding or len(system.restitutions) > 1
    vectors = {name: np.zeros(d) for name in (
        "penalty_force", "friction_force", "impulse", "stage_penalty", "stage_friction", "bias", "acceleration",
        "start_v", "mean_v", "mean_acceleration", "group_v", "group_v_plus", "group_impulse", "target", "row")}
    squares = {name: np.zeros((d, d)) for name in ("group_mass", "group_lower", "triangle")}
    return block(State(
        q=q, v=v, mass_matrix=mass, lower=lower, body=mechanism.workspace(),
        contacts=make_contact_buffer(capacity), previous=make_contact_buffer(capacity),
        stage_contacts=make_contact_buffer(capacity), contact_count=np.zeros(2, np.int64),
        group_of_tree=np.arange(trees, dtype=np.int64), state_of_tree=np.zeros(trees, np.int8),
        island_of_tree=np.arange(trees, dtype=np.int64), collides_of_tree=np.zeros(trees, np.bool_),
        row_budget=np.array([d], np.int64), spreading=np.zeros(trees, np.bool_), start_q=np.zeros(nq),
        contact_impulse=np.zeros(rows), rows=np.zeros(rows, np.int64), dofs=np.zeros(d, np.int64),
        row_impulse=np.zeros(rows), row_restitution=np.zeros(rows), work=make_impact_work(d, rows),
        push_work=make_push_work(d * pushing, rows * pushing),
        friction_work=make_friction_work(d * sliding, rows * sliding, tangents), impacts=_make_log(trees, d),
        **vectors, **squares,
    ))  # fmt: skip


def _make_log(trees: int, d: int) -> ImpactLog:
    """An empty log; what a law written in Python says nothing of stays as it is here."""
    counts = {name: np.zeros(trees, np.int64) for name in ("group", "rows", "rank")}
    numbers = {name: np.ones(trees) for name in ("scale", "clamp", "friction_share")}
    vectors = {name: np.zeros((trees, d)) for name in ("v_minus", "v_plus", "impulse")}
    return ImpactLog(
        logged=np.zeros(1, np.int64), energy_lost=np.zeros(trees), approaching=np.full(trees, -1, np.int64),
        solved=np.ones(trees, np.bool_), **counts, **numbers, **vectors,
    )  # fmt: skip
