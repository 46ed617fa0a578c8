"""Input of a step (World, constant) and its output (State): plain arrays and numbers for the
kernels."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

from iapb.contact.geometry import ContactBuffer, Shapes
from iapb.contact.kernels.broadphase import BroadPhase
from iapb.contact.kernels.impact import ImpactWork
from iapb.contact.kernels.impact_friction import FrictionWork
from iapb.contact.kernels.implicit import RestWork
from iapb.contact.kernels.unilateral import PushWork, ShareWork
from iapb.mechanics.kernels.arrays import MechanismArrays, Workspace
from iapb.mechanics.kernels.free_motion import FreeMotion
from iapb.numerics.schema import (
    FlagPerTree,
    FloatPerCoordinate,
    FloatPerRow,
    FloatPerVelocity,
    Floats,
    IndexPerContact,
    Indices,
    Integers,
    NumberPerTree,
    NumberPerVelocity,
    SingleFloat,
    SingleInteger,
    States,
    VelocityMatrix,
)


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

    body: Integers  # (k,)
    parent: Integers  # (k,), −1 = the world
    shape: Integers  # (k,): number used for both shapes of the contact
    coordinate: Integers  # (k,) in q
    dof: Integers  # (k,)
    sign: Floats  # (k,) 1 least, −1 largest position
    bound: Floats  # (k,) [rad, m]
    arm: Floats  # (k,) [m]


class Sweep(NamedTuple):
    """What the search for touches within a step knows of n shapes."""

    middle: Floats  # (n, 3) [m] centre of a bounding sphere, in the body's frame
    radius: Floats  # (n,) [m] its radius; infinite for half-planes and half-spaces
    thin: Floats  # (n,) [m] smallest extent
    thinnest: float  # [m] smallest of these
    lever: float  # no point moves faster than this times the largest entry of v; infinite: unknown


class World(NamedTuple):
    """A scene under one contact law, as input of the step (n bodies, d velocities, t trees)."""

    mechanism: MechanismArrays
    shapes: Shapes
    pairs: Indices  # (k, 2) candidate pairs of shapes
    broad_phase: BroadPhase  # finds the near pairs among them
    sweep: Sweep
    trees: int  # their number t
    tree_of_body: Integers  # (n,)
    tree_start: Integers  # (t,) first dof of each tree
    tree_stop: Integers  # (t,)
    tree_of_coordinate: Integers  # (nq,)
    tree_of_dof: Integers  # (d,)
    tree_mass: Floats  # (t,) mass of its bodies [kg]
    switches: Switches
    dt: float  # [s]
    gravity: Floats  # (3,) [m/s²]
    rigid: bool  # the masses of a group give its K and B; else the scene does
    stiffness: float  # K [N/m] (5)
    damping: float  # B [N s/m] (5)
    tangents: int  # of a contact: 1 in the plane, 2 in space
    clamped: bool  # F_n >= 0; False: (5) as printed, may pull
    surface: Integers  # (shapes + stops,): the class of a shape
    friction: Floats  # (classes, classes) μ (6) of two shapes by their classes
    restitution: Floats  # (classes, classes) e of two shapes
    friction_velocity: float  # v_threshold [m/s] (6)
    approach_velocity: float  # v_approach [m/s]: slower approach is not a collision
    cluster_distance: float  # [m]
    coherence_distance: float  # [m]
    per_body_rows: bool  # (13)-(14) instead of (12)
    joint_damping: Floats  # (d,) viscous [N s/m, N m s/rad]
    joint_friction: Floats  # (d,) Coulomb's [N, N m]
    stops: Stops
    impulse_limit: Floats  # (d,) largest |Jᵀp/Δt| the device can render [N, N m], inf = none
    conserving: bool  # free motion keeps momentum (`iapb.mechanics.kernels.free_motion`)
    free: FreeMotion


class StepStart(NamedTuple):
    """The start of a step that is cut, after the impacts there: with the names of `State`."""

    impulse: FloatPerVelocity
    contact_impulse: FloatPerRow
    contact_count: Annotated[Integers, "2"]
    contacts: ContactBuffer
    previous: ContactBuffer
    group_of_tree: NumberPerTree
    state_of_tree: Annotated[States, "tree"]
    spreading: FlagPerTree
    rests: FlagPerTree


class StepEnd(NamedTuple):
    """The end of a step that is cut: with the names of `State`."""

    q: FloatPerCoordinate
    v: FloatPerVelocity
    penalty_force: FloatPerVelocity  # [N, N m] mean over the step
    friction_force: FloatPerVelocity


class Cut(NamedTuple):
    """Scratch of a step that is cut: its start, its end, and its parts."""

    arriving: SingleInteger  # contacts at the end of the step in `State.arriving`, or −1
    elapsed: SingleFloat  # [s] since the start of the step
    whole: SingleInteger  # a tree whose group is never cut, −1 = none
    start: StepStart
    start_q: FloatPerCoordinate
    start_v: FloatPerVelocity
    logged: SingleInteger  # impacts at the start
    struck: FlagPerTree  # in some part of the step
    end: StepEnd
    part_q: FloatPerCoordinate  # the start of the present part
    part_v: FloatPerVelocity
    penalty: FloatPerVelocity  # [N s, N m s] of the parts so far
    friction: FloatPerVelocity
    component: NumberPerTree  # first tree of those that are cut together
    touches: FlagPerTree  # the first tree of a component with new contacts
    pairs: Annotated[Indices, "contact 2"]  # pairs of shapes that have come to overlap
    fast: IndexPerContact  # candidate pairs that may pass through each other
    fast_count: SingleInteger


class State(NamedTuple):
    """Everything that changes from step to step, and the scratch of the step; `iapb.system` makes
    it from the fields.

    A row is one of an impact: of a contact, or of one of its two bodies (`per_body_rows`).
    """

    q: FloatPerCoordinate
    v: FloatPerVelocity
    mass_matrix: VelocityMatrix
    lower: VelocityMatrix  # its Cholesky factor
    body: Workspace  # placements and mechanics scratch
    contacts: ContactBuffer  # of this step
    previous: ContactBuffer  # of the step before
    scratch_contacts: ContactBuffer  # of another velocity or configuration
    arriving: ContactBuffer  # at the end of the step, or of a part of it
    h: SingleFloat  # [s] length of the step, or of the part of it that is computed
    moving: FlagPerTree  # takes part in this part of the step
    rests: FlagPerTree  # a contact may hold it: it does not fall freely
    cut: Cut  # of a step that is cut at touches
    contact_count: Annotated[Integers, "2"]  # contacts now, contacts in the step before
    group_of_tree: NumberPerTree  # first tree of its contact group
    state_of_tree: Annotated[States, "tree"]  # FREE, COLLIDING, RESTING
    island_of_tree: NumberPerTree  # first tree of its island, resolved in one impact
    collides_of_tree: FlagPerTree  # the first tree of an island that collides
    spreading: FlagPerTree  # an impulse is still being spread over steps
    penalty_force: FloatPerVelocity  # [N, N m]
    friction_force: FloatPerVelocity
    impulse: FloatPerVelocity  # generalized impulse of the step [N s, N m s]
    bias: FloatPerVelocity  # B or G, scratch
    acceleration: FloatPerVelocity
    scratch_q: FloatPerCoordinate  # another configuration
    start_v: FloatPerVelocity  # velocity after the impact
    acceleration_before: FloatPerVelocity  # scratch of free motion
    contact_impulse: FloatPerRow  # [N s] per contact, minimum norm
    rows: Annotated[Integers, "row"]  # contact of each row of the present impact
    dofs: NumberPerVelocity  # coordinates of the present group
    row_impulse: FloatPerRow
    row_restitution: FloatPerRow
    row: FloatPerVelocity  # one contact row nᵀJ
    work: ImpactWork  # of the present group
    push_work: PushWork
    share_work: ShareWork
    friction_work: FrictionWork
    rest_work: RestWork
    located_q: FloatPerCoordinate  # configuration of mass_matrix and lower; NaN: any
    # scratch of free motion: a root's momentum and its centre
    root_momentum: Annotated[Floats, "tree 9"]
    tree_energy: Annotated[Floats, "tree"]  # of a tree, in free motion
    # of the step: `logged` (1,) lines in use, and (t,) lines of `iapb.run.ImpactTable`, without the
    # step
    impacts: Any = ()
