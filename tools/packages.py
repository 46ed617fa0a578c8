"""`make packages`: build the wheel and the sdist, and test each in new environments of every
installed Python.

An environment gets the newest packages that pip finds, or the lowest that pyproject.toml allows. In
each environment, without numba, a process imports iapb, simulates a scene and resolves an impact.
The results must be equal to the last bit. With --extra the
environments also get that extra and test an impact resolver.

    python -m tools.packages --extra all        (a gigabyte for each Python)
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path.cwd()
PYTHONS = ("3.11", "3.12", "3.13")
TRIAL = """
import hashlib, json, sys, time
start = time.perf_counter()
import numpy
import iapb
run = iapb.simulate(iapb.find_scene("peg_corner"))
assert "numba" not in sys.modules
simulated = time.perf_counter() - start
after = iapb.resolve_impact(numpy.diag([2.0, 1.0, 0.5]), numpy.array([[1.0, 0.3, 0.1], [0.2, 1.0, 0.4]]),
                            numpy.array([-1.0, -2.0, 0.5]), 0.5)
bits = hashlib.sha256(run.q.tobytes() + run.v.tobytes() + after.velocity.tobytes()).hexdigest()[:16]
print(json.dumps({"numpy": numpy.__version__, "first run": simulated, "bits": bits}))
"""
VERDICT = """
import json, sys, time
start = time.perf_counter()
from verification import check_passivity
from iapb import resolve_impact
passed = check_passivity(resolve_impact, impacts=50).passed
assert "numba" not in sys.modules
print(json.dumps({"passed": bool(passed), "verdict": time.perf_counter() - start}))
"""


def main() -> int:
    """Build, test each environment and print a table; return 1 if one fails or gives different
    numbers."""
    parser = argparse.ArgumentParser(
        prog="python -m tools.packages", description=__doc__.partition("\n\n")[0]
    )
    parser.add_argument("--extra", default="", help="an extra of pyproject.toml to install, too")
    parser.add_argument(
        "--pythons",
        nargs="+",
        metavar="COMMAND",
        default=[
            path for path in (shutil.which(f"python{version}") for version in PYTHONS) if path
        ],
        help="Python commands to try; those of 3.11 to 3.13 that are found",
    )
    chosen = parser.parse_args()
    if not chosen.pythons:
        parser.error("none of python3.11, python3.12, python3.13 is found: name some by --pythons")
    with tempfile.TemporaryDirectory() as folder:
        wheel, sdist = build(Path(folder))
        wanted = [(python, wheel, False) for python in chosen.pythons]
        wanted += [(chosen.pythons[0], sdist, False), (chosen.pythons[0], wheel, True)]
        rows = [
            try_one(Path(folder) / f"env{number}", *one, chosen.extra)
            for number, one in enumerate(wanted)
        ]
    for row in rows:
        print(
            ", ".join(
                f"{name} {value:.1f}" if isinstance(value, float) else f"{name} {value}"
                for name, value in row.items()
            )
        )
    wrong = [row for row in rows if "failed" in row or row.get("passed") is False]
    different = {row["bits"] for row in rows if "bits" in row}
    print(
        "The same bits in all environments that worked."
        if len(different) == 1
        else f"Bits: {sorted(different)}"
    )
    return 1 if wrong or len(different) != 1 else 0


def build(folder: Path) -> tuple[Path, Path]:
    """Build the wheel and the sdist; return their paths."""
    told([sys.executable, "-m", "venv", folder / "build"])
    python = folder / "build/bin/python"
    told([python, "-m", "pip", "install", "-q", "build"])
    told([python, "-m", "build", "--outdir", folder / "dist", ROOT])
    return next((folder / "dist").glob("*.whl")), next((folder / "dist").glob("*.tar.gz"))


def lowest(extra: str) -> list[str]:
    """Return the lowest versions that pyproject.toml allows, as requirements."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    wanted = list(project["dependencies"])
    given = [extra]
    while given:
        for one in extras.get(given.pop(), []):
            inner = re.match(r"iapb\[(.+)\]", one)
            (given if inner else wanted).append(inner[1] if inner else one)
    return [re.sub(r">=([\d.]+)(,<[\d.]+)?", r"==\1", one) for one in wanted]


def try_one(folder: Path, python: str, archive: Path, low: bool, extra: str) -> dict[str, object]:
    """Install `archive` into a new environment and use it twice; return the results, or
    "failed"."""
    row: dict[str, object] = {
        "python": "",
        "from": "sdist" if archive.suffix == ".gz" else "wheel",
        "versions": "lowest" if low else "newest",
    }
    print(f"trying {python}, {row['from']}, {row['versions']} ...", file=sys.stderr)
    try:
        told([python, "-m", "venv", folder])
        inside = folder / "bin/python"
        row["python"] = told([inside, "-c", "import platform; print(platform.python_version())"])
        told(
            [
                inside,
                "-m",
                "pip",
                "install",
                "-q",
                f"{archive}[{extra}]" if extra else archive,
                *(lowest(extra) if low else ()),
            ]
        )
        told([inside, "-m", "pip", "check"])
        row |= json.loads(told([inside, "-c", TRIAL], folder))
        if extra:
            row |= json.loads(told([inside, "-c", VERDICT], folder))
    except subprocess.CalledProcessError as error:
        row["failed"] = (error.stderr.strip() or error.stdout.strip())[-400:]
    shutil.rmtree(folder, ignore_errors=True)
    return row


def told(command: list[object], where: Path | None = None) -> str:
    """Run a command and return its output."""
    done = subprocess.run(
        [str(part) for part in command], cwd=where, capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


if __name__ == "__main__":
    sys.exit(main())
