from __future__ import annotations

import codecs
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import SettingError
from cohaptic.written import at_home, text_of

# A text that begins with the mark itself loses that one, as everywhere.
texts = st.text().filter(lambda text: "\r" not in text and not text.startswith("\ufeff"))


@given(texts, st.sampled_from(["\n", "\r\n"]))
def test_a_text_is_the_same_however_an_editor_has_saved_it(text: str, end: str) -> None:
    saved = text.replace("\n", end)
    assert text_of(saved.encode()) == text
    assert text_of(saved.encode("utf-8-sig")) == text
    assert text_of(codecs.BOM_UTF16_LE + saved.encode("utf-16-le")) == text
    assert text_of(codecs.BOM_UTF16_BE + saved.encode("utf-16-be")) == text


def test_what_is_no_text_is_an_error() -> None:
    for data in (b"\xff", b"\xff\xfea", codecs.BOM_UTF8 + b"\xc3"):
        with pytest.raises(UnicodeDecodeError):
            text_of(data)


def test_a_tilde_is_the_home_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("USERPROFILE", str(tmp_path))
    assert at_home(Path("~/keys")) == tmp_path / "keys"
    assert at_home(Path("a/~/b")) == Path("a/~/b")
    with pytest.raises(SettingError, match="that home is not known"):
        at_home(Path("~nobody-of-this-name/keys"))
