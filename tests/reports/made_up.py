"""Made-up runs, motions and tables, nothing simulated: powers and waves, each outcome and each gap once."""

from dataclasses import replace
from itertools import product
from math import exp, sin

import numpy as np

from iapb import find_scene, load_scene
from iapb.run import ContactTable, EffectRow, ImpactTable, Run
from iapb.scene.mechanism import mechanism_of
from iapb.schema import blank, quantities
from reports.evidence.runs import TILTED
from reports.figures import RECIPES, energy_gains, mechanics
from reports.figures.corner import UNLIMITED
from reports.figures.paper import arm_energies
from reports.pages.builder import build_report
from verification.cost.accuracy import WAYS
from verification.cost.calls import PRINTED
from verification.cost.growth import FACTORED
from verification.cost.trajectories import BELOW, INTEGRATORS, OK, TIMED_OUT, WORLDS
from verification.table import titled

SCENES = tuple(f"scene {k}" for k in range(6))
STEPS, UNTOUCHED = 128, 40
METHODS = tuple(dict.fromkeys((*WORLDS, *INTEGRATORS)))
NAMES = ("peg.x", "peg.y", "peg.theta")
TEXTS = {
    "scene_name": "peg", "scene_source": "name: peg\n# with a comment, é\n", "world": "IAPB",
    "scene_resolved": {"name": "peg", "rate": 512, "bodies": [{"mass": 2.0}]},
    "law": "impulse augmented", "law_settings": {"restitution": 0.0, "limits": [15.0, 15.0, 1.0]},
    "coupling": "four channel", "coupling_settings": {"stiffness": [100.0, 100.0, 0.5]}, "dt": 1 / 512,
    "complete": True, "coordinate_names": NAMES, "coordinate_units": ("m", "m", "rad"), "velocity_names": NAMES,
    "velocity_units": ("m/s", "m/s", "rad/s"), "body_names": ("peg",),
    "effects": (EffectRow("gravity", False, "the scene names none"), EffectRow("friction", True, "μ = 0.3"),
                EffectRow("contact_damping", False, "no springs", "damping")),
}  # fmt: skip


def joined(evidence, recipes=RECIPES):
    """Every page of a report as one text, the first page first, for tests that ask what is said and not where."""
    return "\n".join(build_report(evidence, recipes).values())


def made_run(steps=20, contacts=7, impacts=3, seed=0, **fields):
    """Return a small run with every array filled."""
    rng = np.random.default_rng(seed)
    tool_dofs = fields.pop("tool_dofs", (0, 3))
    device = tool_dofs[1] - tool_dofs[0]
    lengths = {"time": steps + 1, "step": steps, "step_edge": steps + 1, "contact": contacts, "impact": impacts,
               "coordinate": 3, "velocity": 3, "device_coordinate": device, "device_velocity": device, "body": 1,
               "placement": 3, "axis": 3}  # fmt: skip

    def filled(listed):
        return {name: rng.normal(size=array.shape) if array.dtype.kind == "f" else
                rng.integers(0, 2, array.shape).astype(array.dtype)
                for name, array in blank(listed, lengths).items()}  # fmt: skip

    contact, impact = filled(quantities(ContactTable)), filled(quantities(ImpactTable))
    contact |= {"offsets": np.array([0, *np.sort(rng.integers(0, contacts + 1, steps - 1)), contacts]),
                "gap": -np.abs(contact["gap"])}  # fmt: skip
    impact |= {"step": np.arange(impacts), "energy_lost": np.abs(impact["energy_lost"])}
    values = TEXTS | filled((*quantities(Run, "time"), *quantities(Run, "step"))) | {
        "tool_dofs": tool_dofs, "tool_coordinates": tool_dofs, "time": np.arange(steps + 1) / 512,
        "contacts": ContactTable(**contact), "impacts": ImpactTable(**impact),
        "energy": {"kinetic": rng.random(steps + 1), "impact_loss": rng.random(steps)},
        "chunk_steps": np.array([steps], np.int64), "chunk_seconds": np.array([0.5]),
    }  # fmt: skip
    return Run(**{**values, **fields})


