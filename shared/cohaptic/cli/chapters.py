"""Help of a command: its options in chapters, first those that most people need.

typer's own boxes take twice the lines, and read `[s]` in a sentence as a style.
"""

from __future__ import annotations

import re
from typing import Any

from typer.core import TyperCommand

FIRST = "Options"
_LIST = re.compile(r"<list\[(\w+)\]>")  # an option that may be given several times
_IN_PARENTHESES = re.compile(r"\[default: \((.*)\)\]$", re.S)


class ChapterCommand(TyperCommand):
    """A command whose options are told by chapters: the `rich_help_panel` of each.

    The chapters come in the order in which the command's options name them; options without one
    are before all others.
    """

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write arguments and options, as click calls it."""
        chapters: dict[str, list[tuple[str, str]]] = {"Arguments": [], FIRST: []}
        for param in self.get_params(ctx):
            record = param.get_help_record(ctx)
            if record is None:
                continue
            name, text = record
            name = _LIST.sub(r"<\1>", name)
            named = getattr(param, "rich_help_panel", None)
            title = named or ("Arguments" if param.param_type_name == "argument" else FIRST)
            # A default in words comes in parentheses.
            told = _IN_PARENTHESES.sub(r"[default: \1]", text)
            chapters.setdefault(title, []).append((name, told))
        for title, records in chapters.items():
            if records:
                with formatter.section(title):
                    formatter.write_dl(records)
