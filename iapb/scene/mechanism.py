"""Turn a scene into the engine's mechanism, shapes and candidate pairs, with restitution and
friction of each pair.

The bodies of a planar scene lie in the plane z = 0 of the spatial engine. What a step uses is made
without BLAS, because its last bits depend on the processor.
"""

from __future__ import annotations

import itertools
import math
from typing import Any, NamedTuple

import numpy as np

from iapb.contact import geometry
from iapb.contact.finding import ContactFinder
from iapb.contact.geometry import Shapes, candidate_pairs, make_shapes
from iapb.contact.kernels.contact_set import TOUCHING
from iapb.contact.kernels.world import Stops
from iapb.errors import ArgumentError
from iapb.mechanics.bodies import Body
from iapb.mechanics.joints import Joint, Mimic, ranges_of
from iapb.mechanics.mechanism import Mechanism
from iapb.mechanics.rotations import frame_along, rotation_of
from iapb.mechanics.structure import carriers
from iapb.numerics.linalg import product
from iapb.numerics.schema import Booleans, Floats, Indices, Integers
from iapb.scene.bodies import WORLD, in_space, inertia_matrix
from iapb.scene.model import Scene
from iapb.scene.parts import SMALLEST_POSITIVE

Pairs = Indices


def mechanism_of(scene: Scene) -> Mechanism:
    """Return the scene's bodies as a mechanism, in the scene's order; q concatenates their
    positions.

    A planar moment of inertia I about z becomes diag(I/2, I/2, I), the inertia of a flat body, so
    that the spatial engine gets a physical inertia. Motion in the plane depends on its zz entry
    alone.
    """
    return Mechanism(map(_body_in_space, scene.bodies))


def _body_in_space(body: Any) -> Body:
    mimic = body.joint_mimic
    joint = Joint(body.joint)
    if body.axis is not None:
        x, y, z = in_space(body.axis).tolist()
        joint = Joint(body.joint, (x, y, z))
    flat = len(body.origin) == 2
    return Body(
        name=body.name,
        parent=None if body.parent == WORLD else body.parent,
        joint=joint,
        placement=(_turn(body), in_space(body.origin)),
        mass=body.mass,
        center_of_mass=in_space(body.center_of_mass),
        inertia=np.diag([0.5, 0.5, 1.0]) * body.inertia if flat else inertia_matrix(body.inertia),
        mimic=mimic and Mimic(mimic.body, mimic.multiplier, mimic.offset),
    )


def _turn(placed: Any) -> Floats:
    """Return the rotation matrix (3, 3) of a placement, without negative zeros."""
    rpy = placed.rpy if hasattr(placed, "rpy") else (0.0, 0.0, placed.angle)
    return rotation_of(rpy) + 0.0


def start_of(scene: Scene) -> tuple[Floats, Floats]:
    """Return the scene's start: configuration q (nq,) and velocity v (nv,)."""
    q = [x for body in scene.bodies for x in body.position]
    v = [x for body in scene.bodies for x in body.velocity]
    return np.array(q, np.float64), np.array(v, np.float64)


class JointFault(NamedTuple):
    """What is wrong with the joint of a body."""

    body: int
    field: str
    value: Any
    expected: str


def joint_fault(scene: Scene) -> JointFault | None:
    """Return the first joint that starts outside its limits or moves no mass; None: all are right.

    Its limits are those of its own body and of every joint that follows it.
    """
    return _start_outside_limits(scene) or _joint_without_mass(scene)


def _start_outside_limits(scene: Scene) -> JointFault | None:
    for i, (body, limits) in enumerate(zip(scene.bodies, limits_of(scene), strict=True)):
        low, high = limits or (-math.inf, math.inf)
        if limits and not (low < high and low <= body.position[0] <= high):
            said = f"a start within [{low:g}, {high:g}], the range that the limits of {body.name} "
            said += "and of what follows it have in common"
            return JointFault(i, "position", list(body.position), said)
    return None


