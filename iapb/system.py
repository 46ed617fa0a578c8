"""System: a scene as the arrays that the compiled step, the hand and the device read and write."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from iapb.contact.finding import ContactFinder, Contacts
from iapb.contact.geometry import contact_capacity
from iapb.contact.kernels.broadphase import bounding_sphere, make_broad_phase
from iapb.contact.kernels.touch import MOST
from iapb.contact.kernels.unilateral import ShareWork
from iapb.contact.kernels.world import State, Sweep, Switches, World
from iapb.contact.laws import ContactLaw, ImpulseAugmented
from iapb.contact.solids import Solid, solids_of
from iapb.effects import EFFECT_NAMES, Effect, active_names, decide
from iapb.errors import ArgumentError
from iapb.haptics.coupling import Coupling, FourChannel, NoCoupling, UnilateralCoupler
from iapb.haptics.rendering import PLANNED, Port
from iapb.loop import ADVANCE, IMPACTS, make_record, run_steps
from iapb.mechanics.kernels.arrays import make_workspace
from iapb.mechanics.mechanism import Mechanism
from iapb.mechanics.structure import make_free_motion
from iapb.numerics.compiled import Entry, block
from iapb.numerics.linalg import cholesky
from iapb.numerics.schema import Floats, blank, quantities, zeros_of
from iapb.scene import Scene, SpatialScene
from iapb.scene import mechanism as scene_parts

_factored = Entry(cholesky)

# effects with which contacts are looked for
_OF_CONTACTS = ("wall_contacts", "body_contacts", "self_collisions", "joint_limits")
_CONTACT_NUMBERS = (
    "friction_velocity",
    "approach_velocity",
    "cluster_distance",
    "coherence_distance",
)


class System:
    """A scene as mechanism, shapes and parameters.

    Attributes
    ----------
    remarks : sentences on links that overlap at the start
    mechanism : Mechanism
    shapes, pairs : Shapes and their candidate pairs (k, 2); most_contacts : largest number of contacts
    capacity : contacts for which a step needs room
    tool_tree : int, index of the tree that the hand holds; −1 without a hand
    tool_dofs, tool_coordinates : (start, stop) of the tool in v and in q
    dt : float [s]; tangents : of a contact, 1 in the plane, 2 in space
    restitutions : (r,) the distinct values of e among the pairs of shapes that can touch, ascending
    surfaces : Surfaces, restitution and friction of all pairs of shapes
    start : (q, v)
    joint_damping, joint_friction : (d,) [N s/m, N m s/rad] and [N, N m]; stops : Stops, the limits of the joints
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.mechanism: Mechanism = scene_parts.mechanism_of(scene)
        self.shapes = scene_parts.shapes_of(scene)
        self.pairs, left_out = scene_parts.pairs_of(scene, self.mechanism, self.shapes)
        self.remarks = scene_parts.remarks_on(scene, left_out)
        self.stops = scene_parts.stops_of(scene, self.mechanism)
        stops = len(self.stops.bound)
        self.most_contacts = contact_capacity(self.shapes, self.pairs) + stops
        # a step that is cut also keeps those that have struck and are apart
        self.capacity = self.most_contacts * (2 if scene.contact.at_touch else 1)
        self.joint_damping = scene_parts.of_joints(scene, self.mechanism, "joint_damping", 2)
        self.joint_friction = scene_parts.of_joints(scene, self.mechanism, "joint_friction", 1)
        self.start = scene_parts.start_of(scene)
        self.surfaces = scene_parts.surfaces_of(scene, stops)
        of_pairs, _ = self.surfaces.by_pair(self.pairs)
        of_stops = [scene.contact.restitution] * stops
        self.restitutions: Floats = np.unique(np.append(of_pairs, of_stops))
        self.dt = 1.0 / scene.rate
        self.gravity = scene_parts.gravity_of(scene)
        self.tangents = 2 if isinstance(scene, SpatialScene) else 1
        self.tool_tree = -1
        self.tool_dofs = (0, 0)
        self.tool_coordinates = (0, 0)
        if scene.hand is not None:
            held = self.mechanism.index(scene.hand.body)
            self.tool_tree = int(self.mechanism.tree_of_body[held])
            self.tool_dofs = self.mechanism.tree_dofs[self.tool_tree]
            self.tool_coordinates = self.mechanism.tree_coordinates[self.tool_tree]
        self._worlds: dict[Any, World] = {}

    def device_mechanism(self) -> Mechanism:
        """Return the mechanism of the device, which equals the tree in the hand (paper VI)."""
        return self.mechanism.alone(self.tool_tree)

    @cached_property
    def solids(self) -> dict[int, Solid]:
        """The solid of each shape that is not endless."""
        return solids_of(self.shapes)

    @cached_property
    def thickness(self) -> Floats:
        """Smallest extent of each shape [m], infinite for endless ones."""
        thin = np.full(len(self.shapes.kind), np.inf)
        for i, solid in self.solids.items():
            thin[i] = solid.thin
        return thin

    @cached_property
    def finder(self) -> ContactFinder:
        """Finds contacts at given placements of the bodies."""
        return ContactFinder(self.shapes, self.pairs)

    def contacts_at(self, q: ArrayLike, margin: float = 0.0) -> Contacts:
        """Return the contacts with gap <= `margin` [m] (infinity allowed) at configuration q.

        Raises
        ------
        ArgumentError
            q is not a valid configuration, or the margin is NaN.
        """
        if np.isnan(margin):
            raise ArgumentError("margin", margin, "a distance in metres, infinity allowed")
        return self.finder.find(*self.mechanism.placements(q), margin)

    def world_under(self, law: Any) -> World:
        """Return the parameters of the scene, with the switches of its effects under one of the
        engine's laws; made once."""
        scene = self.scene
        contact = self.scene.contact
        mechanism = self.mechanism
        law = law.within(self.scene)
        key = law.impulses, law.integrator, law.rendering, law.friction_in_impacts, law.pushing
        if key in self._worlds:
            return self._worlds[key]
        on = active_names(decide(self, law))
        scaled = "device_limits" in on and law.rendering in ("scale", "spread")
        limit = np.full(mechanism.nv, np.inf)
        if scaled and scene.device is not None:
            limit[slice(*self.tool_dofs)] = scene.device.force_limit
        switches = Switches(
            **{name: name in on for name in Switches._fields if name in EFFECT_NAMES},
            pushing=law.impulses and law.pushing,
            impulse_limit=scaled,
            spreading=scaled and law.rendering == "spread",
            contacts=not on.isdisjoint(_OF_CONTACTS),
        )
        ranges = np.array(mechanism.tree_dofs, np.int64).reshape(-1, 2)
        stiffness, damping = contact.gains
        world: Any = block(
            World(
                mechanism=mechanism.block,
                shapes=self.shapes,
                pairs=self.pairs,
                broad_phase=make_broad_phase(self.shapes, self.pairs),
                sweep=_sweep_of(self),
                trees=len(ranges),
                tree_of_body=mechanism.tree_of_body,
                tree_start=np.ascontiguousarray(ranges[:, 0]),
                tree_stop=np.ascontiguousarray(ranges[:, 1]),
                tree_of_coordinate=mechanism.tree_of_coordinate,
                tree_of_dof=mechanism.tree_of_dof,
                tree_mass=scene_parts.tree_masses(scene, mechanism),
                switches=switches,
                dt=self.dt,
                gravity=self.gravity,
                rigid=contact.rigid,
                stiffness=stiffness,
                damping=damping,
                **{name: float(getattr(contact, name)) for name in _CONTACT_NUMBERS},
                clamped=contact.penalty == "clamped",
                surface=self.surfaces.class_of_shape,
                friction=self.surfaces.friction,
                tangents=self.tangents,
                restitution=self.surfaces.restitution,
                per_body_rows=contact.self_collision_rows == "per_body",
                joint_damping=self.joint_damping,
                joint_friction=self.joint_friction,
                stops=self.stops,
                impulse_limit=limit,
                conserving=law.integrator == "momentum",
                free=make_free_motion(mechanism.arrays, mechanism.tree_of_body),
            )
        )
        return self._worlds.setdefault(key, world)

    def advance(self, law: Any, state: Any, applied_force: ArrayLike) -> int:
        """Advance the state by one step of an engine's law, under a generalized force (d,) without
        hand or device; return the status."""
        port, record = self._alone
        port.applied[:] = applied_force
        return int(run_steps(self.world_under(law), state, port, record, ADVANCE, 0, 1)[1])

    @cached_property
    def _alone(self) -> tuple[Any, Any]:
        """A port without a coupling, and a record that is never written."""
        port = self.make_port(NoCoupling())
        coordinates = self.mechanism.nq, self.mechanism.nv, len(port.device_q), len(port.device_v)
        return port, make_record(1, coordinates, self.capacity, self.most_impacts)

    @property
    def most_impacts(self) -> int:
        """Lines of the log of impacts: one for each tree, and some for a step that is cut."""
        return len(self.mechanism.tree_dofs) + MOST * self.scene.contact.at_touch

    def make_state(self) -> Any:
        """Return a new state at the scene's start."""
        mechanism = self.mechanism
        c = self.capacity
        trees = len(mechanism.tree_dofs)
        tangents = self.tangents
        per_body = self.scene.contact.self_collision_rows == "per_body"
        rows = c * (2 if per_body else 1)  # (13)-(14): two each
        # per-body rows have no slip: no friction in impacts
        sliding = self.scene.largest_friction > 0.0 and not per_body
        soft = self.scene.contact.forces == "implicit" or bool(self.joint_friction.any())
        uneven = len(self.restitutions) > 1
        lengths = {
            "coordinate": mechanism.nq,
            "velocity": mechanism.nv,
            "width": 2 * max((stop - start for start, stop in mechanism.tree_dofs), default=0),
            "tree": trees,
            "body": len(mechanism.bodies),
            "dof": mechanism.motions,
            "placed": 2 * mechanism.motions,
            "contact": c,
            "row": rows,
            "tangent": rows * tangents * sliding,
            "direction": tangents,
            "rest_row": c * (1 + tangents) * soft,
            "impact": self.most_impacts,
        }
        log = blank(IMPACTS[1:], lengths)
        # where a law written in Python does not set it
        for name in ("scale", "clamp", "friction_share", "solved"):
            log[name][:] = 1
        log["approaching"][:] = -1
        state = zeros_of(State, **lengths)._replace(
            share_work=zeros_of(ShareWork, velocity=(rows + 1) * uneven, row=rows * uneven),
            impacts={"logged": np.zeros(1, np.int64), **log},
        )
        state.q[:], state.v[:] = self.start
        state.mass_matrix[:] = mechanism.mass_matrix(state.q)
        scene_parts.require_joints(self.scene)
        _factored(state.mass_matrix, state.lower)
        state.group_of_tree[:] = state.island_of_tree[:] = np.arange(trees)
        state.located_q[:] = state.body.placed_q[:] = np.nan
        state.h[:] = self.dt
        state.moving[:] = True
        state.cut.arriving[:] = state.cut.whole[:] = -1
        return block(state)

    def make_port(
        self, coupling: Coupling, effects: Sequence[Effect] | None = None, external: bool = False
    ) -> Any:
        """Return hand, coupling and device at the scene's start, the device at the tool's position
        and velocity.

        `effects` is the result of `iapb.effects.decide` for the law; default: for ImpulseAugmented(). An
        `external` device moves by itself: its delay and sensor resolution are its own, so the port
        adds neither.
        """
        scene = self.scene
        hand = self.scene.hand
        settings = self.scene.device
        d = self.mechanism.nv
        if hand is None and not isinstance(coupling, NoCoupling):
            raise ArgumentError(
                "coupling", coupling.name, f"none: scene {scene.name} has no hand, so no device"
            )
        on = active_names(
            decide(self, ImpulseAugmented(), coupling) if effects is None else effects
        )
        on -= {"delay", "quantisation"} if external else set()
        device = self.mechanism if hand is None else self.device_mechanism()
        v_start, v_stop = self.tool_dofs
        q_start, q_stop = self.tool_coordinates
        lengths = {
            "velocity": d,
            "tool": v_stop - v_start,
            "tool_coordinate": q_stop - q_start,
            "tool_body": len(device.bodies),
            "slot": 1 + (settings.delay if settings and "delay" in on else 0),
            "planned": PLANNED if hand is not None and hand.changes else 0,
        }
        port = Port(
            **blank(quantities(Port), lengths),
            coupling=coupling.kind,
            hand=hand is not None,
            tool_tree=self.tool_tree,
            q_start=q_start,
            q_stop=q_stop,
            v_start=v_start,
            v_stop=v_stop,
            hand_body=-1 if hand is None else self.mechanism.index(hand.body),
            device_body=-1 if hand is None else device.index(hand.body),
            mechanism=device.block,
            body=make_workspace(len(device.bodies), device.motions),
            varying_inertia=not device.has_constant_mass_matrix,
            quantised="quantisation" in on,
            free=make_free_motion(device.arrays, device.tree_of_body),
        )
        for name, values in coupling.settings.items():
            if len(values) != lengths["tool"]:  # else the kernels would read past the end
                raise ArgumentError(
                    f"coupling {name}",
                    values,
                    f"{lengths['tool']} values, one for each coordinate of the tool",
                )
            getattr(port, name)[:] = values
        port.device_q[:] = port.sensed_q[:] = port.measured_q[:] = self.start[0][q_start:q_stop]
        port.device_v[:] = self.start[1][v_start:v_stop]
        port.force_limit[:] = np.inf
        if settings is not None:
            if "device_limits" in on:
                port.force_limit[:] = settings.force_limit
            if "device_damping" in on:
                port.device_damping[:] = settings.damping
            if "quantisation" in on:
                port.resolution[:] = settings.position_resolution
        if hand is not None:
            port.device_mass[:] = device.mass_matrix(port.device_q)
            _factored(port.device_mass, port.device_lower)
            port.hand_point[: len(hand.point)] = hand.point
            port.wrench[:] = scene_parts.wrench_of(scene, 0.0)
        return block(port)


