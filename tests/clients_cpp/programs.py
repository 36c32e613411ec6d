"""The programs of `clients/cpp`, compiled by the compilers of this machine."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.give_up import give_up

SOURCES = Path(__file__).parents[2] / "clients" / "cpp"
COMPILERS = ("g++", "clang++")
STRICT = ("-std=c++17", "-Wall", "-Wextra", "-Werror", "-pedantic")
SANITISED = ("-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")


def compiler(name: str) -> str:
    """Path of a compiler; gives the test up where there is none."""
    path = shutil.which(name)
    if path is None:
        give_up(f"there is no compiler {name}: apt-get install {name.replace('clang++', 'clang')}")
    return path


def sanitising() -> str:
    """Path of a compiler whose sanitisers can be linked; gives the test up where there is none."""
    with tempfile.TemporaryDirectory() as folder:
        empty = Path(folder) / "empty.cpp"
        empty.write_text("int main() {}\n")
        for name in COMPILERS:
            path = shutil.which(name)
            out = ("-o", str(empty.with_suffix("")))
            linked = path and subprocess.run([path, *SANITISED, *out, str(empty)], check=False,
                                             capture_output=True).returncode == 0  # fmt: skip
            if path and linked:
                return path
    give_up("no compiler here links the address sanitiser: apt-get install g++")


def build(compiler: str, source: str, out: Path, *options: str) -> Path:
    """The program of a file of `clients/cpp`; a warning is an error."""
    command = [compiler, *STRICT, "-O1", *options, "-o", str(out), str(SOURCES / source)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return out


class Questions:
    """A running `vectors`, which answers each line with a line."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process

    def ask(self, about: str, *values: object) -> str:
        """The answer to a question; numbers go over with all their digits."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(" ".join([about, *_words(values)]) + "\n")
        self._process.stdin.flush()
        answer = self._process.stdout.readline()
        assert answer, f"vectors ended at: {about}"
        return answer.rstrip("\n")

    def numbers(self, about: str, *values: object) -> list[float]:
        """The numbers of the answer.

        Raises:
            ValueError: The answer is an error, with its words.
        """
        answer = self.ask(about, *values)
        if answer.startswith("error "):
            raise ValueError(answer)
        return [float(word) for word in answer.split()]


@contextmanager
def asked(program: Path) -> Generator[Questions]:
    """A `vectors` for as long as it is asked."""
    with subprocess.Popen(
        [program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        yield Questions(process)
        assert process.stdin is not None
        process.stdin.close()
        assert process.wait(60.0) == 0


def _words(values: Iterable[object]) -> Iterator[str]:
    for value in values:
        if isinstance(value, str):
            yield value
        elif isinstance(value, Iterable):
            yield from _words(value)  # pyright: ignore[reportUnknownArgumentType]
        else:
            assert isinstance(value, float | int)
            yield repr(float(value)) if not isinstance(value, bool) else str(int(value))
