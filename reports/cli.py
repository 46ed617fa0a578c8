"""The command `iapb`: each subcommand is one file in reports/commands and one entry here."""

from __future__ import annotations

import json
import os
import re
import signal
import sys
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from functools import wraps
from importlib import import_module
from importlib.metadata import version
from typing import Any, cast

import typer

from iapb.errors import ArgumentError, IapbError

# command -> its line in `iapb --help`. The module of that name in reports.commands has a function with the same name.
# Only the module of the given command is imported; `iapb --help` imports none.
COMMANDS = {
    "run": "Simulate SCENE and store the run as HDF5. An existing run is reused.",
    "check": "Warn of problems that would make a run of SCENE worthless, with values to set; end with 3 then.",
    "scenes": "List the scenes that come with the project: their names, and what they show.",
    "live": "Simulate SCENE in real time, report missed deadlines, and store the run and its tick times.",
    "effects": "List every effect of SCENE: on or off, the reason, and what leaving it out would change.",
    "inspect": "Describe a run: scene, law, collisions, energy, effects, provenance and hashes.",
    "certify": "Judge every recorded impact exactly: energy gain, and whether impulses and velocities are consistent.",
    "schema": "Print the JSON Schema of scene files (for completion and checks in an editor).",
    "prove": "Check every machine-checked statement, or print the proof of one.",
    "verify": "Test an impact resolver against every law; print the verdict, the worst case and a shrunk "
              "counterexample.",
    "compare": "Compare worlds on SCENE; without SCENE, IAPB with complementarity, and solvers on problem files.",
    "bench": "Time a step, an impact and a motion; compare with MuJoCo, Pinocchio, solvers and the printed formula.",
    "sweep": "Simulate every point of STUDY that has no run file yet, and write a table of all points.",
    "store": "Check, repair and clean up the run and table files below a folder.",
    "reproduce": "Regenerate the report; cached results are reused.",
    "report": "Compare the numbers of two reports: equal, within a tolerance, or different; end with 1 if some differ.",
}  # fmt: skip


# Many scenes share kernels compiled whole (see `iapb.compiled`); other commands compile what one scene needs.
MANY_SCENES = ("verify", "bench", "sweep", "store", "reproduce")

COMPLETION = "_IAPB_COMPLETE"  # set while a shell asks for completions


class _Options:
    """Options before the command."""

    debug = False


def _version(asked: bool) -> None:
    if asked:
        print(f"iapb {version('iapb')}")
        raise typer.Exit


def _before(
    debug: bool = typer.Option(False, "--debug", help="Show the traceback of an error."),
    version_: bool = typer.Option(False, "--version", help="Print the version.", callback=_version, is_eager=True),
) -> None:
    _Options.debug = debug


def _app(given: list[str]) -> typer.Typer:
    """Return the command line with all commands; only the given command can be called."""
    app = typer.Typer(
        name="iapb", no_args_is_help=True, pretty_exceptions_enable=False,
        help="Rigid contact by impulses where a contact is new and penalties while it lasts: simulate scenes, prove "
             "and test passivity, compare with complementarity, regenerate the paper's figures.",
        epilog="Start with: iapb run peg_corner",
    )  # fmt: skip
    app.callback()(_before)
    if COMPLETION in os.environ:  # shell completion: the shell passes the words in a variable
        given = os.environ.get("COMP_WORDS", os.environ.get("_TYPER_COMPLETE_ARGS", "")).split()[1:]
    wanted = next((word for word in given if not word.startswith("-")), "")
    if wanted in MANY_SCENES:
        os.environ.setdefault("IAPB_COMPILE", "whole")
    for name, words in COMMANDS.items():
        command = getattr(import_module(f"reports.commands.{name}"), name) if name == wanted else _not_given
        app.command(name, help=None if name == wanted else words)(_abortable(command))
    return app


def _not_given() -> None:
    """Do nothing; this is the placeholder for commands that are only listed in the help."""


