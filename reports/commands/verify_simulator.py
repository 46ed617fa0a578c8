"""`iapb verify --simulator mujoco`: engines on the fixed scenes, in sentences and a table, with their settings."""

from __future__ import annotations

from collections.abc import Sequence

from verification.engines.record import EngineRecord


def verify_simulators(simulators: Sequence[str], scenes: Sequence[str]) -> None:
    """Run the scenes and print what came of them; `all` names every engine.

    Raises
    ------
    MissingDependencyError
        An engine that was asked for by name is not installed.
    """
    from reference.simulators import FIXED_SCENES, SIMULATORS, find_simulator, fixed_scene
    from reports.commands.progress import stage_progress
    from verification.engines import SETTINGS, compare_engines, sentence

    names = list(SIMULATORS) if "all" in simulators else list(dict.fromkeys(simulators))
    chosen = list(dict.fromkeys(scenes)) or list(FIXED_SCENES)
    for scene in chosen:
        fixed_scene(scene)  # a wrong name is told before anything runs
    for name in names:
        simulator = find_simulator(name)
        if "all" not in simulators:
            simulator.version()
    with stage_progress() as progress:
        records = compare_engines(names, chosen,
                                  progress=lambda done, total: progress("pairs of engine and scene", done, total))
    for name in names:
        for choice in SETTINGS:
            of_engine = [record for record in records if record.engine == name and record.choice == choice]
            print(sentence(of_engine))
            if of_engine[0].missing:
                break
    present = [record for record in records if not record.missing]
    if present:
        _table(present)
        _settings(present)


def _table(records: Sequence[EngineRecord]) -> None:
    from verification.engines import verdict

    print(f"\n{'engine':<11}{'scene':<24}{'settings':<9}{'law':<8}{'energy':>10}{'rise':>10}{'momentum':>10}"
          f"{'velocity':>10}{'depth [m]':>10}{'drift [m]':>10}")  # fmt: skip
    for record in records:
        numbers = (record.energy_error, record.energy_gain, record.momentum_error, record.velocity_error,
                   record.penetration, record.drift)  # fmt: skip
        print(f"{record.engine:<11}{record.scene:<24}{record.choice:<9}{verdict(record):<8}"
              + "".join(f"{'-' if number is None else format(number, '.1e'):>10}" for number in numbers))  # fmt: skip
        if record.failure:
            print(f"{'':<11}{record.failure}")


def _settings(records: Sequence[EngineRecord]) -> None:
    print("\nSettings:")
    for settings in dict.fromkeys(f"{record.engine}: {record.settings}" for record in records):
        used = [record for record in records if f"{record.engine}: {record.settings}" == settings]
        print(f"  {settings}")
        print(f"    in {', '.join(dict.fromkeys(f'{record.scene} ({record.choice})' for record in used))}")
    for note in dict.fromkeys(f"{record.title}: {record.note}" for record in records if record.note):
        print(f"  {note}.")