def _joint_without_mass(scene: Scene) -> JointFault | None:
    """Return a joint that moves no mass at the start.

    The mass matrix is computed only if some body lacks mass or inertia of its own.
    """
    if all(_moves_its_own(body) for body in scene.bodies):
        return None
    mechanism = mechanism_of(scene)
    q, _ = start_of(scene)
    k = mechanism.unmoved_velocity(q)
    if k is None:
        return None
    i = int(mechanism.arrays.dof_body[k])
    body = scene.bodies[i]
    why = "no mass turns about it" if mechanism.arrays.dof_rotates[k] else "no mass moves along it"
    if mechanism.mass_matrix(q)[k, k] > SMALLEST_POSITIVE:
        why = "no mass lies between it and joints that move alike"
    expected = f"mass or inertia that it moves ({body.name}: {why})"
    return JointFault(i, "joint", body.joint, expected)


def _moves_its_own(body: Any) -> bool:
    """Return whether a joint is fixed, or its body has mass and inertia about every axis."""
    inertia = body.inertia
    if np.ndim(inertia):
        inertia = np.linalg.eigvalsh(inertia_matrix(inertia))[0]
    return body.joint == "fixed" or bool(min(body.mass, inertia) >= SMALLEST_POSITIVE)


def require_joints(scene: Scene) -> None:
    """Raise ArgumentError for what `joint_fault` finds."""
    if fault := joint_fault(scene):
        argument = f"{fault.field} of {scene.bodies[fault.body].name}"
        raise ArgumentError(argument, fault.value, fault.expected)


def wrench_of(scene: Scene, time: float) -> Floats:
    """Return force and torque (6,) of the scene's hand at a time [s] in world axes; zeros without a
    hand."""
    return wrench(scene.hand.force_at(time) if scene.hand is not None else [0.0] * 6)


def wrench(force: Any) -> Floats:
    """Return force and torque (6,) given by three numbers in the plane, or by six in space."""
    found = np.zeros(6)
    found[[0, 1, 5] if len(force) == 3 else slice(None)] = force
    return found


def hand_force_of(scene: Scene, mechanism: Mechanism, q: Floats, time: float) -> Floats:
    """Return the generalized force (d,) of the scene's hand at a configuration and a time [s]."""
    pull = wrench_of(scene, time)
    if scene.hand is None or not pull.any():
        return np.zeros(mechanism.nv)
    body = mechanism.index(scene.hand.body)
    lever = product(mechanism.placements(q)[0][body], in_space(scene.hand.point))
    pull[3:] += np.cross(lever, pull[:3])
    return product(mechanism.frame_jacobian(q, body).T, pull)


def gravity_of(scene: Scene) -> Floats:
    """Return the acceleration (3,) by gravity [m/s²]."""
    return in_space(scene.gravity or (0.0, 0.0))


def of_joints(scene: Scene, mechanism: Mechanism, field: str, power: int) -> Floats:
    """Return a field of the joints of the bodies, by velocity (nv,). A joint that follows another
    one adds its own to that of the leader, times a power of the multiplier."""
    m = mechanism.arrays
    own = np.zeros(mechanism.motions)
    for start, body in zip(m.v_start.tolist(), scene.bodies, strict=True):
        values = getattr(body, field)
        own[start : start + len(values)] = values
    found = np.zeros(mechanism.nv)
    np.add.at(found, m.dof_leader, np.abs(m.dof_ratio) ** power * own)
    return found


def limits_of(scene: Scene) -> list[tuple[float, float] | None]:
    """Return the limits of each body's coordinate, None where it has none.

    Joints that follow it narrow them.
    """
    ranges = ranges_of((body.name, body.joint_limits, body.joint_mimic) for body in scene.bodies)
    return [ranges.get(body.name) for body in scene.bodies]


def _owned_shapes(scene: Scene) -> list[tuple[int, Any, Any]]:
    """Return every shape after its body or wall and the body's index, -1 for walls."""
    of_bodies = [(i, body, shape) for i, body in enumerate(scene.bodies) for shape in body.shapes]
    return of_bodies + [(-1, wall, wall) for wall in scene.walls]


def shape_names(scene: Scene) -> list[str]:
    """Return the name of the body or wall of each shape."""
    return [owner.name for _, owner, _ in _owned_shapes(scene)]