_SYSTEMS: dict[
    int, System
] = {}  # the last used ones, by the identity of the scene, which the system keeps alive


def system_of(scene: Scene) -> System:
    """Return the system of a scene, cached by the scene's identity; neither of them ever
    changes."""
    found = _SYSTEMS.pop(id(scene), None)
    _SYSTEMS[id(scene)] = found = System(scene) if found is None else found
    for old in [*_SYSTEMS][:-8]:  # of a list, for another thread may change it meanwhile
        _SYSTEMS.pop(old, None)
    return found


def decide_effects(
    scene: Scene, law: ContactLaw | None = None, coupling: Coupling | None = None
) -> tuple[Effect, ...]:
    """Decide which effects are on for a scene and for the caller's choices.

    Parameters
    ----------
    scene
        a checked scene.
    law, coupling
        With None, an effect is on if some law or coupling needs it. The attribute ``uses`` of a law
        names the parts of the contact section that it uses (`iapb.contact.laws`); a law without it
        is assumed to use all of them.

    Returns
    -------
    tuple of Effect
        all effects in a fixed order, each with its state, the reason, and what would change without
        it.
    """
    return decide(system_of(scene), law, coupling)


def coupling_of(scene: Scene, name: str) -> Coupling:
    """Return the coupling `none`, `four-channel` or `unilateral` with the gains of the scene (Table
    I)."""
    if name == "none":
        return NoCoupling()
    kinds: dict[str, type[FourChannel | UnilateralCoupler]] = {
        "four-channel": FourChannel,
        "unilateral": UnilateralCoupler,
    }
    if name not in kinds:
        raise ArgumentError("coupling", name, "one of none, four-channel, unilateral")
    field = name.replace("-", "_")
    gains = getattr(scene.couplings, field)
    if gains is None:
        raise ArgumentError(
            "coupling", name, f"a scene with couplings.{field}; {scene.name} gives no gains for it"
        )
    return kinds[name](tuple(gains.stiffness), tuple(gains.damping))


def _sweep_of(system: System) -> Sweep:
    """Return what the search for touches within a step needs of all shapes."""
    shapes = system.shapes
    spheres = [bounding_sphere(shapes, i) for i in range(len(shapes.kind))]
    middle = np.array([middle for middle, _ in spheres], np.float64).reshape(-1, 3)
    radius = np.array([radius for _, radius in spheres], np.float64)
    thin = system.thickness
    reach = (np.linalg.norm(middle, axis=1) + radius)[shapes.body >= 0].max(initial=0.0)
    linked = any(body.parent is not None for body in system.mechanism.bodies)
    lever = np.inf if linked else np.sqrt(3.0) * (1.0 + reach)
    return Sweep(middle, radius, thin, float(thin.min(initial=np.inf)), float(lever))
