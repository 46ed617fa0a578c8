"""Input of a step (World, constant) and its output (State): plain arrays and numbers for the
kernels."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np

from iapb.contact.geometry import ContactBuffer, Shapes
from iapb.contact.kernels.broadphase import BroadPhase
from iapb.contact.kernels.impact import ImpactWork
from iapb.contact.kernels.impact_friction import FrictionWork
from iapb.contact.kernels.implicit import RestWork
from iapb.contact.kernels.unilateral import PushWork, ShareWork
from iapb.mechanics.kernels.arrays import MechanismArrays, Workspace
from iapb.mechanics.kernels.free_motion import FreeMotion
from iapb.numerics.schema import Booleans, Floats, Indices, Integers, States


class Switches(NamedTuple):
    """Effects that are on. An effect that is off costs one branch; its code does not run."""

    gravity: bool
    varying_inertia: bool
    velocity_terms: bool
    impulses: bool
    unequal_restitution: bool
    pushing: bool
    impact_friction: bool
    friction: bool  # of resting contacts
    implicit_contact: bool  # resting forces are implicit in the velocity; else explicit (5)
    clustering: bool
    # a contact that strikes may have others beside it, which carry a load or have another e
    supports: bool
    touch: bool  # impacts happen at the moment of touch; else at the start of the next step
    impulse_limit: bool
    spreading: bool
    contacts: bool
    joint_damping: bool
    joint_friction: bool
    joint_limits: bool


class Stops(NamedTuple):
    """Ends of the joints' ranges, as contacts of a body and its parent (k of them;
    `iapb.scene.mechanism.stops_of`)."""

    body: np.ndarray  # (k,) int64
    parent: np.ndarray  # (k,) int64, −1 = the world
    shape: np.ndarray  # (k,) int64: number used for both shapes of the contact
    coordinate: np.ndarray  # (k,) int64 in q
    dof: np.ndarray  # (k,) int64
    sign: np.ndarray  # (k,) 1 least, −1 largest position
    bound: np.ndarray  # (k,) [rad, m]
    arm: np.ndarray  # (k,) [m]


class Sweep(NamedTuple):
    """What the search for touches within a step knows of n shapes."""

    middle: np.ndarray  # (n, 3) [m] centre of a bounding sphere, in the body's frame
    radius: np.ndarray  # (n,) [m] its radius; infinite for half-planes and half-spaces
    thin: np.ndarray  # (n,) [m] smallest extent
    thinnest: float  # [m] smallest of these
    lever: float  # no point moves faster than this times the largest entry of v; infinite: unknown


class World(NamedTuple):
    """A scene under one contact law, as input of the step (n bodies, d velocities, t trees)."""

    mechanism: MechanismArrays
    shapes: Shapes
    pairs: np.ndarray  # (k, 2) candidate pairs of shapes
    broad_phase: BroadPhase  # finds the near pairs among them
    sweep: Sweep
    tree_of_body: np.ndarray  # (n,) int64
    tree_start: np.ndarray  # (t,) first dof of each tree
    tree_stop: np.ndarray  # (t,)
    tree_of_coordinate: np.ndarray  # (nq,) int64
    tree_of_dof: np.ndarray  # (d,) int64
    tree_mass: np.ndarray  # (t,) mass of its bodies [kg]
    switches: Switches
    dt: float  # [s]
    gravity: np.ndarray  # (3,) [m/s²]
    rigid: bool  # the masses of a group give its K and B; else the scene does
    stiffness: float  # K [N/m] (5)
    damping: float  # B [N s/m] (5)
    tangents: int  # of a contact: 1 in the plane, 2 in space
    clamped: bool  # F_n >= 0; False: (5) as printed, may pull
    surface: np.ndarray  # (shapes + stops,) int64: the class of a shape
    friction: np.ndarray  # (classes, classes) μ (6) of two shapes by their classes
    restitution: np.ndarray  # (classes, classes) e of two shapes
    friction_velocity: float  # v_threshold [m/s] (6)
    approach_velocity: float  # v_approach [m/s]: slower approach is not a collision
    cluster_distance: float  # [m]
    coherence_distance: float  # [m]
    per_body_rows: bool  # (13)-(14) instead of (12)
    joint_damping: np.ndarray  # (d,) viscous [N s/m, N m s/rad]
    joint_friction: np.ndarray  # (d,) Coulomb's [N, N m]
    stops: Stops
    impulse_limit: np.ndarray  # (d,) largest |Jᵀp/Δt| the device can render [N, N m], inf = none
    conserving: bool  # free motion keeps momentum (`iapb.mechanics.kernels.free_motion`)
    free: FreeMotion


class StepStart(NamedTuple):
    """The start of a step that is cut, after the impacts there: with the names of `State`."""

    impulse: Annotated[Floats, "velocity"]
    contact_impulse: Annotated[Floats, "row"]
    contact_count: Annotated[Integers, "2"]
    contacts: ContactBuffer
    previous: ContactBuffer
    group_of_tree: Annotated[Integers, "tree"]
    state_of_tree: Annotated[States, "tree"]
    spreading: Annotated[Booleans, "tree"]
    rests: Annotated[Booleans, "tree"]


class StepEnd(NamedTuple):
    """The end of a step that is cut: with the names of `State`."""

    q: Annotated[Floats, "coordinate"]
    v: Annotated[Floats, "velocity"]
    penalty_force: Annotated[Floats, "velocity"]  # [N, N m] mean over the step
    friction_force: Annotated[Floats, "velocity"]


class Cut(NamedTuple):
    """Scratch of a step that is cut: its start, its end, and its parts."""

    arriving: Annotated[Integers, "1"]  # contacts at the end of the step in `State.arriving`, or −1
    elapsed: Annotated[Floats, "1"]  # [s] since the start of the step
    whole: Annotated[Integers, "1"]  # a tree whose group is never cut, −1 = none
    start: StepStart
    start_q: Annotated[Floats, "coordinate"]
    start_v: Annotated[Floats, "velocity"]
    logged: Annotated[Integers, "1"]  # impacts at the start
    struck: Annotated[Booleans, "tree"]  # in some part of the step
    end: StepEnd
    part_q: Annotated[Floats, "coordinate"]  # the start of the present part
    part_v: Annotated[Floats, "velocity"]
    penalty: Annotated[Floats, "velocity"]  # [N s, N m s] of the parts so far
    friction: Annotated[Floats, "velocity"]
    component: Annotated[Integers, "tree"]  # first tree of those that are cut together
    touches: Annotated[Booleans, "tree"]  # the first tree of a component with new contacts
    pairs: Annotated[Indices, "contact 2"]  # pairs of shapes that have come to overlap
    fast: Annotated[Indices, "contact"]  # candidate pairs that may pass through each other
    fast_count: Annotated[Integers, "1"]


class State(NamedTuple):
    """Everything that changes from step to step, and the scratch of the step; `iapb.system` makes
    it from the fields.

    A row is one of an impact: of a contact, or of one of its two bodies (`per_body_rows`).
    """

    q: Annotated[Floats, "coordinate"]
    v: Annotated[Floats, "velocity"]
    mass_matrix: Annotated[Floats, "velocity velocity"]
    lower: Annotated[Floats, "velocity velocity"]  # its Cholesky factor
    body: Workspace  # placements and mechanics scratch
    contacts: ContactBuffer  # of this step
    previous: ContactBuffer  # of the step before
    scratch_contacts: ContactBuffer  # of another velocity or configuration
    arriving: ContactBuffer  # at the end of the step, or of a part of it
    h: Annotated[Floats, "1"]  # [s] length of the step, or of the part of it that is computed
    moving: Annotated[Booleans, "tree"]  # takes part in this part of the step
    rests: Annotated[Booleans, "tree"]  # a contact may hold it: it does not fall freely
    cut: Cut  # of a step that is cut at touches
    contact_count: Annotated[Integers, "2"]  # contacts now, contacts in the step before
    group_of_tree: Annotated[Integers, "tree"]  # first tree of its contact group
    state_of_tree: Annotated[States, "tree"]  # FREE, COLLIDING, RESTING
    island_of_tree: Annotated[Integers, "tree"]  # first tree of its island, resolved in one impact
    collides_of_tree: Annotated[Booleans, "tree"]  # the first tree of an island that collides
    spreading: Annotated[Booleans, "tree"]  # an impulse is still being spread over steps
    penalty_force: Annotated[Floats, "velocity"]  # [N, N m]
    friction_force: Annotated[Floats, "velocity"]
    impulse: Annotated[Floats, "velocity"]  # generalized impulse of the step [N s, N m s]
    bias: Annotated[Floats, "velocity"]  # B or G, scratch
    acceleration: Annotated[Floats, "velocity"]
    scratch_q: Annotated[Floats, "coordinate"]  # another configuration
    start_v: Annotated[Floats, "velocity"]  # velocity after the impact
    acceleration_before: Annotated[Floats, "velocity"]  # scratch of free motion
    contact_impulse: Annotated[Floats, "row"]  # [N s] per contact, minimum norm
    rows: Annotated[Integers, "row"]  # contact of each row of the present impact
    dofs: Annotated[Integers, "velocity"]  # coordinates of the present group
    row_impulse: Annotated[Floats, "row"]
    row_restitution: Annotated[Floats, "row"]
    row: Annotated[Floats, "velocity"]  # one contact row nᵀJ
    work: ImpactWork  # of the present group
    push_work: PushWork
    share_work: ShareWork
    friction_work: FrictionWork
    rest_work: RestWork
    located_q: Annotated[Floats, "coordinate"]  # configuration of mass_matrix and lower; NaN: any
    # scratch of free motion: a root's momentum and its centre
    root_momentum: Annotated[Floats, "tree 9"]
    tree_energy: Annotated[Floats, "tree"]  # of a tree, in free motion
    # of the step: `logged` (1,) lines in use, and (t,) lines of `iapb.run.ImpactTable`, without the
    # step
    impacts: Any = ()