def tables():
    """Return a table for each input of a figure that is a table."""
    made = {
        "C22/C22": ("problem; contacts; ratio; lower quartile; upper quartile", (
            (problem, c, r, 0.97 * r, 1.03 * r) for problem, power in (("a patch", 0.9), ("a pile", -0.05))
            for c in (1, 2, 4, 8, 16, 64, 300) for r in [c**power])),
        "complementarity/map": (
            "impacts; e; redundant rows; share that agrees; median distance where they differ; largest distance", (
                (family, e, k, 1.0 - 0.2 * k, 0.3 * k * (1 + e) or None, 0.5 * k * (1 + e))
                for family in ("one contact", "corner") for k in (0, 2) for e in (0.0, 0.5, 1.0))),
        "complementarity/two contacts": ("cosine; speed ratio; agreement predicted; agreement found", (
            (0.1 * k, 0.1 * m, m >= k, m >= k) for k in range(-9, 10, 3) for m in range(1, 11, 3))),
        "complementarity/piles": (
            "rows; contacts; share that agrees; most contacts that agree; share of impulses that pull; "
            "pushing from the LCP; time of (21) [µs]; time of pushing [µs]", (
                (rows, c, 1.0 * (c < 6), 6, 0.0 if c < 6 else 0.1 * c**0.3, 1e-16, 40.0 + c, 300.0 + c * c)
                for rows in ("approaching", "touching") for c in (5, 12, 40, 150))),
        "effect_costs": ("scene; effect; time saved [%]; error [mm]; best of its error", (
            ("peg_corner", effect, 60.0 / (k + 1), 10.0 ** (2 - k) if k < 4 else 0.0, "yes" if k % 2 else "no")
            for k, effect in enumerate(("hand_force", "wall_contacts", "coherence", "clustering", "friction")))),
        "effect_steps": ("scene; step [µs]; all on [µs]; shares of the step", (
            (scene, 0.5 * (k + 1), 0.8 * (k + 1), "friction 40 % (0.2 µs), coupling 20 % (0.1 µs)")
            for k, scene in enumerate(SCENES))),
        "energy-gains/impacts": ("; ".join((energy_gains.METHOD, energy_gains.CONDITION, energy_gains.GAIN,
                                            energy_gains.SHARE)), (
            (method, f"1e{k}" if k < 12 else "all", gain * 10.0**k, gain * 10.0 ** (k + 10))
            for method, gain in (("factored", 0.0), ("factored, no clamp", 1e-17), ("gram_pinv, as printed", 1e-15))
            for k in range(13))),
        "engines/errors": (
            "engine; scene; settings; law; energy error; largest rise of energy; momentum error; overlap / size", (
                (engine, scene, settings, law, value, value, None if law else 1e-16, value)
                for k, (engine, law) in enumerate((("iapb (ours)", "met"), ("MuJoCo", "missed"), ("Drake", "failed"),
                                                   ("Siconos", "not installed")))
                for m, scene in enumerate(SCENES) for settings in ("own", "matched")
                for value in [10.0 ** (3 * k - 16 + 2 * m) if k < 2 else None])),
        "haptic-rate/budgets": (
            "contacts; rank; budget [rows]; median residual; share of the loss; largest relative gain", (
            (6 * n, n, k, 0.5 * (1 - k / n), k / n, -0.1) for n in (4, 8, 20) for k in range(n + 1))),
        "haptic-rate/fitted": ("method; axis; exponent; steepest from; to; there", (
            (method, axis, 0.9, 1000, 2000, 1.1) for method in (FACTORED, PRINTED)
            for axis in ("contacts", "coordinates"))),
        "haptic-rate/scaling": ("method; coordinates; contacts; time [µs]; lower quartile [µs]; upper quartile [µs]", (
            (method, d, c, t, 0.9 * t, 1.1 * t) for k, method in enumerate((FACTORED, PRINTED))
            for d, c in ((12, 50), (12, 300), (12, 2000), (3, 60), (24, 60), (96, 60))
            for t in [10.0**k * d * c ** (0.9 + k)])),
        "haptic-rate/motions": (
            "scene; method; step [ms]; time [ms/s]; position; energy; signed energy; energy made; outcome; note", (
                (scene, method, h, (k + 1) * 4.0 / h,
                 0.02 * (0.5 * k + m + 1) * h ** (0.5 + 0.2 * k) if k < 6 else 0.05, 1e-10, -1e-10, 0.01 * (k == 3),
                 TIMED_OUT if h < 0.1 and k == 1 else OK,
                 f"position {BELOW}" if (h, k) == (0.5, 2) else "")
                for m, scene in enumerate(SCENES) for k, method in enumerate(METHODS)
                for h in (8.0, 2.0, 0.5, 0.1, 0.02))),
        "mechanics/coordinate invariance": ("coordinates; contacts; elbow [rad]; error; bound", (
            (name, contacts, elbow, None if bound > 1e8 else 1e-3 * bound, bound)
            for name, power in (("absolute angles", 0), ("place of the hand", -2))
            for contacts in ("one", "two, separated", "two, 1e-08 m apart") for elbow in (1.0, 1e-2, 1e-4, 1e-8, 0.0)
            for bound in [1e-11 * max(elbow, 1e-12) ** power])),
        "mechanics/tumbling": (
            "motion; integrator; step [s]; attitude error [rad]; energy drift [relative]; momentum drift [relative]; "
            "declared order", (
                ("turning over", integrator, h, h**order, 0.1 * h**order, 0.01 * h**order, order)
                for integrator, order in zip(mechanics.INTEGRATORS, (4, 1, 2, 2), strict=True)
                for h in (0.01, 0.005))),
        "mechanics/false collisions": ("filters; damping [N s/m]; false collisions", (
            (name, b, 20 - 6 * k) for k, name in enumerate(mechanics.FILTERS) for b in (10.0, 40.0, 60.0))),
        "mechanics/false collisions in time": (
            "filters; damping [N s/m]; time [s]; false collisions so far; energy lost so far, share of the fall", (
                (name, 40.0, 0.1 * n, n, 0.04 * n / (k + 1)) for k, name in enumerate(mechanics.FILTERS)
                if k < 3 for n in range(1, 18 - 5 * k))),
        "mechanics/linked impacts": (
            "problem; treatment; rows or order; ball; v_x after [m/s]; v_y after [m/s]; energy change; "
            "momentum change", (
                (problem, treatment, rows, ball, 0.2 * ball + 0.1 * k, 0.1 * (balls == 3), 0.0, -2.0 * (k == 1))
                for problem, balls in (("cradle of 2", 2), ("cradle of 5", 5), ("Bernoulli", 3))
                for k, (treatment, rows) in enumerate((
                    ("simultaneous, relative rows (12)", "all touching contacts"),
                    ("simultaneous, per-body rows (13)-(14)", "approaching contacts"),
                    ("event-driven", "contact 0, then 1"))) for ball in range(balls))),
        "scene-ledger/books over time": (
            "scene; time [s]; kinetic [J]; potential [J]; springs [J]; given [J]; lost impacts [J]; lost damping [J]; "
            "lost friction [J]; impacts", (
                (scene, 0.1 * n, k * exp(-0.1 * n), 0.0, 0.1 * k * sin(n) ** 2, 0.0, k - k * exp(-0.1 * n), 0.0, 0.0,
                 n % 7 == 0)
                for k, scene in enumerate(SCENES) for n in range(20))),
        "scene-ledger/contact": ("scene; dimensions; most penetration [mm]; how it ends; energy exchanged [J]", (
            (scene, 2 + k % 2, 0.3 * k, "keeps moving", 0.1 * k) for k, scene in enumerate(SCENES))),
        "stability/dampings": ("damping [N s/m]", ((b,) for b in (0.0, 1.0, 10.0, 100.0, 1000.0))),
        "stability/maps": (
            "rate [Hz]; sensors; device damping [N s/m]; stiffness [N/m]; passive up to [N s/m]; penalties; impulses", (
                (512.0, "ideal", b, K, max(b - K / 1024, 0.0), "xo+ox", "oo++x") for b in (0.0, 5.0)
                for K in (100.0, 1e3, 1e4))),
        "stability/hardness": (
            "rate [Hz]; sensors; device damping [N s/m]; law; stiffness [N/m]; rate-hardness [N/m]; settles after [s]; "
            "penetration [mm]", (
                (512.0, "ideal", 0.0, law, K, 26.0 * K if k else 26000.0, 100 / K if K < 1e5 else None, 1e3 / K)
                for k, law in enumerate(("impulses", "penalty")) for K in (100.0, 1e3, 1e4, 1e5))),
        "work_precision": (
            "contacts; coordinates; problem; method; work; called; time [µs]; quartiles [µs]; relative error; "
            "relative energy gain; restitution residual; failed after [µs]; outcome", precision_rows()),
    }  # fmt: skip
    return {name: titled(columns.split("; "), rows) for name, (columns, rows) in made.items()}


