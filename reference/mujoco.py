"""MuJoCo as a world: any scene, written as a MuJoCo model and simulated by MuJoCo's own step.

Bodies, joints, inertias, damping, limits and shapes are those of the scene. The model lists the
pairs of shapes that can touch, so that each pair has the friction and the restitution that the
scene gives it. Planar shapes become solid: circles become spheres, and boxes and polygons get a
thickness along z, in which nothing can move.

MuJoCo has no coefficient of restitution. Its contact is a spring and a damper per unit of effective
mass,

    x'' = −k x − b x',      solref = (−k, −b),      k = (π / (N Δt))²,      b = 2 ζ √k,

while it pushes. One rule gives k and b where e > 0. Half a period of the spring takes N =
`impact_steps` steps, and ζ is the damping ratio whose spring returns the share e of the speed
(`spring_restitution`). Where e = 0 the contact has the shortest time constant that MuJoCo accepts,
2 Δt, and is critically damped: solref = (2 Δt, 1). A spring that oscillates returns more than e⁻² =
0.135 of the speed. A smaller e > 0 becomes 0, and is named as ignored.

Source: T. Schwager and T. Pöschel, Coefficient of restitution and linear-dashpot model revisited,
Granular Matter 9, 2007.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cache, partial
from importlib.metadata import version
from typing import Any, NamedTuple

import numpy as np

from iapb.contact import geometry
from iapb.contact.geometry import Shapes
from iapb.engines import fields_of_our_engine, run_of_states
from iapb.errors import IapbError
from iapb.lazy import needed
from iapb.mechanics.bodies import Body
from iapb.mechanics.joints import KINDS, Mimic
from iapb.mechanics.rotations import frame_along
from iapb.run import INTERRUPTED, Run
from iapb.scene import Scene
from iapb.scene import mechanism as scene_parts
from iapb.system import System, system_of
from reference import Floats

HARD = (0.9999, 0.9999, 0.001, 0.5, 2.0)  # solimp: the largest impedance that MuJoCo accepts
LEAST_RESTITUTION = math.exp(-2.0)  # of a critically damped spring
LEAST = 1e-12  # [kg, kg m2] MuJoCo takes no moving body without mass and inertia
STEPS_BETWEEN_REPORTS = 512
UNSTABLE = ("mjWARN_BADQPOS", "mjWARN_BADQVEL", "mjWARN_BADQACC")
TURNING = ("spherical", "free_flyer")  # joints with a quaternion

_mujoco = cache(partial(needed, "mujoco", "The world mujoco"))


class JointPlace(NamedTuple):
    """Where a joint's coordinates and velocities begin, in a scene and in MuJoCo's model."""

    kind: str
    q: int
    v: int
    qpos: int
    qvel: int
    ratio: float = 0.0  # of a joint that follows another one
    offset: float = 0.0


@dataclass(frozen=True)
class MuJoCo:
    """The engine of the world ``mujoco``.

    Parameters
    ----------
    impact_steps : number of steps in half a period of a contact's spring, where e > 0
    substeps : steps of MuJoCo in each step of the scene
    """

    impact_steps: float = 8.0
    substeps: int = 1
    name = "MuJoCo"

    @property
    def settings(self) -> dict[str, Any]:
        """Version and settings."""
        return {
            "version": version("mujoco"),
            "integrator": "Euler",
            "cone": "elliptic",
            **asdict(self),
        }

    def ignored(self, scene: Scene) -> tuple[str, ...]:
        """Return the fields of the scene that the model lacks."""
        given = [body.joint_damping for body in scene.bodies if body.joint in TURNING]
        uneven = any(len({*damping[:3]}) > 1 or len({*damping[3:]}) > 1 for damping in given)
        values = system_of(scene).restitutions
        slight = bool(np.any((values > 0.0) & (values < LEAST_RESTITUTION)))
        return (
            *fields_of_our_engine(scene),
            *["contact.restitution"] * slight,
            *["bodies.joint_damping"] * uneven,
        )

    def run(
        self,
        scene: Scene,
        steps: int | None = None,
        progress: Callable[[int, int], None] | None = None,
    ) -> Run:
        """Simulate a scene. A simulation that MuJoCo calls unstable, or that is interrupted, ends
        there."""
        mujoco = _mujoco()
        model = self.model(scene)
        places = joint_places(scene, model)
        data = mujoco.MjData(model)
        set_state(places, data, *scene_parts.start_of(scene))
        total = scene.steps if steps is None else steps
        qpos = np.empty((total + 1, model.nq))
        qvel = np.empty((total + 1, model.nv))
        qpos[0] = data.qpos
        qvel[0] = data.qvel
        warnings = [getattr(mujoco.mjtWarning, name) for name in UNSTABLE]
        done = 0
        stopped = ""
        started = time.perf_counter()
        try:
            while done < total:
                self.step(scene, model, data, (done + 0.5) * scene.step)
                if any(data.warning[name].number for name in warnings):
                    stopped = f"MuJoCo warns of an unstable simulation at {data.time:g} s"
                    break
                done += 1
                qpos[done] = data.qpos
                qvel[done] = data.qvel
                if progress is not None and (done % STEPS_BETWEEN_REPORTS == 0 or done == total):
                    progress(done, total)
        except KeyboardInterrupt:
            if done == 0:
                raise
            stopped = INTERRUPTED
        if done == 0:
            raise IapbError(stopped)
        seconds = time.perf_counter() - started
        q, v = states_of(places, qpos[: done + 1], qvel[: done + 1])
        return run_of_states(scene, self, q, v, stopped=stopped, seconds=seconds)

    def step(self, scene: Scene, model: Any, data: Any, middle: float) -> None:
        """Do one step of the scene under the hand's force at the middle of the step [s]."""
        mujoco = _mujoco()
        if scene.hand is None:
            mujoco.mj_step(model, data, self.substeps)
            return
        wrench = scene_parts.wrench_of(scene, middle)
        body = model.body(scene.hand.body).id
        for _ in range(self.substeps):
            mujoco.mj_step1(model, data)
            lever = np.array([*scene.hand.point, 0.0])[:3]
            point = data.xpos[body] + data.xmat[body].reshape(3, 3) @ lever
            data.qfrc_applied[:] = 0.0
            mujoco.mj_applyFT(model, data, wrench[:3], wrench[3:], point, body, data.qfrc_applied)
            mujoco.mj_step2(model, data)

    def model(self, scene: Scene) -> Any:
        """Return the scene as a compiled model."""
        mujoco = _mujoco()
        spec = mujoco.MjSpec()
        spec.compiler.degree = False  # limits of hinges are in radians
        spec.compiler.boundmass = spec.compiler.boundinertia = LEAST
        spec.option.timestep = scene.step / self.substeps
        spec.option.gravity = scene_parts.gravity_of(scene)
        spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_AUTORESET
        flat = len(scene.bodies[0].origin) == 2
        made: dict[str | None, Any] = {None: spec.worldbody}
        for body, given in zip(system_of(scene).mechanism.bodies, scene.bodies, strict=True):
            made[body.name] = _add_body(made[body.parent], body, flat)
            if given.joint_limits is not None:
                self._limit(made[body.name].joints[0], given.joint_limits, scene)
            if given.joint_mimic is not None:
                _follow(spec, made, body)
        system = system_of(scene)
        shapes = system.shapes
        for i, owner in enumerate(shapes.body):
            carrier = spec.worldbody if owner < 0 else made[scene.bodies[owner].name]
            _add_geom(spec, carrier, shapes, i)
        self._add_pairs(spec, system)
        model = spec.compile()
        for place, given in zip(joint_places(scene, model), scene.bodies, strict=True):
            damping = given.joint_damping
            model.dof_damping[place.qvel : place.qvel + len(damping)] = damping
            friction = given.joint_friction
            model.dof_frictionloss[place.qvel : place.qvel + len(friction)] = friction
        return model

    def solref(self, restitution: float, step: float) -> tuple[float, float]:
        """Return MuJoCo's two numbers of a contact with this restitution."""
        if restitution < LEAST_RESTITUTION:
            return 2.0 * step, 1.0
        frequency = math.pi / (self.impact_steps * step)
        return -(frequency**2), -2.0 * damping_ratio_of(restitution) * frequency

    def _limit(self, joint: Any, limits: tuple[float, float], scene: Scene) -> None:
        joint.limited = True
        joint.range = limits
        joint.solref_limit = self.solref(scene.contact.restitution, scene.step / self.substeps)
        joint.solimp_limit = HARD

    def _add_pairs(self, spec: Any, system: System) -> None:
        """List the pairs of shapes that can touch, each with its friction and restitution."""
        scene = system.scene
        pairs = system.pairs
        restitutions, frictions = system.surfaces.by_pair(pairs)
        for (a, b), friction, restitution in zip(pairs, frictions, restitutions, strict=True):
            spec.add_pair(
                geomname1=f"shape {a}",
                geomname2=f"shape {b}",
                condim=3 if friction > 0.0 else 1,
                friction=[friction, friction, 0.0, 0.0, 0.0],
                solref=self.solref(restitution, scene.step / self.substeps),
                solimp=HARD,
            )


