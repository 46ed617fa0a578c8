"""The command `iapb`: each subcommand is one file in reports/commands and one entry here."""

from __future__ import annotations

import json
import os
import re
import signal
import sys
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout, suppress
from functools import wraps
from importlib import import_module
from importlib.metadata import version
from itertools import pairwise
from typing import Any, cast

import typer

from iapb.errors import ArgumentError, IapbError, RunFileError, harmless, name_the_extra

# heading in `iapb --help` -> command -> its line there. The module of that name in reports.commands,
# with _ for -, has a function with the same name. Only the module of the given command is imported;
# `iapb --help` imports none.
GROUPS: dict[str, dict[str, str]] = {
    "Simulate": {
        "run": "Simulate SCENE and store the run as HDF5. An existing run is reused.",
        "check": "Warn of problems that would make a run of SCENE worthless, with values to set; end with 3 then.",
        "scenes": "List the scenes that come with the project: their names, and what they show.",
        "schema": "Print the JSON Schema of scene files (for completion and checks in an editor).",
        "effects": "List every effect of SCENE: on or off, the reason, and what leaving it out would change.",
        "view": "Show SCENE in real time in a browser, with the mouse as the hand, and store the run.",
        "sweep": "Simulate every point of STUDY that has no run file yet, and write a table of all points.",
    },
    "Look at runs": {
        "inspect": "Describe a run: scene, law, collisions, energy, effects, provenance and hashes.",
        "certify": "Judge every recorded impact exactly: energy gain, and whether impulses and "
        "velocities are consistent.",
        "compare": "Compare worlds on SCENE: distances, energy, time, and IAPB's impacts with the LCP's.",
        "store": "Check the run and table files below a folder, or simulate its runs again.",
    },
    "Verify": {
        "verify": "Test an impact resolver against every law; print the verdict, the worst case "
        "and a shrunk counterexample.",
        "port": "Search the motion of a hand that draws energy from a force law; draw the map of devices.",
        "verify-many": "Test the laws on many impacts and trajectories; Ctrl-C lists what was found.",
        "verify-world": "Put a world to the laws of trajectories on random scenes.",
        "solvers": "Put problem files to every complementarity solver; or compare IAPB with complementarity.",
        "prove": "Check every machine-checked statement, or print the proof of one.",
        "bench": "Name the method that solves most of nine hard impacts of a size within a time, measured now.",
    },
    "The paper": {
        "reproduce": "Regenerate the report; cached results are reused.",
        "report": "Compare the numbers of two reports: equal, within a tolerance, or different; "
        "end with 1 if some differ.",
    },
}
COMMANDS = [name for commands in GROUPS.values() for name in commands]

COMPLETION = "_IAPB_COMPLETE"  # set while a shell asks for completions
STOPPED = "stopped; files that were complete stay"


def _version(asked: bool) -> None:
    if asked:
        print(f"iapb {version('iapb')}")
        raise typer.Exit


def _before(
    debug: bool = typer.Option(False, "--debug", help="Show the traceback of an error."),
    version_: bool = typer.Option(
        False, "--version", help="Print the version.", callback=_version, is_eager=True
    ),
) -> None:
    """Take the options before the command; `main` looks for --debug itself."""


def _app(given: list[str]) -> typer.Typer:
    """Return the command line with all commands; only the given command can be called."""
    app = typer.Typer(
        name="iapb",
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        help="Rigid contact by impulses where a contact is new and penalties while it lasts: simulate scenes, prove "
        "and test passivity, compare with complementarity, regenerate the paper's figures.",
        epilog="Start with: iapb run peg_corner",
    )
    app.callback()(_before)
    if COMPLETION in os.environ:  # shell completion: the shell passes the words in a variable
        given = os.environ.get("COMP_WORDS", os.environ.get("_TYPER_COMPLETE_ARGS", "")).split()[1:]
    wanted = next((word for word in given if not word.startswith("-")), "")
    for group, commands in GROUPS.items():
        for name, words in commands.items():
            if name == wanted:
                app.command(name, rich_help_panel=group)(_answering(_command(name)))
            else:
                app.command(name, help=words, rich_help_panel=group)(_only_listed)
    return app


def _command(name: str) -> Callable[..., Any]:
    file = name.replace("-", "_")
    return cast(Callable[..., Any], getattr(import_module(f"reports.commands.{file}"), file))


def _only_listed() -> None:
    """Stand for a command in the help."""


def _answering(command: Callable[..., Any]) -> Callable[..., int]:
    """Print the answer of a command and return its status; Ctrl-C becomes typer.Abort, which
    reaches `main`."""

    @wraps(command)
    def call(*arguments: Any, **options: Any) -> int:
        try:
            answer = command(*arguments, **options)
        except KeyboardInterrupt:
            raise typer.Abort from None
        # colours of files do not pass, too
        print(harmless(answer.text(options.get("json_", False))), flush=True)
        return int(answer.status)

    return call


_COLOUR = re.compile(r"(\x1b\[[0-9;]*m)")  # colour sequences as rich prints them; they are harmless
_BARS = re.compile(r"(\x1b\[(?:[0-9;]*m|[0-9]*[ABK]|\?25[hl])|\r)")


