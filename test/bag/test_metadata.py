# SPDX-License-Identifier: Apache-2.0
"""metadata.yaml: readable by every parser, and not parsed if it equals the record in the recording's file."""

from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

from conveyor_sim.bag.mcap.metadata import FILE_NAME, from_yaml, is_stated_in, read_metadata, to_yaml, write_metadata
from conveyor_sim.bag.messages.qos import LATCHED
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.errors import BagError

AWKWARD = [
    "",
    "null",
    "Yes",
    "12",
    "1.5",
    "-",
    "~",
    "it's",
    "a: b",
    "a #b",
    "ä b_0.mcap",
    "two\nlines",
    "../x",
    '"',
    "{}",
]


@pytest.mark.parametrize(
    "value",
    [
        AWKWARD,
        dict.fromkeys(AWKWARD[2:], "x"),
        {"none": None, "yes": True, "no": False, "number": -3, "empty": [], "nothing": {}},
        [{"a": [{"b": 1, "c": ["d"]}, "e"], "f": {"g": {"h": "i"}}}],
        [LATCHED.as_rosbag2()],
    ],
)
def test_a_yaml_parser_reads_what_was_written(value: Any) -> None:
    assert YAML(typ="safe").load(to_yaml(value)) == value


def recorded(folder: Path) -> Path:
    with Recorder(folder, topics=["guard"]):
        pass
    return next(folder.glob("*.mcap"))


def test_it_is_the_text_that_the_file_states(tmp_path: Path) -> None:
    """It is parsed for a file with another name, and if a letter of it has changed."""
    file = recorded(tmp_path / "run")
    assert is_stated_in(file)
    assert not is_stated_in(file.rename(file.with_name("other.mcap")))
    with pytest.raises(BagError, match="does not fit"):
        open_bag(file.parent)


def test_a_changed_one_is_parsed(tmp_path: Path) -> None:
    file = recorded(tmp_path / "run")
    beside = file.parent / FILE_NAME
    beside.write_text(beside.read_text().replace("cdr", "xml", 1))
    assert not is_stated_in(file)
    write_metadata(file.parent, to_yaml({"relative_file_paths": ["else.mcap"], "files": []}))
    assert not is_stated_in(file)
    assert read_metadata(file.parent) == {"relative_file_paths": ["else.mcap"], "files": []}


def test_a_file_name_that_is_not_utf8_is_read_as_it_was_written() -> None:
    information = {"relative_file_paths": ["\udcff_0.mcap"], "count": 12}
    assert from_yaml(to_yaml(information)) == information


@pytest.mark.parametrize("rest", ["b: 2020-13-45", f"b: {'[' * 5000}", "b: [}"], ids=["date", "nested", "bracket"])
def test_damaged_text_with_such_a_name_is_no_metadata(rest: str) -> None:
    assert from_yaml(f'a: "\\uDCFF"\n{rest}\n') is None
