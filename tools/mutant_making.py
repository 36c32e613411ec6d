"""Mutants of a Python source: the same text with one small fault in it.

A fault replaces the bytes of one node or one operator, so that every other byte stays as it was.
No fault is made where a test has nothing to see: in docstrings, annotations, aliases of types,
imports, decorators, f-strings, assertions, lines of the log and what an exception says. Strings
are left alone altogether.

Which mutants are drawn depends on the seed and on the sources, and on nothing else. Each has a name
that holds no number of a line, so it is drawn again after lines above it have moved.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
import warnings
from bisect import bisect_left
from collections import Counter
from collections.abc import Iterator, Mapping
from hashlib import sha256
from typing import NamedTuple, cast

Function = ast.FunctionDef | ast.AsyncFunctionDef
Change = tuple[int, int, str]  # first byte, byte behind the last one, and the new text

COMPARED: dict[type[ast.cmpop], tuple[str, ...]] = {
    ast.Lt: ("<", "<=", ">="),
    ast.LtE: ("<=", "<", ">"),
    ast.Gt: (">", ">=", "<="),
    ast.GtE: (">=", ">", "<"),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.Is: ("is", "is not"),
    ast.IsNot: ("is not", "is"),
    ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"),
}
CALCULATED: dict[type[ast.operator], tuple[str, str]] = {
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.FloorDiv: ("//", "*"),
    ast.Mod: ("%", "*"),
    ast.Pow: ("**", "*"),
    ast.LShift: ("<<", ">>"),
    ast.RShift: (">>", "<<"),
    ast.BitAnd: ("&", "|"),
    ast.BitOr: ("|", "&"),
    ast.BitXor: ("^", "&"),
}
PAIRS = ("min max", "minimum maximum", "argmin argmax", "any all", "floor ceil", "add discard")
SWAPPED = {a: b for pair in PAIRS for a, b in (pair.split(), reversed(pair.split()))}
DEFAULTS = {"bool": "False", "int": "0", "float": "0.0", "str": '""', "bytes": 'b""'}

LOGS = re.compile(r"(_?log|_?logger|logging|warnings)\.\w+\(", re.IGNORECASE)
TYPES = re.compile(r"(\w+\.)*(tuple|list|dict|set|frozenset|type|[A-Z][a-z]\w*)\[")
NEVER_RUN = re.compile(r"TYPE_CHECKING\b|__name__ ==")
UNSEEN = (ast.Raise, ast.Assert, ast.JoinedStr, ast.Import, ast.ImportFrom)
UNSEEN_FIELDS = {"annotation", "returns", "decorator_list", "bases", "type_params"}


class Mutant(NamedTuple):
    """One fault.

    Args:
        path: Path of the source, from the root of the checkout.
        scope: Names of the classes and functions around it, with points; empty in a module's body.
        line: On which it begins, from 1.
        lines: First and last line of its statement; of one with a body, those above the body.
        start: First byte that is replaced.
        end: Byte behind the last one.
        before: Text that is replaced.
        after: What stands there instead.
        at_import: The line runs when its module is imported, and in no test.
        name: The same for the same fault, wherever its line has moved; see the module.
    """

    path: str
    scope: str
    line: int
    lines: tuple[int, int]
    start: int
    end: int
    before: str
    after: str
    at_import: bool
    name: str

    def applied(self, source: bytes) -> bytes:
        """The source with the fault in it."""
        return source[: self.start] + self.after.encode() + source[self.end :]


def mutants(path: str, source: bytes) -> list[Mutant]:
    """All mutants of a source, in the order of its lines; some of them may not compile."""
    return list(_Maker(path, source).made())


def is_valid(mutant: Mutant, source: bytes) -> bool:
    """Whether the mutant compiles without a warning: a warning fails any test, by our settings."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            compile(mutant.applied(source), mutant.path, "exec", dont_inherit=True)
        except (SyntaxError, ValueError):
            return False
    return True


