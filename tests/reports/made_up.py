"""A made-up run with every array filled, and inputs of the figures."""

from functools import cache
from pathlib import Path

import numpy as np

from iapb import find_scene, load_scene
from iapb.numerics.schema import blank, quantities
from iapb.run import ContactTable, EffectRow, ImpactTable, Run
from reference.worlds import run_world
from reports.evidence.runs import CORNER_SCENE, FIGURE_RUNS, TILTED, corner_scene
from reports.figures.corner import UNLIMITED
from reports.figures.paper import arm_energies
from reports.numbers_file import read_numbers
from reports.pages.records import Evidence
from reports.uses import StoredFile
from verification.finding import MIXED, REFUTED, REPRODUCED, Part, finding_of
from verification.table import titled

NAMES = ("peg.x", "peg.y", "peg.theta")
TEXTS = {
    "scene_name": "peg",
    "scene_source": "name: peg\n# with a comment, é\n",
    "world": "IAPB",
    "scene_resolved": {"name": "peg", "rate": 512, "bodies": [{"mass": 2.0}]},
    "law": "impulse augmented",
    "law_settings": {"restitution": 0.0, "limits": [15.0, 15.0, 1.0]},
    "coupling": "four channel",
    "coupling_settings": {"stiffness": [100.0, 100.0, 0.5]},
    "dt": 1 / 512,
    "complete": True,
    "coordinate_names": NAMES,
    "coordinate_units": ("m", "m", "rad"),
    "velocity_names": NAMES,
    "velocity_units": ("m/s", "m/s", "rad/s"),
    "body_names": ("peg",),
    "effects": (
        EffectRow("gravity", False, "the scene names none"),
        EffectRow("friction", True, "μ = 0.3"),
        EffectRow("contact_damping", False, "no springs", "damping"),
    ),
}


def flipped(content, share=0.5):
    """Return the bytes with one bit changed at this share of their length."""
    at = int(share * len(content))
    return content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :]


def made_run(steps=20, contacts=7, impacts=3, seed=0, **fields):
    """Return a small run with every array filled."""
    rng = np.random.default_rng(seed)
    tool_dofs = fields.pop("tool_dofs", (0, 3))
    device = tool_dofs[1] - tool_dofs[0]
    lengths = {
        "time": steps + 1,
        "step": steps,
        "step_edge": steps + 1,
        "contact": contacts,
        "impact": impacts,
        "coordinate": len(fields.get("coordinate_names", "xyz")),
        "velocity": 3,
        "device_coordinate": device,
        "device_velocity": device,
        "body": 1,
        "placement": 3,
        "axis": 3,
    }

    def filled(listed):
        return {
            name: rng.normal(size=array.shape)
            if array.dtype.kind == "f"
            else rng.integers(0, 2, array.shape).astype(array.dtype)
            for name, array in blank(listed, lengths).items()
        }

    contact = filled(quantities(ContactTable))
    impact = filled(quantities(ImpactTable))
    contact |= {
        "offsets": np.array([0, *np.sort(rng.integers(0, contacts + 1, steps - 1)), contacts]),
        "gap": -np.abs(contact["gap"]),
    }
    impact |= {"step": np.arange(impacts), "energy_lost": np.abs(impact["energy_lost"])}
    values = (
        TEXTS
        | filled((*quantities(Run, "time"), *quantities(Run, "step")))
        | {
            "tool_dofs": tool_dofs,
            "tool_coordinates": tool_dofs,
            "time": np.arange(steps + 1) / 512,
            "contacts": ContactTable(**contact),
            "impacts": ImpactTable(**impact),
            "energy": {"kinetic": rng.random(steps + 1), "impact_loss": rng.random(steps)},
            "chunk_steps": np.array([steps], np.int64),
            "chunk_seconds": np.array([0.5]),
        }
    )
    return Run(**{**values, **fields})


@cache
def figure_inputs():
    """The inputs of all figures: tables of a report, thinned, and runs of the peg that differ in the
    stiffness of the walls."""
    tables = read_numbers(Path(__file__).with_name("figures.json")).tables
    peg = load_scene(find_scene("peg_corner")).with_values({"duration": 1.0})
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
