"""Three scenes in contact, for us (YAML) and for MuJoCo (MJCF): same masses, shapes, forces and step, no friction.

All contacts rest, without impulses or events, so that all steps of an engine do the same work. The hand's force acts at
the centre of mass of the body that it holds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from iapb.mechanics.mechanism import Mechanism

ARM_FILE = Path(__file__).parents[2] / "scenes" / "robots" / "seven_axis_arm.urdf"
ARM_POSE = (0.2, 0.3, 0.0, 1.9, 0.0, 0.9416, 0.3)  # [rad]: the two fingertips point down
FINGER_RADIUS = 0.015  # [m], as in the file
TOOL_CENTER, TOOL_FORCE = (0.0, 0.0, 0.08), (0.0, 0.0, -5.0)  # [m] in link_7, [N] in world axes
BLOCK = (0.4, 0.4, 0.1)  # [m]
_PEG_STEP, _SPATIAL_STEP = 1.0 / 512.0, 1e-3  # [s]


@dataclass(frozen=True)
class RestingScene:
    """One scene for both engines.

    text : our scene in YAML; file : path of the scene file, relative to which its robot files are found
    settling : number of steps before the timed steps
    models : name of a form of the scene for MuJoCo -> function (solver) -> compiled model
    pose : start of MuJoCo by coordinate; empty for the start in its model
    push : (6,) force [N] and torque [N m] on the last body of MuJoCo's model, in world axes
    """

    name: str
    text: str
    file: str
    settling: int
    models: dict[str, Callable[[str], Any]]
    push: tuple[float, ...]
    pose: tuple[float, ...] = ()


def resting_scenes() -> tuple[RestingScene, ...]:
    """Return the three scenes: the peg in the corner, a free box on a plane, an arm that touches a block."""
    return (_peg(), _box(), _arm())


def _option(step: float, solver: str, gravity: str = "0 0 0") -> str:
    return f'<option timestep="{step!r}" gravity="{gravity}" solver="{solver}"/><default><geom condim="1"/></default>'


def _model(text: str) -> Any:
    import mujoco

    return mujoco.MjModel.from_xml_string(f"<mujoco>{text}</mujoco>")


def _peg() -> RestingScene:
    text = """
name: peg_at_rest
rate: 512
duration: 1
bodies:
  - {name: peg, joint: planar, mass: 2.0, inertia: 0.005, shapes: [{kind: box, size: [0.021, 0.0105]}],
     position: [0.0105, -0.00525, 0]}
walls:
  - {name: right_wall, kind: half_plane, point: [0, 0], normal: [1, 0]}
  - {name: floor, kind: half_plane, point: [0, 0], normal: [0, -1]}
contact: {forces: paper, stiffness: 1000, damping: 50, restitution: 0, cluster_distance: 1.0e-4,
          coherence_distance: 1.0e-3}
hand: {body: peg, force: [-0.32, 0.4, 0]}
"""
    box = '<geom type="box" size="0.0105 0.00525 0.0105"/>'
    corners = "".join(f'<geom type="sphere" size="1e-4" pos="{x} {y} 0"/>'
                      for x in (-0.0104, 0.0104) for y in (-0.00515, 0.00515))  # fmt: skip

    def model(shapes: str) -> Callable[[str], Any]:
        # only peg and walls may touch; spheres of one body never collide
        return lambda solver: _model(
            _option(_PEG_STEP, solver) + "<worldbody>"
            '<geom type="plane" size="1 1 1" zaxis="1 0 0"/><geom type="plane" size="1 1 1" zaxis="0 -1 0"/>'
            '<body pos="0.0105 -0.00525 0"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>'
            '<joint type="hinge" axis="0 0 1"/><inertial pos="0 0 0" mass="2" diaginertia="0.005 0.005 0.005"/>'
            f"{shapes}</body></worldbody>")

    models = {"box": model(box), "four corner balls": model(corners)}
    return RestingScene("peg in the corner", text, "(text)", 2000, models, (-0.32, 0.4, 0.0, 0.0, 0.0, 0.0))


def _box() -> RestingScene:
    text = """
