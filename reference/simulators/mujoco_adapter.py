"""MuJoCo: soft contacts with a reference acceleration, without a coefficient of restitution."""

from __future__ import annotations

from math import pi
from types import ModuleType
from typing import Any

import numpy as np

from iapb.errors import IapbError, MissingDependencyError
from reference.simulators.scene import Cuboid, FixedScene, RigidBody, Sphere, rotation
from reference.simulators.simulator import Settings, damping_for
from reference.simulators.trajectory import Recorder, Trajectory, steps_between_samples

NO_RESTITUTION = "no coefficient e: a spring and damper per contact, stiff enough to part impacts, stand in for it"
OWN_STEP, STACK_STEP, DEFAULT_STEP = 1e-5, 2e-5, 2e-3  # [s] for bouncing, for the stack, and the engine's default
# A spring's half period in steps. With fewer, the step adds or removes energy; with more, impacts overlap in time.
OWN_STEPS_OF_AN_IMPACT = 100.0
GIVEN_STEPS_OF_AN_IMPACT = 8.0  # the best of 3, 5, 8, 12 and 20 at 1 ms, over the impact scenes
HARD = "0.9999 0.9999 0.001 0.5 2"  # solimp: the largest impedance that MuJoCo accepts
MANY_TIMES_HEAVIER = 1e3  # mass ratio from which the default impedance is too small to carry the load


class MuJoCo:
    """Adapter to MuJoCo's compiled loop."""

    title = "MuJoCo"

    def version(self) -> str:
        """Return the installed version."""
        return str(_mujoco().__version__)

    def settings(self, scene: FixedScene, step: float | None = None) -> Settings:
        """Return defaults at rest, hard contacts for the stack, and for impacts a negative solref with damping."""
        common: dict[str, str | float] = {"condim": 1.0, "integrator": "Euler", "tolerance": 1e-12}
        if scene.rests and np.ptp(scene.masses) < MANY_TIMES_HEAVIER * scene.masses.min():
            return Settings(step or DEFAULT_STEP, {**common, "solref": "0.02 1", "solimp": "0.9 0.95 0.001 0.5 2"})
        if scene.rests:
            chosen = step or STACK_STEP
            return Settings(chosen, {**common, "solref": f"{2.0 * chosen:g} 1", "solimp": HARD})
        chosen, steps = (step, GIVEN_STEPS_OF_AN_IMPACT) if step else (OWN_STEP, OWN_STEPS_OF_AN_IMPACT)
        stiffness = (pi / (steps * chosen)) ** 2
        damping = damping_for(scene.restitution, stiffness)
        hard = {"solref": f"{-stiffness:.10g} {-damping:.10g}", "solimp": HARD}
        return Settings(chosen, {**common, **hard}, NO_RESTITUTION)

    def run(self, scene: FixedScene, settings: Settings, step: float, duration: float) -> Trajectory:
        """Simulate with `mj_step(model, data, nstep)`."""
        mujoco = _mujoco()
        model = mujoco.MjModel.from_xml_string(_model_text(scene, settings, step))
        state = mujoco.MjData(model)
        _start(scene, state)
        record, stride = Recorder(), steps_between_samples(step)
        for _ in range(round(duration / step) // stride):
            _keep(record, state)
            mujoco.mj_step(model, state, stride)
            if state.warning[mujoco.mjtWarning.mjWARN_BADQACC].number:
                raise IapbError(f"MuJoCo warns of an unstable simulation at {state.time:g} s")
        _keep(record, state)
        return record.trajectory()


def _mujoco() -> ModuleType:
    try:
        import mujoco
    except ImportError as error:
        raise MissingDependencyError("mujoco", "The MuJoCo adapter", "pip install 'iapb[peers]'") from error
    module: ModuleType = mujoco
    return module


def _start(scene: FixedScene, state: Any) -> None:
    """Set free joints: position and w, x, y, z; linear velocity in world axes, angular velocity in body axes."""
    for k, body in enumerate(scene.bodies):
        x, y, z, w = body.orientation
        state.qpos[7 * k : 7 * k + 7] = [*body.position, w, x, y, z]
        state.qvel[6 * k : 6 * k + 3] = body.velocity
        state.qvel[6 * k + 3 : 6 * k + 6] = rotation(body.orientation).T @ np.array(body.spin)


def _keep(record: Recorder, state: Any) -> None:
    places, speeds = state.qpos.reshape(-1, 7), state.qvel.reshape(-1, 6)
    turns = places[:, [4, 5, 6, 3]]
    spin = np.einsum("bij,bj->bi", rotation(turns), speeds[:, 3:])
    record.add(state.time, places[:, :3], turns, speeds[:, :3], spin, int(state.ncon))


def _model_text(scene: FixedScene, settings: Settings, step: float) -> str:
    """Return the scene as MJCF."""
    given = settings.options
    contact = f'condim="{given["condim"]:g}" solref="{given["solref"]}" solimp="{given["solimp"]}"'
    walls = "".join(
        f'<geom name="{wall.name}" type="box" size="{_half(wall.size)}" pos="{_text(wall.center)}" '
        f'quat="{_text((wall.orientation[3], *wall.orientation[:3]))}"/>' for wall in scene.obstacles
    )  # fmt: skip
    return (
        f'<mujoco><option timestep="{step!r}" integrator="{given["integrator"]}" gravity="{_text(scene.gravity)}" '
        f'tolerance="{given["tolerance"]!r}" iterations="200"/>'
        f"<default><geom {contact}/></default>"
        f"<worldbody>{walls}{''.join(_body_text(body) for body in scene.bodies)}</worldbody></mujoco>"
    )


def _body_text(body: RigidBody) -> str:
    return (
        f'<body name="{body.name}"><freejoint/>'
        f'<inertial pos="0 0 0" mass="{body.mass!r}" diaginertia="{_text(body.inertia)}"/>'
        + "".join(_geom_text(shape) for shape in body.shapes) + "</body>"
    )  # fmt: skip


def _geom_text(shape: Sphere | Cuboid) -> str:
    if isinstance(shape, Sphere):
        return f'<geom type="sphere" size="{shape.radius!r}" pos="{_text(shape.center)}"/>'
    return f'<geom type="box" size="{_half(shape.size)}" pos="{_text(shape.center)}"/>'


def _half(size: tuple[float, ...]) -> str:
    return _text(tuple(0.5 * length for length in size))


def _text(numbers: tuple[float, ...]) -> str:
    return " ".join(repr(float(number)) for number in numbers)