def spring_restitution(damping_ratio: float) -> float:
    """Return e of a spring and damper that push only; damping_ratio = b / (2 √k) in [0, 1)."""
    turning = math.sqrt(1.0 - damping_ratio**2)
    phase = math.pi - math.atan2(2.0 * damping_ratio * turning, 1.0 - 2.0 * damping_ratio**2)
    return math.exp(-damping_ratio / turning * phase)


def damping_ratio_of(restitution: float) -> float:
    """Return the damping ratio whose spring has this restitution, between LEAST_RESTITUTION and
    1."""
    low = 0.0
    high = 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if spring_restitution(middle) > restitution:
            low = middle
        else:
            high = middle
    return low


# The model


def _rotation(quaternions: Floats) -> Any:
    """Return the rotations of quaternions (..., 4) in the order x, y, z, w."""
    return needed("scipy.spatial.transform", "A reference").Rotation.from_quat(quaternions)


def _quaternion(rotation: Floats) -> Floats:
    """Return MuJoCo's quaternion w, x, y, z of a rotation matrix."""
    quaternion = np.empty(4)
    _mujoco().mju_mat2Quat(quaternion, np.ascontiguousarray(rotation).ravel())
    return quaternion


def _add_body(parent: Any, body: Body, flat: bool) -> Any:
    """Add a body with its joint and inertia.

    Moments of inertia about x and y do not matter in the plane; those of a ball are valid whatever
    the third is.
    """
    rotation, position = body.placement
    made = parent.add_body(name=body.name, pos=position, quat=_quaternion(rotation))
    joint = _mujoco().mjtJoint
    slide = joint.mjJNT_SLIDE
    hinge = joint.mjJNT_HINGE
    ball = joint.mjJNT_BALL
    x, y, z = np.eye(3)
    along = body.joint.unit_axis
    for kind, axis in {
        "fixed": (),
        "revolute": ((hinge, along),),
        "continuous": ((hinge, along),),
        "prismatic": ((slide, along),),
        "planar": ((slide, x), (slide, y), (hinge, z)),
        "spherical": ((ball, z),),
        "free_flyer": ((slide, x), (slide, y), (slide, z), (ball, z)),
    }[body.joint.kind]:
        made.add_joint(type=kind, axis=axis)
    moments, axes = np.linalg.eigh(body.inertia)
    if flat:
        moments = np.full(3, body.inertia[2, 2])
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] = -axes[:, 0]
    made.explicitinertial = True
    made.mass = body.mass
    made.ipos = body.center_of_mass
    made.inertia = np.maximum(moments, 0.0)
    made.iquat = _quaternion(np.eye(3) if flat else axes)
    return made


