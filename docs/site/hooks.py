"""What mkdocs cannot do by itself: formulas as MathML, and the page of the command line.

MathML is part of the page. Every present browser shows it without a script, so that a page needs
nothing from elsewhere, also when it is read without a network.
"""

from __future__ import annotations

import re
from enum import Enum
from html import unescape
from typing import Any

import typer
from latex2mathml.converter import convert
from mkdocs.exceptions import PluginError

from cohaptic.cli.app import build_app

COMMANDS = "<!-- commands -->"
_FORMULA = re.compile(
    r'<(?P<tag>span|div) class="arithmatex">\\(?P<kind>[(\[])(?P<latex>.*?)\\[)\]]</(?P=tag)>', re.S
)


_BAR = re.compile(r'<mo stretchy="false">(&#x0007C;|&#x02016;|&#x02225;)</mo>')
_OPTION = re.compile(r"--[a-z][a-z-]*")


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Write the options of every command where a page asks for them."""
    if COMMANDS not in markdown:
        return markdown
    return markdown.replace(COMMANDS, command_reference())


def on_page_content(html: str, **_: Any) -> str:
    """Replace every formula of a page by MathML."""
    return _FORMULA.sub(_mathml, html)


def _mathml(formula: re.Match[str]) -> str:
    latex = unescape(formula["latex"]).strip()
    display = "inline" if formula["kind"] == "(" else "block"
    try:
        mathml = convert(latex, display=display)
    except Exception as error:
        raise PluginError(f"a formula cannot be read: {latex}") from error
    # A bar is an operator with space on both sides, unless it is told that it is a delimiter.
    return _BAR.sub(r'<mo stretchy="false" lspace="0" rspace="0">\1</mo>', mathml)


def command_reference() -> str:
    """Every command with its arguments and options, as Markdown."""
    group: Any = typer.main.get_command(build_app())
    return "\n\n".join(_command(group, ["cohaptic"]))


def _command(command: Any, path: list[str]) -> list[str]:
    """A command and its subcommands: heading, help text, table of options."""
    parts: list[str] = []
    if len(path) > 1:
        parts.append(f"{'#' * len(path)} `{' '.join(path)}`")
    for paragraph in (command.help or "").split("\n\n"):
        parts.append(_OPTION.sub(r"`\g<0>`", " ".join(paragraph.split())))
    rows = [_row(parameter) for parameter in command.params if not _is_hidden(parameter)]
    if rows:
        parts.append("\n".join(["| option | default | meaning |", "| --- | --- | --- |", *rows]))
    for name, child in getattr(command, "commands", {}).items():
        parts += _command(child, [*path, name])
    return parts


def _is_hidden(parameter: Any) -> bool:
    return getattr(parameter, "hidden", False) or parameter.name == "help"


def _row(parameter: Any) -> str:
    names = [*parameter.opts, *parameter.secondary_opts]
    if parameter.param_type_name == "argument":
        names = [(parameter.metavar or parameter.name).upper()]
    meaning = " ".join((getattr(parameter, "help", None) or "").split()).replace("|", "\\|")
    return f"| {', '.join(f'`{name}`' for name in names)} | {_default(parameter)} | {meaning} |"


def _default(parameter: Any) -> str:
    """The default of an option as a reader needs it; nothing for a flag that is off."""
    if parameter.required:
        return "required"
    value = parameter.default
    value = value.value if isinstance(value, Enum) else value
    is_nothing = value is None or value is False or value in ("", (), [])
    return "" if is_nothing else f"`{value:g}`" if isinstance(value, float) else f"`{value}`"
