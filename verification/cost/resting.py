"""Three scenes in contact, for us (YAML) and for MuJoCo (MJCF): same masses, shapes, forces and step, no friction.

All contacts rest, without impulses or events, so that all steps of an engine do the same work. The hand's force acts at
the centre of mass of the body that it holds. The files are in the folder `scenes` beside this module.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from iapb.scene import Scene, scene_from_text

FOLDER = Path(__file__).with_name("scenes")
ARM = Path(__file__).parents[2] / "scenes" / "robots" / "seven_axis_arm.urdf"


class RestingScene(NamedTuple):
    """One scene for both engines.

    file : name of our scene file
    settling : number of steps before the timed steps
    forms : names of the scene's forms for MuJoCo, each with its file
    push : (6,) force [N] and torque [N m] on the last body of MuJoCo's model, in world axes
    pose : start of MuJoCo by coordinate; empty for the start in its model
    """

    file: str
    settling: int
    forms: Mapping[str, Path]
    push: tuple[float, ...]
    pose: tuple[float, ...] = ()

    def ours(self) -> Scene:
        """Return our scene; a robot is found beside ARM."""
        return scene_from_text((FOLDER / self.file).read_text(encoding="utf-8"), str(ARM))

    def model(self, form: str, solver: str) -> Any:
        """Return MuJoCo's compiled model of a form, with a solver by name."""
        import mujoco

        spec = mujoco.MjSpec.from_file(str(self.forms[form]))
        spec.option.solver = getattr(mujoco.mjtSolver, f"mjSOL_{solver.upper()}")
        if self.forms[form] == ARM:
            block: Any = self.ours().walls[0]
            spec.option.timestep, spec.option.gravity = 1e-3, (0.0, 0.0, 0.0)
            for geom in spec.geoms:  # links touch the block but not each other, as in our scene
                geom.condim, geom.contype, geom.conaffinity = 1, 1, 0
            spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.5 * x for x in block.size],
                                    pos=list(block.center), condim=1, contype=0, conaffinity=1)  # fmt: skip
            for joint in spec.joints:  # our scene has no joint limits, so MuJoCo's model has none
                joint.limited = mujoco.mjtLimited.mjLIMITED_FALSE
        return spec.compile()


RESTING = {
    "peg in the corner": RestingScene("peg_at_rest.yaml", 2000, {
        "box": FOLDER / "peg_as_box.xml", "a ball at each corner": FOLDER / "peg_as_balls.xml",
    }, (-0.32, 0.4, 0.0, 0.0, 0.0, 0.0)),
    "free box on a plane": RestingScene("box_at_rest.yaml", 2000, {"box": FOLDER / "box.xml"}, (0.0,) * 6),
    "seven-axis arm on a block": RestingScene(
        "arm_touching.yaml", 50, {"spheres": ARM}, (0.0, 0.0, -5.0, 0.0, 0.0, 0.0),
        (0.2, 0.3, 0.0, 1.9, 0.0, 0.9416, 0.3)),
}  # fmt: skip
