# SPDX-License-Identifier: Apache-2.0
"""JSON with a checksum: every flipped bit is detected, and all content errors are one sentence."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from facts import stating

from conveyor_sim.support.checked_json import DEEPEST, read_checked, with_checksum
from conveyor_sim.support.files import FileError

DATA = {"a": 1, "b": [0.1, -0.0, "\u00fc", None, True], "c": {"d": {}}}


@pytest.mark.parametrize("indent", [None, 1])
def test_what_is_read_is_what_was_written(tmp_path: Path, indent: int | None) -> None:
    (tmp_path / "file").write_bytes(with_checksum(DATA, indent))
    kept = read_checked(tmp_path / "file")
    assert repr(kept.data) == repr(DATA) and kept.has_checksum
    assert json.loads((tmp_path / "file").read_text())["b"] == DATA["b"]
    (tmp_path / "file").write_text(json.dumps(DATA))
    assert not read_checked(tmp_path / "file").has_checksum


def test_every_flipped_bit_and_cut_is_found(tmp_path: Path) -> None:
    """Or the file is one without a checksum that has a field of a strange name, which its reader refuses."""
    content = with_checksum(DATA)
    for place in range(len(content)):
        for bit in (place % 8, (place + 5) % 8):
            damaged = bytearray(content)
            damaged[place] ^= 1 << bit
            (tmp_path / "file").write_bytes(damaged)
            try:
                kept = read_checked(tmp_path / "file")
            except FileError:
                continue
            assert not kept.has_checksum and kept.data.keys() != DATA.keys(), (place, bit)
        (tmp_path / "file").write_bytes(content[:place])
        with pytest.raises(FileError):
            read_checked(tmp_path / "file")


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"", "line 1: Expecting value"),
        (b'{"a": 1,\n}', "line 2: "),
        (b"\xff", "is no text in UTF-8"),
        (b"[1]", "is no mapping of fields"),
        (b"[" * 1_000_000, f"is nested more than {DEEPEST} levels deep"),
        (b'{"a":' * 40 + b"1" + b"}" * 40, f"is nested more than {DEEPEST} levels deep"),
        (b'{"a": 1, "a": 2}', "has the field 'a' twice"),
        (b'{"b": {"a": 1, "a": 1}}', "has the field 'a' twice"),
        (b'{"a": NaN}', "has the number NaN"),
        (b'{"a": -Infinity}', "has the number -Infinity"),
        (b'{"a": 1e999}', "has a number beyond the range of 64 bits"),
        (b'{"a": ' + b"9" * 5000 + b"}", "has a number that can't be read"),
        (b'{"a": ' + b"9" * 400 + b"}", "has a whole number of more than 300 digits"),
        (b'{"a": "\\ud800"}', "has a text with half a character"),
        (b'{"a": 1, "sha256": "0"}', "its checksum does not fit"),
        (with_checksum(DATA) + b" ", "its checksum does not fit"),
        (with_checksum({"sha256": "x", "a": 1}), "has the field 'sha256' twice"),
    ],
)
def test_what_can_not_be_is_refused_in_words(tmp_path: Path, content: bytes, told: str) -> None:
    (tmp_path / "file").write_bytes(content)
    with pytest.raises(FileError) as caught:
        read_checked(tmp_path / "file")
    assert str(caught.value).startswith(told)


def test_a_file_is_bounded_and_regular(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(with_checksum(DATA))
    with pytest.raises(FileError, match=stating("0.000143 MB", "more than", "1e-05 MB")):
        read_checked(tmp_path / "file", most=10)
    for place, told in (
        (tmp_path, "is a folder"),
        (tmp_path / "nowhere", "no such file"),
        (Path("/dev/zero"), "device"),
    ):
        with pytest.raises(FileError, match=told):
            read_checked(place)


def test_numbers_that_are_not_finite_are_read_where_they_can_be(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(with_checksum({"a": [math.nan, math.inf, -math.inf]}))
    found = read_checked(tmp_path / "file", finite=False).data["a"]
    assert math.isnan(found[0]) and found[1:] == [math.inf, -math.inf]
