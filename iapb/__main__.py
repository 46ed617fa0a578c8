"""Start the command `iapb`, also as `python -m iapb`, or say which package is missing or hidden.

This module is in the package `iapb` because a folder `reports` of the user may hide the package
`reports`.
"""

import sys

from iapb.errors import IapbError
from iapb.lazy import needed


def main() -> int:
    """Run the command; if a package is missing or hidden by another one, print one sentence that
    says how to fix it."""
    try:
        command = needed("reports.cli", "The command")
    except IapbError as error:
        print(f"iapb: {error}", file=sys.stderr)
        return 1
    return int(command.main())


if __name__ == "__main__":
    sys.exit(main())