def shapes_of(scene: Scene) -> Shapes:
    """Return the scene's shapes: those of the bodies in order, then the walls.

    A shape of a body that cannot move (all joints between it and the world are fixed) is static,
    like a wall.
    """
    index = {body.name: i for i, body in enumerate(scene.bodies)}
    made = []
    for body, _, shape in _owned_shapes(scene):
        rotation = np.eye(3)
        shift = np.zeros(3)
        link = body
        while link >= 0 and scene.bodies[link].joint == "fixed":
            turn = _turn(scene.bodies[link])
            rotation = product(turn, rotation)
            shift = product(turn, shift) + in_space(scene.bodies[link].origin)
            link = index.get(scene.bodies[link].parent, -1)
        if link < 0:
            made.append(_placed(shape, -1, rotation, shift))
        else:
            made.append(_placed(shape, body, np.eye(3), np.zeros(3)))
    return make_shapes(made)


def _placed(shape: Any, body: int, rotation: Floats, shift: Floats) -> geometry.Shape:
    """Return a shape of the scene, turned and shifted into the body's frame."""
    if shape.kind == "half_plane":
        normal = np.array(shape.normal) / math.hypot(*shape.normal)
        return geometry.Shape(geometry.HALF_PLANE, vertices=[shape.point, normal])
    if shape.kind == "half_space":
        axes = frame_along(np.array(shape.normal))
        return geometry.Shape(geometry.HALF_SPACE, center=shape.point, axes=axes)
    center = product(rotation, in_space(shape.center)) + shift
    if shape.kind == "circle":
        return geometry.Shape(geometry.CIRCLE, body, shape.radius, [center[:2]], center)
    if shape.kind == "sphere":
        return geometry.Shape(geometry.SPHERE, body, shape.radius, center=center)
    turn = product(rotation, _turn(shape))
    if len(shape.center) == 3:
        half = 0.5 * np.array(shape.size)
        return geometry.Shape(geometry.BOX, body, center=center, axes=turn, half_size=half)
    if shape.kind == "polygon":
        corners = shape.vertices
    else:
        corners = 0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * shape.size
    vertices = product(corners, turn[:2, :2].T) + center[:2]
    return geometry.Shape(geometry.POLYGON, body, vertices=vertices)


def pairs_of(scene: Scene, mechanism: Mechanism, shapes: Shapes) -> tuple[Pairs, Pairs]:
    """Return the candidate pairs (k, 2) of the scene's shapes (`shapes_of`), and those left out.

    Pairs of links are left out that overlap at the start.

    The first shape of a pair is of a moving body. Bodies of one tree are paired only with
    ``contact.self_collisions``. Rigidly connected bodies and neighbours across one joint are never
    paired, because they touch by construction.
    """
    part = carriers(mechanism.arrays)
    # the rigid part that carries the joint of each one; -1 is the world, which has none (-2)
    beneath = np.append(part, -1)[mechanism.arrays.parent[part]]
    beneath[part < 0] = -2
    pairs = candidate_pairs(shapes)
    bodies = np.array([body for body, _, _ in _owned_shapes(scene)], np.int64)[pairs.T]
    tree_a, tree_b = mechanism.tree_of_body[bodies]
    part_a, part_b = part[bodies]
    beneath_a, beneath_b = beneath[bodies]
    adjoining = (part_a == part_b) | (beneath_a == part_b) | (beneath_b == part_a)
    apart = (bodies < 0).any(axis=0) | (tree_a != tree_b)
    links = ~apart & ~adjoining & scene.contact.self_collisions
    overlapping = _overlapping_at_start(scene, mechanism, shapes, pairs[links])
    left_out = pairs[links][overlapping]
    links[links] = ~overlapping
    return pairs[apart | links], left_out


def remarks_on(scene: Scene, left_out: Pairs) -> tuple[str, ...]:
    """Return the scene's remarks, and one that names the links of pairs left out."""
    if not len(left_out):
        return scene.remarks
    owners = shape_names(scene)
    named = sorted({f"{owners[a]} and {owners[b]}" for a, b in left_out})
    said = f"{', '.join(named)} overlap at the start: links of one tree, they never touch"
    return (*scene.remarks, said)


def _overlapping_at_start(
    scene: Scene, mechanism: Mechanism, shapes: Shapes, pairs: Pairs
) -> Booleans:
    """Return which of some pairs of shapes (k, 2) overlap in the pose of the start."""
    if not len(pairs):
        return np.zeros(0, np.bool_)
    placed = mechanism.placements(start_of(scene)[0])
    contacts = ContactFinder(shapes, pairs).find(*placed, -TOUCHING)
    found = set(zip(contacts.shape_a.tolist(), contacts.shape_b.tolist(), strict=True))
    return np.array([tuple(pair) in found for pair in pairs.tolist()])