def _abortable(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give the answer of a command; turn KeyboardInterrupt into typer.Abort, which reaches `main`."""

    @wraps(command)
    def call(*arguments: Any, **options: Any) -> Any:
        try:
            answer = command(*arguments, **options)
        except KeyboardInterrupt:
            raise typer.Abort from None
        if answer is not None:
            answer.give(options.get("json_", False))

    return call


# Terminal control characters and characters that reverse the direction of text; not tabs and line ends.
_ORDERS = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")
_COLOUR = re.compile(r"(\x1b\[[0-9;]*m)")  # colour sequences as rich prints them; they are harmless
_BARS = re.compile(r"(\x1b\[(?:[0-9;]*m|[0-9]*[ABK]|\?25[hl])|\r)")


class Harmless:
    """A text stream that escapes terminal control sequences, as ``\\x1b``, so that file contents cannot trigger them.

    Parameters
    ----------
    stream : the text stream to write to
    kept : matches, as one group, the control sequences that pass unchanged if the stream is a terminal
    """

    def __init__(self, stream: Any, kept: re.Pattern[str]) -> None:
        self._stream, self._kept = stream, kept

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write a text; return its length."""
        parts = self._kept.split(text) if self._stream.isatty() else [text]
        self._stream.write("".join(part if i % 2 else harmless(part) for i, part in enumerate(parts)))
        return len(text)


def harmless(text: str) -> str:
    """Return a text in which every terminal control character is escaped."""
    return _ORDERS.sub(lambda found: ascii(found[0])[1:-1], text)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit status: 0 done, 1 a named error, 2 wrong usage, 3 a result that is
    not to be trusted, 130 interrupted."""
    if arguments is None:
        signal.signal(signal.SIGTERM, _end_politely)
    out, err = cast(Any, Harmless(sys.stdout, _COLOUR)), cast(Any, Harmless(sys.stderr, _BARS))
    with redirect_stdout(out), redirect_stderr(err):
        status = _main(sys.argv[1:] if arguments is None else arguments)
    if arguments is None:
        sys.exit(status)
    return status


def _main(given: list[str]) -> int:
    try:
        _refuse_empty(given)
        status = _app(given)(args=given, prog_name="iapb", standalone_mode=False)
    except KeyboardInterrupt:
        status = _failed(given, 130, STOPPED)
    except (IapbError, OSError) as error:
        if _Options.debug:
            raise
        status = _failed(given, 1, _sentence(error))
    except Exception as error:
        status = _usage(given, error)
    return status or 0


STOPPED = "stopped; files that were complete stay"


def _failed(given: list[str], status: int, sentence: str) -> int:
    """Print an error and return the status. With --json, also print it as an object on standard output."""
    print(f"iapb: {harmless(sentence)}", file=sys.stderr)
    _as_json(given, status, sentence)
    return status


def _as_json(given: list[str], status: int, sentence: str) -> None:
    if "--json" in given:
        print(json.dumps({"error": sentence, "status": status}, indent=1, ensure_ascii=False))


def _end_politely(*_: object) -> None:
    """Handle SIGTERM (from a batch system or a time limit) like Ctrl-C, so that finished files are kept. This also
    works in a background job, where the shell makes the process ignore SIGINT."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        raise KeyboardInterrupt
    signal.raise_signal(signal.SIGINT)


def _refuse_empty(arguments: list[str]) -> None:
    """Refuse empty values: a shell makes one of an unset variable, and as a path it would mean this folder."""
    for i, text in enumerate(arguments):
        before = arguments[i - 1] if i and arguments[i - 1].startswith("--") else f"argument {i + 1}"
        name = before if not text else text[:-1]
        if not text or (text.startswith("--") and text.find("=") == len(text) - 1):
            raise ArgumentError(name, "", "a value that is not empty (a shell variable that is not set?)")


def _sentence(error: IapbError | OSError) -> str:
    """Return the message of an error; for an OSError "file: reason", without the error number."""
    if isinstance(error, OSError) and error.filename is not None and error.strerror:
        return f"{error.filename}: {error.strerror}"
    return str(error)


def _usage(given: list[str], error: Exception) -> int:
    """Print a usage error and return its status; raise any other error again, because it is a bug.

    Usage errors are recognised by their attributes `show` and `exit_code`, not by their class: typer uses either its
    own copy of click or the installed one.
    """
    if isinstance(error, typer.Abort):
        return _failed(given, 130, STOPPED)
    show, status = getattr(error, "show", None), getattr(error, "exit_code", None)
    if show is None or status is None:
        raise error
    show(file=sys.stderr)
    _as_json(given, int(status), str(getattr(error, "format_message", error.__str__)()))
    return int(status)


if __name__ == "__main__":
    main()