name: box_at_rest
dimensions: 3
rate: 1000
duration: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: box, joint: free_flyer, mass: 1.0, inertia: [0.00166667, 0.00166667, 0.00166667],
     shapes: [{kind: box, size: [0.1, 0.1, 0.1]}], position: [0, 0, 0.05, 0, 0, 0, 1]}
walls:
  - {name: floor, kind: half_space, point: [0, 0, 0], normal: [0, 0, 1]}
contact: {forces: paper, stiffness: 10000, damping: 40, restitution: 0, coherence_distance: 1.0e-3}
"""

    def model(solver: str) -> Any:
        return _model(_option(_SPATIAL_STEP, solver, "0 0 -9.81") + "<worldbody>"
                      '<geom type="plane" size="1 1 1"/><body pos="0 0 0.05"><freejoint/>'
                      '<inertial pos="0 0 0" mass="1" diaginertia="0.00166667 0.00166667 0.00166667"/>'
                      '<geom type="box" size="0.05 0.05 0.05"/></body></worldbody>')  # fmt: skip

    return RestingScene("free box on a plane", text, "(text)", 2000, {"box": model}, (0.0,) * 6)


def _arm() -> RestingScene:
    center, size = _block_below_the_fingers()
    pose = ", ".join(f"link_{k}: [{angle}]" for k, angle in enumerate(ARM_POSE, start=1))
    text = f"""
name: arm_touching
dimensions: 3
rate: 1000
duration: 1
robots:
  - {{name: arm, urdf: {ARM_FILE.name}, collisions: urdf, position: {{{pose}}}}}
walls:
  - {{name: block, kind: box, size: {list(size)}, center: {list(center)}}}
contact: {{forces: paper, stiffness: 10000, damping: 100, restitution: 0, coherence_distance: 1.0e-3}}
hand: {{body: arm_link_7, point: {list(TOOL_CENTER)}, force: [{', '.join(map(str, TOOL_FORCE))}, 0, 0, 0]}}
"""

    def model(solver: str) -> Any:
        import mujoco

        spec = mujoco.MjSpec.from_file(str(ARM_FILE))
        spec.option.timestep, spec.option.gravity = _SPATIAL_STEP, (0.0, 0.0, 0.0)
        spec.option.solver = getattr(mujoco.mjtSolver, f"mjSOL_{solver.upper()}")
        for geom in spec.geoms:  # links touch the block but not each other, as in our scene
            geom.condim, geom.contype, geom.conaffinity = 1, 1, 0
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.5 * x for x in size], pos=list(center),
                                condim=1, contype=0, conaffinity=1)  # fmt: skip
        for joint in spec.joints:  # our scene has no joint limits, so MuJoCo's model has none
            joint.limited = mujoco.mjtLimited.mjLIMITED_FALSE
        return spec.compile()

    return RestingScene("seven-axis arm on a block", text, str(ARM_FILE), 50, {"spheres": model},
                        (*TOOL_FORCE, 0.0, 0.0, 0.0), ARM_POSE)  # fmt: skip


def _block_below_the_fingers() -> tuple[tuple[float, ...], tuple[float, float, float]]:
    """Return centre and size of a block whose upper face just touches the lower fingertip."""
    import numpy as np

    arm = Mechanism.from_urdf(ARM_FILE)
    rotations, positions = arm.placements(np.array(ARM_POSE))
    tips = [positions[-1] + rotations[-1] @ np.array((0.0, side, 0.18)) for side in (-0.05, 0.05)]
    x, y, z = min(tips, key=lambda tip: float(tip[2]))
    return (float(x), float(y), float(z) - FINGER_RADIUS - 0.5 * BLOCK[2]), BLOCK