class Harmless:
    """A text stream that escapes terminal control sequences, as ``\\x1b``, so that file contents
    cannot trigger them.

    Parameters
    ----------
    stream : the text stream to write to
    kept : matches, as one group, the control sequences that pass unchanged if the stream is a
        terminal
    """

    def __init__(self, stream: Any, kept: re.Pattern[str]) -> None:
        self._stream = stream
        self._kept = kept

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write a text; return its length."""
        parts = self._kept.split(text) if self._stream.isatty() else [text]
        self._try(
            self._stream.write,
            "".join(part if i % 2 else harmless(part) for i, part in enumerate(parts)),
        )
        return len(text)

    def flush(self) -> None:
        """Write what waits."""
        self._try(self._stream.flush)

    def _try(self, act: Callable[..., Any], *given: Any) -> None:
        """Write; a stream that nobody reads any more swallows the rest, as does a stderr that is
        full."""
        try:
            act(*given)
        except (OSError, ValueError) as error:
            with suppress(
                OSError, ValueError
            ):  # what waits is not tried again at the end of the process
                os.dup2(os.open(os.devnull, os.O_WRONLY), self._stream.fileno())
            if self._stream is sys.__stdout__ and not isinstance(error, BrokenPipeError):
                raise UnwritableError(
                    f"standard output: {getattr(error, 'strerror', None) or error}"
                ) from error


class UnwritableError(IapbError):
    """Standard output is full: no error of the file that is read or written meanwhile."""


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit status: 0 done, 1 a named error, 2 wrong usage, 3 a
    result that is not to be trusted, 130 interrupted."""
    if arguments is None:
        signal.signal(signal.SIGTERM, _end_politely)
        _open_closed_streams()
    out = cast(Any, Harmless(sys.stdout, _COLOUR))
    err = cast(Any, Harmless(sys.stderr, _BARS))
    with redirect_stdout(out), redirect_stderr(err):
        status = _status(sys.argv[1:] if arguments is None else arguments)
    if arguments is None:
        sys.exit(status)
    return status


def _named(given: list[str]) -> list[str]:
    """Return `verify --full` and `verify --world NAME` with the names of the commands that they
    mean."""
    for option, command in (("--full", "verify-many"), ("--world", "verify-world")):
        if given[:1] == ["verify"] and option in given:
            return [command, *(word for word in given[1:] if word != option)]
    return given


def _status(given: list[str]) -> int:
    """Run the command line and return its status. A usage error of typer's is known by its
    attributes, since typer has its own copy of click or the installed one; any other unnamed error
    is a bug and raised."""
    explained = False
    given = _named(given)
    try:
        _refuse_empty(given)
        return _app(given)(args=given, prog_name="iapb", standalone_mode=False) or 0
    except (KeyboardInterrupt, typer.Abort):
        status = 130
        said = STOPPED
    except (IapbError, OSError, ModuleNotFoundError) as missing:
        error = (
            name_the_extra(missing, "The command")
            if isinstance(missing, ModuleNotFoundError)
            else missing
        )
        if "--debug" in given or not isinstance(error, IapbError | OSError):
            raise
        status = 1
        said = str(error)
        if isinstance(error, RunFileError):  # a file's name may hold line ends
            said = "\\n".join(said.splitlines())
        if isinstance(error, OSError) and error.filename is not None and error.strerror:
            said = f"{error.filename}: {error.strerror}"
    except Exception as error:
        usage: Any = error
        if not (hasattr(usage, "show") and hasattr(usage, "exit_code")):
            raise
        usage.show(file=sys.stderr)
        status = usage.exit_code
        said = usage.format_message()
        explained = True
    if not explained:
        print(f"iapb: {harmless(said)}", file=sys.stderr)
    if "--json" in given:
        print(json.dumps({"error": said, "status": status}, indent=1, ensure_ascii=False))
    return status


def _open_closed_streams() -> None:
    """Give streams that the caller closed (``>&-``) a place: else the next file that is opened gets
    their number."""
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number
            mode = "w" if number else "r"
            stream = open(number, mode, encoding="utf-8", closefd=False)  # noqa: SIM115
            setattr(sys, name, stream)


def _end_politely(*_: object) -> None:
    """Handle SIGTERM (from a batch system or a time limit) like Ctrl-C, so that finished files are
    kept. This also works in a background job, where the shell makes the process ignore SIGINT."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        raise KeyboardInterrupt
    signal.raise_signal(signal.SIGINT)


def _refuse_empty(given: list[str]) -> None:
    """Refuse empty values: a shell makes one of an unset variable, and as a path it would mean this
    folder."""
    for i, (before, word) in enumerate(pairwise(["", *given]), 1):
        option, equals, value = word.partition("=") if word.startswith("--") else ("", "", "")
        if not word or (equals and not value):
            name = option or (before if before.startswith("--") else f"argument {i}")
            raise ArgumentError(
                name, "", "a value that is not empty (a shell variable that is not set?)"
            )


if __name__ == "__main__":
    main()
