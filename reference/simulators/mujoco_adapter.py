"""MuJoCo: soft contacts with a reference acceleration, without a coefficient of restitution."""

from __future__ import annotations

from math import pi

import numpy as np

from iapb.errors import IapbError
from reference.simulators.scene import UPRIGHT, Cuboid, FixedScene, Quaternion, Sphere, rotation
from reference.simulators.simulator import Settings, Simulator, damping_for
from reference.simulators.trajectory import Samples, Trajectory, steps_between_samples

NO_RESTITUTION = "no e; a spring and damper replace it, so stiff that one impact ends before the next begins"
OWN_STEP, STACK_STEP, DEFAULT_STEP = 1e-5, 2e-5, 2e-3  # [s] for bouncing, for the stack, and the engine's default
# A spring's half period in steps. With fewer, the step adds or removes energy; with more, impacts overlap in time.
OWN_STEPS_OF_AN_IMPACT = 100.0
# At 1 ms, by scene: the integrator and half period with the smallest error, of Euler and RK4 times 3 to 20 whole steps.
GIVEN_IMPACTS = {"elastic_cradle": ("RK4", 8.0), "bernoulli": ("RK4", 5.0), "two_balls_and_a_wall": ("RK4", 10.0),
                 "redundant_wedge": ("RK4", 20.0)}  # fmt: skip
GIVEN_DROPPED = "Euler", 6.0
HARD = "0.9999 0.9999 0.001 0.5 2"  # solimp: the largest impedance that MuJoCo accepts
SOFT = "0.9 0.95 0.001 0.5 2"  # solimp: the default
# solref and solimp at rest: what moves least, of time constants of 2 steps, 5, 10, 20 and 50 ms times damping ratios of
# 1, 2, 5, 10 and 20, with each solimp. A heavy stack at 1 ms needs the second, at 20 µs the first.
AT_REST, LOADED_AT_GIVEN_STEP = ("{:g} 1", HARD), ("0.005 10", SOFT)
MANY_TIMES_HEAVIER = 1e3  # mass ratio of a heavy stack


class MuJoCo(Simulator):
    """Adapter to MuJoCo's compiled loop."""

    title, module, package = "MuJoCo", "mujoco", "mujoco"

    def settings(self, scene: FixedScene, step: float | None = None) -> Settings:
        """Return what moves least at rest, and for impacts a negative solref with damping."""
        common: dict[str, str | float] = {"condim": 1.0, "integrator": "Euler", "tolerance": 1e-12}
        if scene.rests:
            loaded = np.ptp(scene.masses) >= MANY_TIMES_HEAVIER * scene.masses.min()
            chosen = step or (STACK_STEP if loaded else DEFAULT_STEP)
            solref, solimp = LOADED_AT_GIVEN_STEP if loaded and step else AT_REST
            note = "at 1 ms the stack stands with no setting of the grid; with this one it moves least"
            return Settings(chosen, {**common, "solref": solref.format(2.0 * chosen), "solimp": solimp},
                            note if loaded and step else "")
        chosen, integrator, steps = OWN_STEP, "Euler", OWN_STEPS_OF_AN_IMPACT
        if step:
            chosen, (integrator, steps) = step, GIVEN_IMPACTS.get(scene.name, GIVEN_DROPPED)
        stiffness = (pi / (steps * chosen)) ** 2
        damping = damping_for(scene.restitution, stiffness)
        hard = {"solref": f"{-stiffness:.10g} {-damping:.10g}", "solimp": HARD}
        return Settings(chosen, {**common, "integrator": integrator, **hard}, NO_RESTITUTION)

    def run(self, scene: FixedScene, settings: Settings, step: float, duration: float) -> Trajectory:
        """Simulate with `mj_step(model, data, nstep)`."""
        mujoco = self.engine()
        model = mujoco.MjModel.from_xml_string(_model_text(scene, settings, step))
        state = mujoco.MjData(model)
        # free joints: position and w, x, y, z; linear velocity in world axes, angular velocity in body axes
        for k, body in enumerate(scene.bodies):
            state.qpos[7 * k : 7 * k + 7] = [*body.position, body.orientation[3], *body.orientation[:3]]
            state.qvel[6 * k : 6 * k + 3] = body.velocity
            state.qvel[6 * k + 3 : 6 * k + 6] = rotation(body.orientation).T @ np.array(body.spin)
        record, stride = Samples(), steps_between_samples(step)
        for k in range(round(duration / step) // stride + 1):
            if k:
                mujoco.mj_step(model, state, stride)
            if state.warning[mujoco.mjtWarning.mjWARN_BADQACC].number:
                raise IapbError(f"MuJoCo warns of an unstable simulation at {state.time:g} s")
            places, speeds = state.qpos.reshape(-1, 7), state.qvel.reshape(-1, 6)
            turns = places[:, [4, 5, 6, 3]]
            spin = np.einsum("bij,bj->bi", rotation(turns), speeds[:, 3:])
            record.add(state.time, places[:, :3], turns, speeds[:, :3], spin)
        return record.trajectory()


def _model_text(scene: FixedScene, settings: Settings, step: float) -> str:
    """Return the scene as MJCF."""
    given = settings.options
    contact = f'condim="{given["condim"]:g}" solref="{given["solref"]}" solimp="{given["solimp"]}"'
    walls = "".join(_geom(Cuboid(wall.size, wall.position), wall.orientation) for wall in scene.obstacles)
    bodies = "".join(f'<body name="{body.name}"><freejoint/>'
                     f'<inertial pos="0 0 0" mass="{body.mass!r}" diaginertia="{_text(body.inertia)}"/>'
                     f"{''.join(map(_geom, body.shapes))}</body>" for body in scene.bodies)  # fmt: skip
    return (
        f'<mujoco><option timestep="{step!r}" integrator="{given["integrator"]}" gravity="{_text(scene.gravity)}" '
        f'tolerance="{given["tolerance"]!r}" iterations="200"/><default><geom {contact}/></default>'
        f"<worldbody>{walls}{bodies}</worldbody></mujoco>"
    )


def _geom(shape: Sphere | Cuboid, turn: Quaternion = UPRIGHT) -> str:
    kind = "sphere" if isinstance(shape, Sphere) else "box"
    size = (shape.radius,) if isinstance(shape, Sphere) else tuple(0.5 * length for length in shape.size)
    return (f'<geom type="{kind}" size="{_text(size)}" pos="{_text(shape.center)}" '
            f'quat="{_text((turn[3], *turn[:3]))}"/>')  # fmt: skip


def _text(numbers: tuple[float, ...]) -> str:
    return " ".join(repr(float(number)) for number in numbers)
