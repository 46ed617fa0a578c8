"""The command `iapb`: every command is one file in reports/commands and one line here."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable
from functools import wraps
from importlib import import_module
from typing import Any

import typer

from iapb.errors import ArgumentError, IapbError

# command -> module of reports.commands that holds a function of the same name
COMMANDS = ("run", "live", "effects", "inspect", "schema", "prove", "verify", "compare", "bench", "sweep", "store",
            "reproduce", "report")

app = typer.Typer(
    name="iapb", add_completion=False, no_args_is_help=True, pretty_exceptions_enable=False,
    help="Rigid contact by impulses where a contact is new and penalties while it lasts: simulate scenes, prove and "
         "test passivity, compare with complementarity, regenerate the paper's figures.",
    epilog="Start with: iapb run peg_corner",
)  # fmt: skip


class _Options:
    """Options before the command."""

    debug = False


@app.callback()
def _before(debug: bool = typer.Option(False, "--debug", help="Show the traceback of an error.")) -> None:
    _Options.debug = debug


def _register(name: str) -> None:
    module = import_module(f"reports.commands.{name}")
    command: Callable[..., Any] = getattr(module, name)
    app.command(name)(_abortable(command))


def _abortable(command: Callable[..., Any]) -> Callable[..., Any]:
    """Turn Ctrl-C into Abort, which typer hands on to `main`; by itself it would end with 130 and say nothing."""

    @wraps(command)
    def call(*arguments: Any, **options: Any) -> Any:
        try:
            return command(*arguments, **options)
        except KeyboardInterrupt:
            raise typer.Abort from None

    return call


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit status: 0 done, 1 a named error, 2 wrong usage, 130 interrupted."""
    given = sys.argv[1:] if arguments is None else arguments
    if arguments is None:
        signal.signal(signal.SIGTERM, _end_politely)
    try:
        _refuse_empty(given)
        for name in COMMANDS:
            if name not in {command.name for command in app.registered_commands}:
                _register(name)
        status = app(args=given, standalone_mode=False)
    except KeyboardInterrupt:
        print("iapb: stopped; what was finished is kept.", file=sys.stderr)
        status = 130
    except (IapbError, OSError) as error:
        if _Options.debug:
            raise
        print(f"iapb: {_sentence(error)}", file=sys.stderr)
        status = 1
    except Exception as error:
        status = _usage(error)
    if arguments is None:
        sys.exit(status or 0)
    return status or 0


def _end_politely(*_: object) -> None:
    """SIGTERM, as of a batch system or a time limit, counts as Ctrl-C: files are kept. In the background, where a shell
    ignores Ctrl-C, it does too."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        raise KeyboardInterrupt
    signal.raise_signal(signal.SIGINT)


def _refuse_empty(arguments: list[str]) -> None:
    """Refuse an empty value, as a shell makes of a variable that is not set: as a path it would be this folder."""
    for i, text in enumerate(arguments):
        before = arguments[i - 1] if i and arguments[i - 1].startswith("--") else f"argument {i + 1}"
        name = before if not text else text[:-1]
        if not text or (text.startswith("--") and text.find("=") == len(text) - 1):
            raise ArgumentError(name, "", "a value that is not empty (a shell variable that is not set?)")


def _sentence(error: IapbError | OSError) -> str:
    """What went wrong; an error of the system as "file: why", without its number."""
    if isinstance(error, OSError) and error.filename is not None and error.strerror:
        return f"{error.filename}: {error.strerror}"
    return str(error)


def _usage(error: Exception) -> int:
    """Print a mistake in the command line and return its status; anything else is a fault of ours.

    Such a mistake is known by its `show` and `exit_code`: typer brings a click of its own, or uses the one installed.
    """
    if isinstance(error, typer.Abort):
        print("iapb: stopped; what was finished is kept.", file=sys.stderr)
        return 130
    show, status = getattr(error, "show", None), getattr(error, "exit_code", None)
    if show is None or status is None:
        raise error
    show(file=sys.stderr)
    return int(status)


if __name__ == "__main__":
    main()
