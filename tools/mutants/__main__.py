"""`python -m tools.mutants`: judge a sample of mutants of the physics; see the package's docstring."""

from __future__ import annotations

import argparse
import os
import sys

from tools.mutants.clones import REPOSITORY, Clone, git, prepare
from tools.mutants.explained import explanations
from tools.mutants.judge import Judgement, Kept, code_version, judge_all
from tools.mutants.report import enough, sentences, write
from tools.mutants.selection import measured
from tools.mutants.sites import Mutant, all_places, sample

OUT = REPOSITORY / "out" / "mutants"


def main() -> int:
    """Return 1 if too few mutants are noticed or a survivor is not explained."""
    asked = _arguments()
    if git("status", "--porcelain", "--", "iapb", "tests"):
        print("Changes that are not committed are not judged: the clones hold the last commit.")
    os.nice(asked.nice)
    prepare()
    clones = [Clone() for _ in range(asked.workers)]
    try:
        root = clones[0].root
        mutants = sample(root, asked.count, asked.seed, asked.only)
        number, commit = len(all_places(root, asked.only)), git("rev-parse", "HEAD", folder=root)
        judged = _judged(mutants, clones)
    finally:
        for clone in clones:
            clone.remove()
    table = explanations()
    write(REPOSITORY / "out" / "mutants.json", judged, table, asked.seed, commit)
    print("\n".join(sentences(judged, table, number)))
    return int(not enough(judged, table))


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tools.mutants", description=__doc__)
    parser.add_argument("-n", dest="count", type=int, default=100, help="size of the sample")
    parser.add_argument("--seed", type=int, default=0, help="another seed draws another sample")
    parser.add_argument("--only", default="", metavar="PART", help="files whose path contains this")
    parser.add_argument("--workers", type=int, default=2, help="clones that are judged at once")
    parser.add_argument("--nice", type=int, default=0)
    return parser.parse_args()


def _judged(mutants: list[Mutant], clones: list[Clone]) -> list[Judgement]:
    selection = measured(clones, OUT / "calls", lambda done, of: _show(f"measuring test files: {done} of {of}"))

    def told(done: int, judgement: Judgement) -> None:
        _show(f"{done} of {len(mutants)} mutants: {judgement.file} {judgement.verdict}")

    judged = judge_all(mutants, selection, clones, Kept(OUT / "verdicts.jsonl", code_version(clones[0])), told)
    print(file=sys.stderr)
    return judged


def _show(text: str) -> None:
    end = "\r" if sys.stderr.isatty() else "\n"
    print(f"{text:<100}", end=end, file=sys.stderr, flush=True)


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit("\nStopped. What was measured and judged is kept: the same command goes on from there.")
