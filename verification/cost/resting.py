"""Three scenes at rest in contact, without friction.

All steps of an engine do the same work, without impulses or events. The hand's force acts at the
centre of mass of the body that it holds. The files are in the folder `scenes` beside this module.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from iapb.scene import Scene, scene_from_text

FOLDER = Path(__file__).with_name("scenes")
ARM = Path(__file__).parents[2] / "scenes" / "robots" / "seven_axis_arm.urdf"


class RestingScene(NamedTuple):
    """A scene file, and the number of steps until it rests."""

    file: str
    settling: int

    def scene(self) -> Scene:
        """Return the scene; a robot is found beside ARM."""
        return scene_from_text((FOLDER / self.file).read_text(encoding="utf-8"), str(ARM))


RESTING = {
    "peg in the corner": RestingScene("peg_at_rest.yaml", 2000),
    "free box on a plane": RestingScene("box_at_rest.yaml", 2000),
    "seven-axis arm on a block": RestingScene("arm_touching.yaml", 50),
}
