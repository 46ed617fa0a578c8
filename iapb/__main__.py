"""The command `iapb`, also as `python -m iapb`: start it, or say which package is missing or hidden.

It stands in `iapb`, the one package whose name is not a common word: a user's folder `reports` may hide ours.
"""

import sys

from iapb.errors import IapbError
from iapb.lazy import needed


def main() -> int:
    """Run the command; where a package is missing or hidden by another, one sentence says so and how to mend it."""
    try:
        command = needed("reports.cli", "The command")
    except IapbError as error:
        print(f"iapb: {error}", file=sys.stderr)
        return 1
    return int(command.main())


if __name__ == "__main__":
    sys.exit(main())
