"""Help of a command with its options in chapters; options that most people need come first.

The boxes of typer take twice as many lines and interpret `[s]` in a sentence as a style.
"""

from __future__ import annotations

import re
from typing import Any

from typer.core import TyperCommand

FIRST = "Options"
_LIST = re.compile(r"<list\[(\w+)\]>")  # an option that may be given several times
_IN_PARENTHESES = re.compile(r"\[default: \((.*)\)\]$", re.S)


class ChapterCommand(TyperCommand):
    """A command whose help groups the options in chapters, by the `rich_help_panel` of each.

    The chapters come in the order in which the command's options name them; options without a
    chapter come before all others.
    """

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write arguments and options; click calls this method."""
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
            told = _IN_PARENTHESES.sub(r"[default: \1]", text)
            chapters.setdefault(title, []).append((name, told))
        for title, records in chapters.items():
            if records:
                with formatter.section(title):
                    formatter.write_dl(records)