def sample(sources: Mapping[str, bytes], count: int, seed: int) -> list[Mutant]:
    """Draw up to `count` valid mutants, at most one of a line, or crowded lines would rule.

    A larger count adds to the mutants of a smaller one.
    """

    def drawn(mutant: Mutant) -> bytes:
        return sha256(f"{seed} {mutant.name}".encode()).digest()

    every = (mutant for path in sorted(sources) for mutant in mutants(path, sources[path]))
    chosen: dict[tuple[str, int], Mutant] = {}
    for mutant in sorted(every, key=drawn):
        if len(chosen) == count:
            break
        place = (mutant.path, mutant.line)
        if place not in chosen and is_valid(mutant, sources[mutant.path]):
            chosen[place] = mutant
    return list(chosen.values())


class _Maker:
    """Walks through one source."""

    def __init__(self, path: str, source: bytes) -> None:
        self.path, self.source = path, source
        self.lines = source.splitlines(keepends=True)
        self.line_starts = [0]
        for line in self.lines:
            self.line_starts.append(self.line_starts[-1] + len(line))
        self.words: list[tuple[int, int, str]] = []  # first byte, byte behind the last, text
        for token in tokenize.generate_tokens(io.StringIO(source.decode()).readline):
            if token.type in (tokenize.OP, tokenize.NAME):
                row, column = token.start
                start = self.line_starts[row - 1] + len(token.line[:column].encode())
                self.words.append((start, start + len(token.string.encode()), token.string))
        self.seen = Counter[str]()
        self.lines_of_statement = (1, 1)

    def made(self) -> Iterator[Mutant]:
        yield from self._walk(ast.parse(self.source), "", None)

    def _walk(self, node: ast.AST, scope: str, function: Function | None) -> Iterator[Mutant]:
        if self._is_unseen(node):
            return
        if isinstance(node, ast.stmt):
            self.lines_of_statement = _lines(node)
        for change in self._changes(node, function):
            yield self._mutant(change, scope, function)
        inside = scope
        if isinstance(node, ast.ClassDef | Function):
            inside = f"{scope}.{node.name}".lstrip(".")
        unseen = {id(part) for field in UNSEEN_FIELDS for part in _parts(node, field)}
        for child in ast.iter_child_nodes(node):
            if id(child) not in unseen:
                # A function's statements run in it; defaults of its arguments are found before.
                runs = isinstance(node, Function) and isinstance(child, ast.stmt)
                yield from self._walk(child, inside, cast(Function, node) if runs else function)

    def _is_unseen(self, node: ast.AST) -> bool:
        match node:
            case ast.If(test=test):
                return NEVER_RUN.search(self._text(test)) is not None
            case ast.Call():
                return LOGS.match(self._text(node)) is not None
            case ast.Expr(value=ast.Call() as call):
                return LOGS.match(self._text(call)) is not None
            case ast.Subscript() if TYPES.match(self._text(node)):
                # Of `Annotated` the calls remain: what they demand is no type.
                return not any(isinstance(inner, ast.Call) for inner in ast.walk(node))
            case ast.Assign(targets=[ast.Name(id="__all__" | "__slots__")]):
                return True
            case ast.AnnAssign(annotation=annotation):
                return "TypeAlias" in self._text(annotation)
            case _:
                return isinstance(node, UNSEEN) or type(node).__name__ == "TypeAlias"

    def _changes(self, node: ast.AST, function: Function | None) -> Iterator[Change]:
        match node:
            case ast.Compare(left=left, ops=operators, comparators=right):
                for operator, operand in zip(operators, [left, *right], strict=False):
                    yield from self._swapped(operand, *COMPARED[type(operator)])
            case ast.BinOp(left=left, op=operator) if type(operator) in CALCULATED:
                # Outside functions `|` joins types.
                if function or not isinstance(operator, ast.BitOr):
                    yield from self._swapped(left, *CALCULATED[type(operator)])
            case ast.AugAssign(target=target, op=operator):
                if type(operator) in CALCULATED:
                    old, new = CALCULATED[type(operator)]
                    yield from self._swapped(target, f"{old}=", f"{new}=")
                yield self._replaced(node, "pass")
            case ast.BoolOp(op=operator, values=values):
                old, new = ("and", "or") if isinstance(operator, ast.And) else ("or", "and")
                for value in values[:-1]:
                    yield from self._swapped(value, old, new)
            case ast.UnaryOp(op=ast.Not() | ast.USub()):
                start, end = self._span(node)
                sign = re.match(rb"(not\b|-)\s*", self.source[start:end])
                if sign:
                    yield start, start + sign.end(), ""
            case ast.If(test=test) | ast.While(test=test) | ast.IfExp(test=test):
                yield from self._negated(test)
            case ast.comprehension(ifs=tests):
                for test in tests:
                    yield from self._negated(test)
            case ast.Constant(value=value):
                yield from self._other_values(node, value)
            case ast.Call(func=ast.Name() | ast.Attribute() as called):
                end = self._span(called)[1]
                name = called.id if isinstance(called, ast.Name) else called.attr
                if name in SWAPPED:
                    yield end - len(name), end, SWAPPED[name]
            case ast.Return(value=ast.expr() as value):
                hint = function.returns if function else None
                default = DEFAULTS.get(self._text(hint), "None") if hint else "None"
                if self._text(value) != default:
                    yield self._replaced(value, default)
            case ast.Expr(value=ast.Call() | ast.Await()):
                yield self._replaced(node, "pass")
            case ast.Assign(targets=[ast.Attribute() | ast.Subscript()]):
                if function and function.name != "__init__":  # there it fails at the first use
                    yield self._replaced(node, "pass")
            case ast.Break():
                yield self._replaced(node, "continue")
            case ast.Continue():
                yield self._replaced(node, "break")
            case _:
                pass

    def _swapped(self, operand: ast.expr, old: str, *new: str) -> Iterator[Change]:
        """The operator behind an operand, and what it becomes."""
        words = old.split()
        at = bisect_left(self.words, (self._span(operand)[1], 0, ""))
        while self.words[at][2] != words[0]:  # brackets that close behind the operand
            at += 1
        for text in new:
            yield self.words[at][0], self.words[at + len(words) - 1][1], text

    def _negated(self, test: ast.expr) -> Iterator[Change]:
        if not (isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not)):
            yield self._replaced(test, f"(not ({self._text(test)}))")

    def _other_values(self, node: ast.expr, value: object) -> Iterator[Change]:
        if isinstance(value, bool):
            yield self._replaced(node, str(not value))
        elif isinstance(value, int):
            yield self._replaced(node, str(value + 1))
            if value > 0:
                yield self._replaced(node, str(value - 1))
        elif isinstance(value, float) and value < 1e300:
            yield self._replaced(node, repr(2.0 * value or 1.0))

    def _span(self, node: ast.expr | ast.stmt) -> tuple[int, int]:
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        starts = self.line_starts
        start = starts[node.lineno - 1] + node.col_offset
        return start, starts[node.end_lineno - 1] + node.end_col_offset

    def _text(self, node: ast.expr | ast.stmt) -> str:
        start, end = self._span(node)
        return self.source[start:end].decode()

    def _replaced(self, node: ast.expr | ast.stmt, after: str) -> Change:
        return *self._span(node), after

    def _mutant(self, change: Change, scope: str, function: Function | None) -> Mutant:
        start, end, after = change
        row = bisect_left(self.line_starts, start + 1)
        line = self.lines[row - 1]
        column = start - self.line_starts[row - 1] - (len(line) - len(line.lstrip()))
        before = self.source[start:end].decode()
        name = f"{self.path} {scope} {line.decode().strip()!r} {column} {before!r} -> {after!r}"
        self.seen[name] += 1
        name = f"{name} {self.seen[name]}"
        place = (self.path, scope, row, self.lines_of_statement, start, end)
        return Mutant(*place, before, after, function is None, name)


def _parts(node: ast.AST, field: str) -> list[object]:
    """What stands in a field of a node."""
    value: object = getattr(node, field, None)
    return [*cast(list[object], value)] if isinstance(value, list) else [value]


def _lines(statement: ast.stmt) -> tuple[int, int]:
    """First and last line; of a statement with a body, those above the body."""
    first, body = statement.lineno, getattr(statement, "body", None)
    return first, max(first, body[0].lineno - 1) if body else statement.end_lineno or first
