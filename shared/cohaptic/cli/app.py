"""The command line `cohaptic`, with the subcommands that the installed packages add.

The help of a command groups the options in chapters, the options that most people need first. The
boxes of typer would take twice as many lines and interpret `[s]` in a sentence as a style.

Server and client register their commands as entry points; this module imports neither of them, so
that the direction of imports holds and a client-only install needs no server code.
"""

from __future__ import annotations

import io
import os
import re
import sys
import traceback
from importlib.util import find_spec
from types import FunctionType
from typing import Any

import typer
from typer.core import TyperCommand

from cohaptic import __version__, compiled
from cohaptic.errors import CohapticError, SettingError, one_line
from cohaptic.extensions import CLIENT, OURS, ExtensionError, added, load
from cohaptic.runtime.heeded import signals_heeded

FIRST = "Options"
_LIST = re.compile(r"<list\[([\w|]+)\]>")  # an option that may be given several times
_IN_PARENTHESES = re.compile(r"\[default: \((.*)\)\]$", re.S)


class ChapterCommand(TyperCommand):
    """A command whose help groups the options in chapters, by the `rich_help_panel` of each option.

    The order of the chapters is that in which the command's options name them; options without a
    chapter come first.
    """

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write arguments and options into the help; click calls this method."""
        chapters: dict[str, list[tuple[str, str]]] = {"Arguments": [], FIRST: []}
        for param in self.get_params(ctx):
            record = param.get_help_record(ctx)
            if record is None:
                continue
            name, text = record
            name = _LIST.sub(r"<\1>", name)
            named = getattr(param, "rich_help_panel", None)
            title = named or ("Arguments" if param.param_type_name == "argument" else FIRST)
            # click puts a default in words into parentheses.
            reported = _IN_PARENTHESES.sub(r"[default: \1]", text)
            chapters.setdefault(title, []).append((name, reported))
        for title, records in chapters.items():
            if records:
                with formatter.section(title):
                    formatter.write_dl(records)


def main(argv: list[str] | None = None) -> None:
    """Run the command line `cohaptic`.

    Args:
        argv: Arguments after the program's name; None for those of the process.
    """
    if argv is None:
        # Child processes must not import modules from the current folder.
        os.environ["PYTHONSAFEPATH"] = "1"
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # A name of a file may hold what the terminal's encoding has not.
            stream.reconfigure(errors="backslashreplace")
    with signals_heeded():
        _run(sys.argv[1:] if argv is None else argv)


def _run(given: list[str]) -> None:
    own = given[: given.index("--")] if "--" in given else given
    arguments = [word for word in own if word != _WHOLE] + given[len(own) :]
    whole = _WHOLE in own
    try:
        _check_secrets()
        if arguments[:1] == ["touch"]:
            # This must precede the import of the modules. Other commands need the plain functions,
            # which numba compiles.
            compiled.use("loop")
        build_app(only=arguments[0] if arguments else None)(args=arguments, prog_name="cohaptic")
    except CohapticError as error:
        # An error raised on purpose is shown as one sentence, without a traceback.
        _tell(str(error), error, whole=whole)
        sys.exit(2)
    except MemoryError as error:
        _tell("the memory that this process may use does not suffice", error, whole=whole)
        sys.exit(2)
    except OSError as error:
        named = f": {error.filename}" if error.filename is not None else ""
        _tell(f"the system says: {error.strerror or error}{named}", error, whole=whole)
        sys.exit(2)
    except Exception as error:  # no error may reach a user as a traceback that was not asked for
        said = one_line(str(error)) or "no reason is given"
        problem = f"this is our bug: {type(error).__name__}: {said}"
        _tell(f"{problem}; please report it; {_WHOLE} prints the traceback too", error, whole=whole)
        sys.exit(_BUG)
    except KeyboardInterrupt:
        # Ctrl-C while modules are imported; later each command handles Ctrl-C in its own way.
        sys.exit(130)


def _printable(sentence: str) -> str:
    """Return a sentence, which may quote the name of a file, without codes for the terminal."""
    return "".join(c if c.isprintable() or c == "\n" else "?" for c in sentence)


def _tell(sentence: str, error: Exception, *, whole: bool) -> None:
    """Print an error as one sentence, after its traceback if the user has asked for that."""
    if whole:
        traceback.print_exception(error)
    typer.echo(f"cohaptic: {_printable(sentence)}", err=True)


def _check_secrets() -> None:
    """Raise SettingError if an environment variable for a secret is set but empty: a mistake."""
    for name in _SECRETS:
        if os.environ.get(name) == "":
            raise SettingError(
                f"the environment variable {name}", "empty", f"set, or not: unset {name}"
            )


def build_app(only: str | None = None) -> typer.Typer:
    """Make the typer application with the subcommands that installed packages add.

    Args:
        only: Name of the only subcommand to load, so that `touch` starts without the server's
            libraries; None, or a name that no package adds, to load all.
    """
    app = typer.Typer(
        help="Several people touch one soft object over a network and feel each other through it.",
        no_args_is_help=True,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )

    def version(value: bool) -> None:
        if value:
            typer.echo(f"cohaptic {__version__}")
            raise typer.Exit

    @app.callback()
    def root(  # pyright: ignore[reportUnusedFunction]  # typer keeps it
        _version: bool = typer.Option(
            False, "--version", callback=version, is_eager=True, help="Print the version and exit."
        ),
        _whole: bool = typer.Option(
            False, _WHOLE, help="Print the traceback of an error, in any command."
        ),
    ) -> None:
        """Several people touch one soft object over a network and feel each other through it."""

    names = sorted(added(_GROUP), key=lambda name: _ORDER.get(name, len(_ORDER)))
    if only and only[0] != "-" and only not in names and find_spec("cohaptic_server") is None:
        limit = f"one of {CLIENT}, that is {', '.join(sorted(names))}; for those of a server:"
        limit += f" pip uninstall {CLIENT}, then pip install {OURS}"
        raise SettingError("the command", only, limit)
    for name in [only] if only in names else names:
        try:
            command = load(_GROUP, name, typer.Typer, FunctionType)
        except ExtensionError as error:
            if name == only:
                raise
            typer.echo(f"cohaptic: {error}", err=True)  # the other commands still work
            continue
        if isinstance(command, typer.Typer):
            app.add_typer(command, name=name)
        else:
            app.command(name=name, cls=ChapterCommand)(command)
    return app


_WHOLE = "--traceback"  # taken from anywhere on a command line, before the command reads it
_BUG = 70  # exit status of an internal error, EX_SOFTWARE of BSD's sysexits.h
_GROUP = "cohaptic.commands"  # of entry points, each a function or a typer.Typer
_SECRETS = ("COHAPTIC_KEYS", "COHAPTIC_TOKEN")
_ORDER = {"demo": 0, "serve": 1, "touch": 2, "body": 3, "stability": 4}  # in a newcomer's order