def _follow(spec: Any, made: dict[str | None, Any], body: Body) -> None:
    """Let a joint follow another one; it starts where the other one says."""
    mimic = body.mimic or Mimic("")
    follower = made[body.name].joints[0]
    leader = made[mimic.body].joints[0]
    follower.name = f"{body.name} joint"
    leader.name = f"{mimic.body} joint"
    spec.add_equality(
        type=_mujoco().mjtEq.mjEQ_JOINT,
        name1=follower.name,
        name2=leader.name,
        data=[mimic.offset, mimic.multiplier, *[0.0] * 10],
        solref=[2.0 * spec.option.timestep, 1.0],
        solimp=HARD,
    )


def _add_geom(spec: Any, carrier: Any, shapes: Shapes, i: int) -> None:
    """Add shape number i to a body of the model; only the listed pairs touch."""
    kinds = _mujoco().mjtGeom
    kind = shapes.kind[i]
    radius = shapes.radius[i]
    corners = shapes.vertices[shapes.first[i] : shapes.first[i] + shapes.count[i]]
    common: dict[str, Any] = {
        "name": f"shape {i}",
        "contype": 0,
        "conaffinity": 0,
        "pos": shapes.center[i],
    }
    if kind in (geometry.CIRCLE, geometry.SPHERE):
        carrier.add_geom(**common, type=kinds.mjGEOM_SPHERE, size=[radius, 0.0, 0.0])
    elif kind in geometry.ENDLESS:
        if kind == geometry.HALF_PLANE:
            common["pos"] = [*corners[0], 0.0]
            axes = frame_along(np.array([*corners[1], 0.0]))
        else:
            axes = shapes.axes[i]
        carrier.add_geom(
            **common, type=kinds.mjGEOM_PLANE, size=[0.0, 0.0, 1.0], quat=_quaternion(axes)
        )
    elif kind == geometry.BOX:
        axes = shapes.axes[i]
        carrier.add_geom(
            **common, type=kinds.mjGEOM_BOX, size=shapes.half_size[i], quat=_quaternion(axes)
        )
    else:
        _add_polygon(spec, carrier, corners, common)


