"""The table of ordinary scenes: error, energy made and status in every world and in MuJoCo.

    python -m tests.ordinary.table [names...] [--worlds IAPB,PB,...]

Every error is divided by the tolerance of its scene, so that 1 is the largest that counts as right. MuJoCo runs with
its defaults at the same step: Euler, default solref and solimp, condim 3 with the scene's friction, else 1. Planar
bodies become boxes, spheres and prisms on two slides and a hinge.
"""

from __future__ import annotations

import argparse
import math
from collections import Counter
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from iapb.errors import IapbError
from iapb.run import Run
from iapb.scene import Scene
from iapb.scene.model import scene_kind
from reference.worlds import run_world
from tests.ordinary.scenes import CASES, Case, Floats, Motion

WORLDS = ("IAPB", "IAPB-friction", "PB", "ideal", "ideal-friction", "MuJoCo")
SLOW = ("ideal", "ideal-friction")  # they are timed for a few steps first
LONGEST = 100.0  # [s] of one case in one world


class Outcome(NamedTuple):
    """A case in one world: error by scale, energy made by the scene's energy, status, and why that is not 0."""

    error: float
    made: float
    status: int = 0  # 3: not to be trusted, or stopped
    why: str = ""
    kind: str = ""  # "ignores": the law says that it ignores what the scene names; "unrun": it would take too long

    def verdict(self, case: Case) -> str:
        """Return right, flagged (wrong with status 3), wrong (with status 0), ignores or unrun."""
        if self.error <= case.tolerance and self.status == 0:
            return "right"
        return self.kind or ("flagged" if self.status else "wrong")


def outcome_of(case: Case, world: str, longest: float = LONGEST) -> Outcome:
    """Run a case in a world, or in MuJoCo; a slow world leaves out what would take longer than `longest` [s]."""
    checked = scene_kind(case.scene).model_validate(case.scene)
    if world == "MuJoCo":
        return run_mujoco(case, checked)
    try:
        if world in SLOW:
            first = run_world(checked, world, partial=True, steps=10)
            if first.chunk_seconds.sum() * checked.steps / 10 > longest:
                return Outcome(math.nan, math.nan, kind="unrun")
        run = run_world(checked, world, partial=True)
    except IapbError as refused:
        return Outcome(math.inf, 0.0, 3, str(refused).splitlines()[0])
    motion, energy = motion_of(run), run.energy
    whole = energy["kinetic"] + energy["potential"]
    made = np.max(whole[1:] - whole[0] - energy["hand_work"] - energy["coupling_work"], initial=0.0)
    why = run.stopped if not run.complete else "; ".join(run.distrust)
    error = case.error(motion) if run.complete else math.inf
    ignored = {field for row in run.effects for field in row.ignores.split(", ")} & set(case.scene.get("contact", ()))
    return Outcome(error, float(made) / energy_scale(checked), 3 if why else 0, why, "ignores" if ignored else "")


def motion_of(run: Run) -> Motion:
    """Return the motion of a run."""
    pose = run.pose
    count, bodies = pose.shape[:2]
    place, turn = np.zeros((count, bodies, 3)), np.zeros((count, bodies, 3, 3))
    if pose.shape[2] == 3:
        c, s = np.cos(pose[..., 2]), np.sin(pose[..., 2])
        place[..., :2], turn[..., 2, 2] = pose[..., :2], 1.0
        turn[..., 0, 0], turn[..., 0, 1], turn[..., 1, 0], turn[..., 1, 1] = c, -s, s, c
    else:
        place, turn = pose[..., :3], Rotation.from_quat(pose[..., 3:].reshape(-1, 4)).as_matrix().reshape(turn.shape)
    free = pose.shape[2] == 7 and run.v.shape[1] >= 6 and run.velocity_names[3].endswith("rx")
    spin = np.einsum("nij,nj->ni", turn[:, 0], run.v[:, 3:6]) if free else np.zeros((count, 3))
    return Motion(run.time, place, turn, spin)


def energy_scale(scene: Scene) -> float:
    """Return the energy [J] of the start, of lifting each body by its size, and of the hand's force over 0.1 m."""
    from iapb.scene.mechanism import mechanism_of, start_of

    q, v = start_of(scene)
    moving = 0.5 * float(v @ mechanism_of(scene).mass_matrix(q) @ v)
    weight = float(np.linalg.norm(scene.gravity or [0.0]))
    lifted = sum(weight * body.mass * max(map(_size, body.shapes), default=0.1) for body in scene.bodies)
    return moving + lifted + 0.1 * (float(np.linalg.norm(scene.hand.force[:2])) if scene.hand else 0.0)


