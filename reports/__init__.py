"""Runs on disk, figures, the report and the command line."""

import sys
from importlib.util import find_spec
from pathlib import Path

from iapb.errors import name_the_extra


def main() -> int:
    """Run the command `iapb`; where a package is missing or shadowed, one sentence says so and how to mend it."""
    if shadowed := shadowing():
        print(f"iapb: {shadowed}", file=sys.stderr)
        return 1
    try:
        from reports.cli import main as run

        return run()
    except ModuleNotFoundError as error:
        named = name_the_extra(error, "The command")
        if named is error:
            raise
        print(f"iapb: {named}", file=sys.stderr)
        return 1


def shadowing() -> str:
    """Say which package of this project is hidden by one of the same name elsewhere; empty where none is."""
    ours = Path(__file__).resolve().parents[1]
    for name in ("iapb", "reference", "verification"):
        spec = find_spec(name)
        places = [Path(place).resolve() for place in (spec.submodule_search_locations or ())] if spec else []
        if places and ours / name not in places:
            return (f"{places[0]} hides the package {ours / name}, which has the same name. Rename yours, or take its "
                    f"folder out of PYTHONPATH.")  # fmt: skip
    return ""