def tree_masses(scene: Scene, mechanism: Mechanism) -> Floats:
    """Return the mass [kg] of each tree; of one without mass, its largest moment of inertia."""
    trees = len(mechanism.tree_dofs)
    found = np.bincount(mechanism.tree_of_body, mechanism.arrays.mass, minlength=trees)
    inertia = np.diagonal(mechanism.mass_matrix(start_of(scene)[0]))
    turned = [inertia[slice(*dofs)].max(initial=0.0) for dofs in mechanism.tree_dofs]
    return np.where(found > 0.0, found, turned)


def stops_of(scene: Scene, mechanism: Mechanism) -> Stops:
    """Return the limits of the joints as contacts of a joint's body and its parent, two for each
    joint with limits.

    The gap is arm · sign · (position − bound) [m]: the distance to the bound of a point on that
    arm; 1 m for a prismatic joint. The arm of a revolute joint is the radius of gyration, about its
    axis, of all bodies that it carries, in the pose of the start. The effective mass at the stop is
    then their whole mass, and stiffness and damping act as at a contact.
    """
    arrays = mechanism.arrays
    carried = arrays.mass.copy()
    for i, parent in reversed([*enumerate(arrays.parent.tolist())]):
        if parent >= 0:
            carried[parent] += carried[i]
    limits = [(i, own) for i, own in enumerate(limits_of(scene)) if own is not None]
    limited = np.array([i for i, _ in limits], np.int64)
    arms = np.ones(len(limited))
    inertia = np.diagonal(mechanism.mass_matrix(start_of(scene)[0])) if limits else np.zeros(0)
    for k, i in enumerate(limited.tolist()):
        turned = inertia[arrays.v_start[i]]
        if scene.bodies[i].joint == "revolute" and turned > 0.0 and carried[i] > 0.0:
            arms[k] = math.sqrt(turned / carried[i])
    body = np.repeat(limited, 2)
    return Stops(
        body,
        arrays.parent[body],
        len(_owned_shapes(scene)) + np.arange(len(body)),
        arrays.q_start[body],
        arrays.v_start[body],
        np.tile([1.0, -1.0], len(limited)),
        np.array([own for _, own in limits], np.float64).ravel(),
        np.repeat(arms, 2),
    )


class Surfaces(NamedTuple):
    """Restitution and friction by class of shape: tables (k, k) for two classes, and the class (n,)
    of each shape."""

    class_of_shape: Integers
    restitution: Floats
    friction: Floats

    def by_pair(self, pairs: Pairs) -> tuple[Floats, Floats]:
        """Return e and mu of each pair (k, 2) of shapes."""
        classes = tuple(self.class_of_shape[np.transpose(pairs)])
        return self.restitution[classes], self.friction[classes]


def surfaces_of(scene: Scene, stops: int) -> Surfaces:
    """Return e and mu of all pairs of shapes, in the order of `shapes_of`. The joints' stops follow,
    with the scene's e and mu = 0.

    Of two given values the smaller e counts, and the geometric mean of mu. If only one of the two
    gives a value, that value counts; if neither does, that of `contact`. So equal values are kept
    to the last bit, a soft body is soft against everything, and everything slides on a body with
    mu = 0.
    """
    contact = scene.contact
    given = [(owner.restitution, owner.friction) for _, owner, _ in _owned_shapes(scene)]
    given += [(contact.restitution, 0.0)] * stops
    classes = list(dict.fromkeys(given))
    restitution, friction = np.zeros((2, len(classes), len(classes)))
    for (i, (e, mu)), (k, (other_e, other_mu)) in itertools.product(enumerate(classes), repeat=2):
        restitution[i, k] = min(_given(contact.restitution, e, other_e))
        own = _given(contact.friction, mu, other_mu)
        friction[i, k] = own[0] if own[0] == own[-1] else math.sqrt(own[0] * own[-1])
    of_shape = np.array([classes.index(one) for one in given], np.int64)
    return Surfaces(of_shape, restitution, friction)


def _given(general: float, *values: float | None) -> list[float]:
    return [value for value in values if value is not None] or [general]