def _size(shape: Any) -> float:
    if shape.kind == "polygon":
        return float(np.ptp(np.array(shape.vertices), axis=0).max())
    return float(max(shape.size) if shape.kind == "box" else 2 * shape.radius)


# MuJoCo


def run_mujoco(case: Case, scene: Scene) -> Outcome:
    """Run a case in MuJoCo."""
    import mujoco

    mujoco.set_mju_user_warning(lambda _: None)  # it would write a file
    model = mujoco.MjModel.from_xml_string(mjcf(scene))
    state = mujoco.MjData(model)
    _start(scene, state)
    count, bodies = scene.steps, len(scene.bodies)
    place, turn, spin = np.zeros((count + 1, bodies, 3)), np.zeros((count + 1, bodies, 3, 3)), np.zeros((count + 1, 3))
    energy, worked = np.zeros(count + 1), 0.0
    held = [body.name for body in scene.bodies].index(scene.hand.body) + 1 if scene.hand else 0
    point = _push(scene, model, state, held) if held else None
    free = scene.bodies[0].joint == "free_flyer"
    for k in range(count + 1):
        if held:
            before, point = point, _push(scene, model, state, held)
            worked += float(np.dot(state.xfrc_applied[held, :3], point - before))
        now = state.qvel[3:6].copy() if free else np.zeros(3)
        mujoco.mj_step(model, state)  # its places and energies are those at the start of the step
        place[k], turn[k] = state.xpos[1:], state.xmat[1:].reshape(-1, 3, 3)
        energy[k], spin[k] = state.energy.sum() - worked, turn[k, 0] @ now
        if any(warning.number for warning in state.warning):
            return Outcome(math.inf, math.inf, 3, "MuJoCo warns of an unstable simulation")
    motion = Motion(np.arange(count + 1) * 1e-3, place, turn, spin)
    return Outcome(case.error(motion), max(0.0, float((energy - energy[0]).max())) / energy_scale(scene), 0)


def _start(scene: Scene, state: Any) -> None:
    """Set positions and velocities; those of free bodies have w first and linear velocity in world axes."""
    q, v = [], []
    for body in scene.bodies:
        at, speed = list(body.position), list(body.velocity)
        if body.joint in ("spherical", "free_flyer"):
            turn = Rotation.from_quat(at[-4:]).as_matrix()
            at[-4:] = [at[-1], *at[-4:-1]]
            speed = [*(turn @ speed[:3]), *speed[3:]] if len(speed) == 6 else speed
        q += at
        v += speed
    state.qpos[:], state.qvel[:] = q, v


def _push(scene: Scene, model: Any, state: Any, held: int) -> Floats:
    """Apply the hand's force, without torque, at its point, and return the point."""
    import mujoco

    mujoco.mj_kinematics(model, state)
    mujoco.mj_comPos(model, state)
    force = np.array([*scene.hand.force[:2], 0.0])
    point = state.xpos[held] + state.xmat[held].reshape(3, 3) @ np.array([*scene.hand.point, 0.0][:3])
    state.xfrc_applied[held] = [*force, *np.cross(point - state.xipos[held], force)]
    return point


JOINTS = {
    "planar": '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><joint type="hinge" axis="0 0 1"/>',
    "free_flyer": "<freejoint/>", "spherical": '<joint type="ball"/>', "fixed": "",
}  # fmt: skip


def mjcf(scene: Scene) -> str:
    """Return the scene for MuJoCo: boxes, spheres, prisms, planes; each body's frame is where ours is."""
    friction = scene.contact.friction
    geometry = f'condim="3" friction="{friction} 0 0"' if friction else 'condim="1"'
    meshes: list[str] = []
    depth = max((_size(shape) for body in scene.bodies for shape in body.shapes), default=0.1)
    inside: dict[str, list[Any]] = {}
    for body in scene.bodies:
        inside.setdefault(body.parent, []).append(body)

    def bodies(parent: str) -> str:
        return "".join(_body(body, depth, meshes) + bodies(body.name) + "</body>" for body in inside.get(parent, []))

    world = "".join(_geom(wall, depth, meshes) for wall in scene.walls) + bodies("world")
    return (f'<mujoco><compiler angle="radian"/><option timestep="0.001" gravity="{_text(scene.gravity or (0, 0))}">'
            f'<flag energy="enable"/></option><default><geom {geometry}/></default>'
            f'<asset>{"".join(meshes)}</asset><worldbody>{world}</worldbody></mujoco>')  # fmt: skip


