"""check_force: its verdicts, its counterexamples as tests, its guards, and the planted faults."""

import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from iapb.errors import ArgumentError
from tests.verification.port.faults import DAMPING, EVERY, FAULTS, IN_THE_PLANE, wall
from verification.port import BareDevice, check_force
from verification.port.laws import FORCE_LAWS

ROOT = Path(__file__).resolve().parents[3]
QUICK = 0.2  # effort


def checked(law, fault, effort=1.0):
    start = [0.0, 0.0] if fault in IN_THE_PLANE else 0.0
    limit = 15.0 if law == "bounded" else None
    return check_force(fault, BareDevice(damping=DAMPING), start=start, limit=limit, effort=effort)


def test_a_sound_wall_keeps_every_law():
    report = check_force(wall, BareDevice(damping=DAMPING), limit=100.0, effort=QUICK, fastest=10.0)
    assert report.passed and not report.broken_laws and "passed" in report
    assert {one.law for one in report.verdicts} == set(FORCE_LAWS)
    report.raise_if_broken()


def test_a_wall_that_is_not_sound_names_a_motion_of_three_positions():
    """In and back: the smallest motion that draws energy from a spring."""
    report = check_force(wall, BareDevice(damping=0.5), effort=QUICK)
    assert report.broken_laws == ("energy",) and len(report.found[0][1].positions) == 3
    with pytest.raises(AssertionError, match="def test_energy"):
        report.raise_if_broken()
    assert str(pickle.loads(pickle.dumps(report))) == str(report)


def test_the_same_seed_gives_the_same_answer_and_stored_energy_is_allowed():
    one, other = (check_force(wall, BareDevice(damping=2.0), effort=QUICK) for _ in range(2))
    assert one.damping_needed == other.damping_needed and one.calls == other.calls

    def falls(x, v):
        return 1.0 if abs(x) < 0.005 else 0.0

    passes = check_force(falls, BareDevice(damping=1e3, friction=1.01), effort=QUICK)
    assert passes.passed
    energy = {"laws": ["energy", "silent"], "effort": QUICK}
    assert not check_force(falls, BareDevice(damping=0.1), **energy).passed
    assert check_force(falls, BareDevice(damping=2000.0, friction=0.6), stored=0.1, **energy).passed


def test_slow_hands_need_less_of_a_damper():
    """Re[(1 − z⁻¹) H]/(1 − cos θ) of K + B (1 − z⁻¹)/T falls from KT/2 + B at π to KT/2 − B at 0."""
    report = check_force(wall, BareDevice(), fastest=250.0, laws=["energy"], effort=QUICK)
    theta = 2.0 * np.pi * 0.25
    need = 1.0 - 2.0 * np.cos(theta)
    assert 0.97 * need < report.slow_damping < 1.001 * need < report.damping_needed


@pytest.mark.parametrize(("law", "fault"), [(law, faults[0]) for law, faults in FAULTS.items()])
def test_a_planted_fault_is_found_by_its_name(law, fault):
    assert law in checked(law, fault, QUICK).broken_laws


def test_a_law_for_numbers_gives_no_force_in_the_plane_and_the_report_says_why():
    report = check_force(wall, BareDevice(), start=[0.0, 0.0])
    assert report.broken_laws == ("finite",)
    assert "x and v were arrays (2,)" in report and "raised ValueError" in report


def test_a_search_that_ends_without_a_force_is_still_judged_on_the_largest_force():
    def strong(x, v):
        if abs(v) > 19.9995:
            return np.nan
        return -1000.0 * (x > 0.0) if abs(v) > 15.0 else wall(x, v)

    report = check_force(strong, BareDevice(damping=0.5), limit=500.0, laws=["bounded"])
    assert report.broken_laws == ("bounded",) and "no force" in report.unfinished


@pytest.mark.thorough
def test_every_planted_fault_is_found_and_its_test_fails_in_a_fresh_process(tmp_path):
    missed = []
    tests = []
    for k, (law, fault) in enumerate(EVERY):
        report = checked(law, fault)
        found = [one for one in report.found if one[0] == law]
        missed += [] if found else [fault.__name__]
        tests += [report.test_of(*one[:2]).replace("def test_", f"def test_{k}_") for one in found]
    assert not missed
    for number, text in enumerate(tests):
        (tmp_path / f"test_{number}.py").write_text(text)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert f"{len(EVERY)} failed in" in done.stdout, done.stdout[-2000:]


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(10))
def test_a_sound_wall_never_alarms(seed):
    assert check_force(wall, BareDevice(damping=1.02 * 3.0), seed=seed, effort=QUICK).passed


def test_patience_ends_the_search_and_the_report_says_so():
    report = check_force(wall, BareDevice(damping=DAMPING), patience=0.0)
    assert not report.passed and "NOT FINISHED" in report and "too slow" in report


def test_what_was_found_in_time_is_a_lower_bound():
    """The wall needs 3 N s/m; the time ends in the first scan, and slow hands are not looked at."""
    report = check_force(wall, BareDevice(damping=2.9), patience=0.3, fastest=10.0)
    assert 0.0 < report.damping_needed < 3.003 and "at least" in report
    assert report.slow_damping is None


class Hysteresis:
    """A wall that pushes out harder than it lets the hand in."""

    def reset(self):
        self.last = 0.0

    def step(self, x, v):
        stiffness = 500.0 if x >= self.last else 1000.0
        self.last = x
        return -stiffness * max(x, 0.0)


@pytest.mark.parametrize(
    ("law", "shown"),
    [(lambda x, v: 1000.0 * max(x, 0.0), True), (lambda x, v: 1.0, True), (Hysteresis(), False)],
)
def test_no_damping_is_enough_for_a_law_that_gives_to_a_slow_hand(law, shown):
    """A wrong sign, a constant pull, a loop of force: a device of any damping must fail."""
    report = check_force(law, BareDevice(damping=1000.0), laws=["energy"], effort=QUICK)
    assert report.damping_needed == np.inf and not report.passed and "FAILED" in report
    if shown:  # a pass slow enough for this device; for the loop, none was played
        assert "def test_energy" in report.counterexample_test
        assert report.friction_needed > 0.0


def test_a_law_that_raises_says_so_whatever_laws_are_asked():
    def narrow(x: float, v: float) -> float:
        if x > 9.8e-3:
            raise ValueError("beyond the table")
        return wall(x, v)

    report = check_force(narrow, BareDevice(damping=3.1), laws=["energy"], effort=QUICK)
    assert not report.passed and "no force in a motion of the search: " in report


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("laws", ["energi"]),
        ("start", [0.0] * 4),
        ("start", float("nan")),
        ("fastest", 0.0),
        ("limit", -1.0),
        ("stored", -1.0),
    ],
)
def test_wrong_arguments_are_refused(name, wrong):
    with pytest.raises(ArgumentError, match=name):
        check_force(wall, BareDevice(), **{name: wrong})
    with pytest.raises(ArgumentError, match="law = 3.0"):
        check_force(3.0, BareDevice())


def test_the_edge_is_convex_and_passes_through_what_is_needed():
    report = check_force(wall, BareDevice(), laws=["energy"], edge=True, effort=QUICK)
    b, f = report.edge.T
    assert np.all(np.diff(f, 2) >= -1e-9 * f[0])  # convex, up to rounding
    at_zero = b[np.argmax(f <= 1e-6 * f[0])]
    assert abs(at_zero - 3.0) < 0.1  # the grid of 200 points up to 6