def _add_polygon(spec: Any, carrier: Any, corners: Floats, common: dict[str, Any]) -> None:
    """Add a planar polygon with a thickness along z; a rectangle becomes a box, which MuJoCo's
    contacts like best."""
    kinds = _mujoco().mjtGeom
    middle = corners.mean(axis=0)
    thick = 0.5 * float(np.linalg.norm(corners - middle, axis=1).max())
    edges = np.roll(corners, -1, axis=0) - corners
    length = np.linalg.norm(edges[0])
    width = np.linalg.norm(edges[1])
    opposite = len(corners) == 4 and np.allclose(edges[0], -edges[2], rtol=0.0, atol=1e-12 * length)
    if opposite and abs(edges[0] @ edges[1]) <= 1e-12 * length * width:
        axes = np.eye(3)
        axes[:2, 0] = edges[0] / length
        axes[:2, 1] = edges[1] / width
        common |= {"pos": [*middle, 0.0], "quat": _quaternion(axes)}
        carrier.add_geom(**common, type=kinds.mjGEOM_BOX, size=[0.5 * length, 0.5 * width, thick])
        return
    vertices = [[*corner, height] for corner in corners for height in (-thick, thick)]
    spec.add_mesh(name=common["name"], uservert=np.ravel(vertices))
    carrier.add_geom(**common, type=kinds.mjGEOM_MESH, meshname=common["name"])


# States. MuJoCo's quaternions are w, x, y, z, a continuous joint has one angle, and a free flyer's
# velocity is in the axes of its joint.


def joint_places(scene: Scene, model: Any) -> list[JointPlace]:
    """Return the places of the joint of each body."""
    arrays = scene_parts.mechanism_of(scene).arrays
    found = []
    for body, q, v in zip(scene.bodies, arrays.q_start, arrays.v_start, strict=True):
        joint = int(model.body(body.name).jntadr[0])
        qpos, qvel = (model.jnt_qposadr[joint], model.jnt_dofadr[joint]) if joint >= 0 else (0, 0)
        place = JointPlace(body.joint, int(q), int(v), int(qpos), int(qvel))
        if body.joint_mimic is not None:
            place = place._replace(
                kind="follows",
                v=int(arrays.dof_leader[v]),
                ratio=body.joint_mimic.multiplier,
                offset=body.joint_mimic.offset,
            )
        found.append(place)
    return found


def set_state(places: list[JointPlace], data: Any, q: Floats, v: Floats) -> None:
    """Write a configuration and a velocity of the scene into MuJoCo's state."""
    for place in places:
        if place.kind == "follows":
            data.qpos[place.qpos] = place.ratio * q[place.q] + place.offset
            data.qvel[place.qvel] = place.ratio * v[place.v]
            continue
        kind = KINDS[place.kind]
        coordinates = q[place.q : place.q + kind.nq]
        velocities = v[place.v : place.v + kind.nv]
        if place.kind == "continuous":
            cosine, sine = coordinates
            coordinates = np.array([math.atan2(sine, cosine)])
        elif place.kind in TURNING:
            turn = coordinates[-4:]
            if place.kind == "free_flyer":
                linear = _rotation(turn).apply(velocities[:3])
                velocities = np.concatenate([linear, velocities[3:]])
            coordinates = np.concatenate([coordinates[:-4], turn[3:], turn[:3]])
        data.qpos[place.qpos : place.qpos + len(coordinates)] = coordinates
        data.qvel[place.qvel : place.qvel + len(velocities)] = velocities


def states_of(places: list[JointPlace], qpos: Floats, qvel: Floats) -> tuple[Floats, Floats]:
    """Return configurations (n, nq) and velocities (n, d) of the scene from MuJoCo's (n, ...)."""
    q = [np.zeros((len(qpos), 0))]
    v = []
    for place in places:
        if place.kind == "follows":
            continue
        kind = KINDS[place.kind]
        velocities = qvel[:, place.qvel : place.qvel + kind.nv]
        if place.kind == "continuous":
            angle = qpos[:, place.qpos]
            q.append(np.column_stack([np.cos(angle), np.sin(angle)]))
        elif place.kind in TURNING:
            coordinates = qpos[:, place.qpos : place.qpos + kind.nq]
            turn = np.roll(coordinates[:, -4:], -1, axis=1)
            q.append(np.hstack([coordinates[:, :-4], turn]))
            if place.kind == "free_flyer":
                linear = _rotation(turn).inv().apply(velocities[:, :3])
                velocities = np.hstack([linear, velocities[:, 3:]])
        else:
            q.append(qpos[:, place.qpos : place.qpos + kind.nq])
        v.append(velocities)
    return np.hstack(q), np.hstack(v)