def _text(numbers: Any, size: int = 3) -> str:
    """Return numbers as MuJoCo reads them, filled up with zeros."""
    return " ".join(repr(float(x)) for x in [*numbers, *[0.0] * size][:size])


def _body(body: Any, depth: float, meshes: list[str]) -> str:
    """Return a body without its end tag."""
    kind = {"revolute": "hinge", "prismatic": "slide"}.get(body.joint)
    joint = f'<joint type="{kind}" axis="{_text(body.axis or (0, 0, 1))}"/>' if kind else JOINTS[body.joint]
    inertia = np.broadcast_to(body.inertia or 1e-9, 3)
    return (f'<body name="{body.name}" pos="{_text(body.origin)}">{joint}<inertial pos="{_text(body.center_of_mass)}" '
            f'mass="{body.mass!r}" diaginertia="{_text(inertia)}"/>'
            + "".join(_geom(shape, depth, meshes) for shape in body.shapes))  # fmt: skip


def _geom(shape: Any, depth: float, meshes: list[str]) -> str:
    """Return a shape or wall; a planar one gets a depth along z, a disc becomes a ball."""
    if shape.kind in ("half_plane", "half_space"):
        return f'<geom type="plane" size="9 9 9" pos="{_text(shape.point)}" zaxis="{_text(shape.normal)}"/>'
    pos = f'pos="{_text(shape.center)}"'
    if shape.kind in ("circle", "sphere"):
        return f'<geom type="sphere" size="{shape.radius}" {pos}/>'
    if shape.kind == "box":
        angles = getattr(shape, "rpy", (0.0, 0.0, getattr(shape, "angle", 0.0)))
        half = [x / 2 for x in [*shape.size, depth][:3]]
        return f'<geom type="box" size="{_text(half)}" {pos} euler="{_text(angles)}"/>'
    corners = " ".join(_text((*corner, side)) for corner in shape.vertices for side in (-depth / 2, depth / 2))
    meshes.append(f'<mesh name="m{len(meshes)}" vertex="{corners}"/>')
    return f'<geom type="mesh" mesh="m{len(meshes) - 1}" {pos}/>'


# The table


def table(names: list[str], worlds: list[str], longest: float) -> None:
    """Run the cases, and print errors and verdicts, energy made, the verdicts of each world, and why runs stopped."""
    found: dict[str, dict[str, Outcome]] = {}
    print(f"{'error / tolerance':26s} {'tolerance':>9s}" + "".join(f"{world:>18s}" for world in worlds))
    for name in names:
        case = CASES[name]
        found[name] = {world: outcome_of(case, world, longest) for world in worlds}
        cells = "".join(f"{one.error / case.tolerance:10.2g} {one.verdict(case):>7s}" for one in found[name].values())
        print(f"{name:26s} {case.tolerance:9.3g}{cells}", flush=True)
    print(f"\n{'energy made / energy':36s}" + "".join(f"{world:>15s}" for world in worlds))
    for name, row in found.items():
        print(f"{name:36s}" + "".join(f"{each.made:15.1e}" for each in row.values()))
    for world in worlds:
        counts = Counter(row[world].verdict(CASES[name]) for name, row in found.items())
        print(f"{world:15s} of {len(found)}: " + ", ".join(f"{count} {verdict}" for verdict, count in counts.items()))
    whys = ((name, world, each.why) for name, row in found.items() for world, each in row.items() if each.why)
    print("".join(f"\n{name}, {world}: {why}" for name, world, why in whys))


def main() -> None:
    """Run the table as a command."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("names", nargs="*", help="cases; default: all")
    parser.add_argument("--worlds", default=",".join(WORLDS))
    parser.add_argument("--longest", type=float, default=LONGEST, help="seconds of one case in the ideal worlds")
    given = parser.parse_args()
    table(given.names or [*CASES], given.worlds.split(","), given.longest)


if __name__ == "__main__":
    main()