def precision_rows():
    for (c, d), n, (k, way) in product(((1, 3), (60, 12)), range(9), enumerate(WAYS)):
        lost, time, error = k == 4 and n == 8, 0.3 * c * (1.0 + 0.2 * k), 10.0 ** -(2 + 0.7 * k + 0.1 * n)
        measured = (None, "", None, None, None, time, "too slow") if lost else (
            time, "", error, 1e-3 * (way.work == "1 sweep"), 0.0, None, "ok")
        yield (c, d, f"problem {n}", way.method, way.work, way.called, *measured)


def made_motion(scene, seed):
    """A made-up motion of a shipped scene: every coordinate swings about its start, some contacts and impacts."""
    loaded = load_scene(find_scene(scene))
    resolved = loaded.resolved()
    start = np.concatenate([np.asarray(body["position"], dtype=float) for body in resolved["bodies"]])
    time = np.arange(STEPS + 1) / 512
    swing = 0.002 * np.sin(np.outer(40 * time, 1 + 0.1 * seed + np.arange(len(start))))
    pose = mechanism_of(loaded).poses(start + swing, planar=True)
    run = made_run(steps=STEPS, contacts=60, impacts=5, seed=seed, time=time, q=start + swing, pose=pose,
                   scene_name=scene, scene_resolved=resolved)
    late = np.where(np.arange(STEPS + 1) < UNTOUCHED, 0, run.contacts.offsets)  # nothing touches before
    run = replace(run, contacts=replace(run.contacts, offsets=late, point=0.01 * run.contacts.point))
    force = np.sin(np.outer(30 * time[1:] + seed, [1.0, 2.0, 3.0])) * [1.0, 1.0, 0.02]
    return replace(run, device_force=force, device_q=0.01 * np.sin(np.outer(20 * time + seed, [1.0, 2.0, 3.0])))


def all_inputs():
    """Return the inputs of all figures but those of scenes in space and of some films: made-up motions and tables."""
    needed = sorted({name for recipe in RECIPES for name in recipe.needs})
    scenes = {"corner": "peg_corner", "device": "peg_corner", "hole": "peg_hole", "group": "arm_pushing",
              "wall": "wall_1d"}
    runs = {name: made_motion(scenes[name.split("/")[0]], k) for k, name in enumerate(needed)
            if name.split("/")[0] in scenes}  # fmt: skip
    given = {name: load_scene(find_scene(name[6:])).resolved() for name in needed if name.startswith("scene/")}
    tilted = {tilt: {name: runs[f"corner/{name}"] for name in UNLIMITED} for tilt in (0.0, 0.015)}
    return {**runs, **given, **tables(), TILTED: tilted, "arm_energies": arm_energies(),
            "machine": "a processor, report of today"}
