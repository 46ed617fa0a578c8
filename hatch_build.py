"""Build hook: a wheel contains the compiled engine, one shared library, so that its users need no
compiler."""

import platform
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

LIBRARY = "iapb/engine.so"
OLDEST_GLIBC = (2, 17)  # what manylinux_2_17 promises


class EngineLibrary(BuildHookInterface):  # type: ignore[type-arg]
    """Make the library of the engine, and add it to the wheel of this platform."""

    def dependencies(self) -> list[str]:
        """Return the compiler to install where the machine has none."""
        return [] if shutil.which("cc") else ["ziglang"]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile before the files are collected."""
        subprocess.run([sys.executable, "-m", "iapb.building.engine"], cwd=self.root, check=True)
        build_data["artifacts"].append(LIBRARY)
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{platform_tag(Path(self.root, LIBRARY).read_bytes())}"


def platform_tag(library: bytes) -> str:
    """Return the platforms on which a wheel with this library may be installed."""
    if sys.platform == "linux" and platform.libc_ver()[0] == "glibc":
        needed = {(2, int(minor)) for minor in re.findall(rb"GLIBC_2\.(\d+)", library)}
        if max(needed, default=OLDEST_GLIBC) <= OLDEST_GLIBC:
            return f"manylinux_2_17_{platform.machine()}"
    return re.sub(r"[.-]", "_", sysconfig.get_platform())
