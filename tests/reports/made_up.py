"""Short runs, inputs of the figures, and made-up records of a report."""

from dataclasses import replace
from functools import cache
from pathlib import Path

from iapb import find_scene, load_scene
from reference.worlds import run_world
from reports.evidence.runs import CORNER_SCENE, FIGURE_RUNS, TILTED, corner_scene
from reports.figures.corner import UNLIMITED
from reports.figures.paper import arm_energies
from reports.pages.numbers_file import read_numbers
from reports.pages.records import Evidence
from reports.store.uses import StoredFile
from verification.finding import MIXED, REFUTED, REPRODUCED, Part, finding_of
from verification.table import titled

PEG = load_scene(find_scene("peg_corner"))


def flipped(content, share=0.5):
    """Return the bytes with one bit changed at this share of their length."""
    at = int(share * len(content))
    return content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :]


def made_run(restitution=0.0, **fields):
    """A short run of the peg in the corner, with some fields changed."""
    scene = PEG.with_values({"duration": 0.4, "contact.restitution": restitution})
    return replace(run_world(scene, "IAPB"), **fields)


@cache
def figure_inputs():
    """The inputs of all figures: tables of a report, thinned, and runs of the peg that differ in the
    stiffness of the walls."""
    tables = read_numbers(Path(__file__).with_name("figures.json")).tables
    peg = PEG.with_values({"duration": 1.0})
    runs = {
        name: run_world(peg.with_values({"contact.stiffness": 900.0 + 50.0 * k}), "IAPB")
        for k, name in enumerate(FIGURE_RUNS)
    }
    worlds = {name: runs[f"corner/{name}"] for name in UNLIMITED}
    worlds["IAPB-push"] = runs["corner/IAPB-spread"]
    tilted = {TILTED: dict.fromkeys((0.0, 0.015, 0.2), worlds)}
    scene = {CORNER_SCENE: corner_scene(), "arm_energies": arm_energies()}
    return {**tables, **runs, **tilted, **scene}


RUNS = tuple(
    StoredFile(f"{n}.h5", f"{n:064d}", f"iapb run peg_corner --set rate={n}", ("C10",))
    for n in range(3)
)


def one(key, *parts, **more):
    return finding_of(key, key, "q", parts, answer="a", **more)


EVIDENCE = Evidence(
    claims=(
        finding_of(
            "C01",
            "C01",
            "KE never rises <b>",
            (Part("as printed.", MIXED, "as printed"),),
            {"C01": titled(("κ", "gain"), ((1e3, 2e-16),))},
            answer="half of the printed loss: $\\frac{1}{2}$",
        ),
        one("C02", Part("n.", REFUTED)),
        one("C10", Part("p.", REPRODUCED)),
    ),
    topics=(
        finding_of(
            "stability",
            "Walls",
            "Asked <here>.",
            (Part("It holds to 1e-14.", REPRODUCED),),
            {"wide": titled([f"a long heading {k}" for k in range(12)], [("word", *range(11))])},
            answer="All hold.",
        ),
    ),
    effects={
        "peg": titled(
            (
                "effect",
                "active",
                "reason",
                "left out",
                "without it",
                "position [mm]",
                "energy [%]",
            ),
            [
                ("gravity", False, "none in the scene", "", None, None, None),
                ("friction", True, "a coefficient", "", "another motion", 2.5, 10.0),
                ("touch", True, "walls", "", "same bits", 0.0, 0.0),
            ],
        )
    },
    provenance={"commit": "abc"},
    runs=RUNS,
)
