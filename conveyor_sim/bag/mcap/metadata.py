# SPDX-License-Identifier: Apache-2.0
"""metadata.yaml of a rosbag2 folder, version 9 (Jazzy, Kilted): what `ros2 bag info` reads."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from os import SEEK_END
from pathlib import Path, PurePath
from textwrap import dedent, indent
from typing import Any

import yaml

from conveyor_sim.errors import BagError, SceneError
from conveyor_sim.scene.yaml_lines import Document
from conveyor_sim.support.files import FileError, write_file

FILE_NAME = "metadata.yaml"
VERSION = 9
SIZE_LIMIT = 1 << 24
"""Bytes of the file, at most."""
_BEHIND = 1 << 18
"""Bytes at the end of a recording's file, beside its metadata itself, that are searched for the metadata."""
_WIDTH = 1 << 30
"""Characters in a line, at most: no text is broken."""
_HEAD = "rosbag2_bagfile_information:\n"
RECORD_NAME = "rosbag2"
RECORD_KEY = "serialized_metadata"
"""Name and key of the MCAP metadata record that repeats this file's content."""


@dataclass(frozen=True)
class TopicInfo:
    """One recorded topic."""

    name: str
    """Absolute, with its leading slash."""
    type: str
    type_hash: str
    qos: Sequence[Mapping[str, Any]]
    """Offered profiles as rosbag2 writes them."""
    message_count: int


@dataclass(frozen=True)
class FileInfo:
    """One storage file of a bag, with the log times of its first and last message in ns (0 if it has none)."""

    path: str
    start_ns: int
    end_ns: int
    message_count: int


def bag_information(topics: Sequence[TopicInfo], files: Sequence[FileInfo], distro: str) -> dict[str, Any]:
    """Return the mapping under `rosbag2_bagfile_information`, in the order in which rosbag2 writes it."""
    filled = [file for file in files if file.message_count]
    start = min((file.start_ns for file in filled), default=0)
    end = max((file.end_ns for file in filled), default=0)
    return {
        "version": VERSION,
        "storage_identifier": "mcap",
        "duration": {"nanoseconds": end - start},
        "starting_time": {"nanoseconds_since_epoch": start},
        "message_count": sum(file.message_count for file in files),
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": topic.name,
                    "type": topic.type,
                    "serialization_format": "cdr",
                    "offered_qos_profiles": [dict(profile) for profile in topic.qos],
                    "type_description_hash": topic.type_hash,
                },
                "message_count": topic.message_count,
            }
            for topic in topics
        ],
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [file.path for file in files],
        "files": [
            {
                "path": file.path,
                "starting_time": {"nanoseconds_since_epoch": file.start_ns},
                "duration": {"nanoseconds": file.end_ns - file.start_ns},
                "message_count": file.message_count,
            }
            for file in files
        ],
        "custom_data": None,
        "ros_distro": distro,
    }


class _Dumper(yaml.SafeDumper):  # type: ignore[misc]
    """PyYAML's writer in Python: libyaml's (`CSafeDumper`) can't escape file names that are not UTF-8."""

    def ignore_aliases(self, data: Any) -> bool:
        """Return True: a value that occurs twice is written twice, because not every reader knows anchors."""
        return True


def to_yaml(value: Any) -> str:
    """Return block-style YAML text of mappings, sequences and scalars, in their order."""
    return str(yaml.dump(value, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=_WIDTH))


@lru_cache(maxsize=64)
def from_yaml(text: str) -> Any:
    """Parse YAML. Return None for text that is not YAML. Callers share the result and must not change it."""
    try:
        if "\\uDC" in text:  # a file name that is not UTF-8, which libyaml refuses
            return yaml.load(text, Loader=yaml.SafeLoader)
        return Document(text, FILE_NAME).data
    except (SceneError, yaml.YAMLError, ValueError, RecursionError):  # PyYAML raises the last two for odd text
        return None


def write_metadata(folder: Path, information: str) -> None:
    """Write metadata.yaml into the folder, complete or not at all. information: `bag_information` as YAML.

    Raise OSError, by which a recorder distinguishes a full disk from a missing folder; BagError for other reasons.
    """
    file = folder / FILE_NAME
    try:
        write_file(file, (_HEAD + indent(information, "  ")).encode())
    except FileError as error:
        raise error.__cause__ if isinstance(error.__cause__, OSError) else BagError(f"{file}: {error}") from error


def read_metadata(folder: Path) -> dict[str, Any] | None:
    """Return the mapping under `rosbag2_bagfile_information` in metadata.yaml; None if it is missing or broken."""
    file = folder / FILE_NAME
    try:
        if not file.is_file() or file.stat().st_size > SIZE_LIMIT:
            return None
        document = from_yaml(file.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError):
        return None
    information = document.get("rosbag2_bagfile_information") if isinstance(document, dict) else None
    return information if isinstance(information, dict) else None


def is_stated_in(file: Path) -> bool:
    """Return True if the metadata.yaml beside an MCAP file is about that file only, and equals its metadata record.

    Then metadata.yaml need not be parsed, which takes a twentieth of a second. Raise OSError and UnicodeDecodeError.
    """
    beside = file.parent / FILE_NAME
    if not beside.is_file() or beside.stat().st_size > SIZE_LIMIT:
        return False
    text = beside.read_text(encoding="utf-8")
    stated = dedent(text.removeprefix(_HEAD)).encode()
    with file.open("rb") as stream:
        stream.seek(-min(len(stated) + _BEHIND, file.stat().st_size), SEEK_END)
        alone = rb"\nrelative_file_paths:\n *- %b\nfiles:\n" % re.escape(os.fsencode(file.name))
        return re.search(alone, stated) is not None and stated in stream.read()


def fits(information: Mapping[str, Any], expected: Mapping[str, Any]) -> bool:
    """Return True if a metadata.yaml states the expected files, times, and topics with their types and counts."""
    try:
        return _essence(information) == _essence(expected)
    except (KeyError, TypeError, AttributeError, IndexError):
        return False


def file_names(information: Mapping[str, Any]) -> list[str]:
    """Return the names of the storage files; older versions state them with their folder. Raise TypeError, KeyError."""
    return [PurePath(path).name for path in information["relative_file_paths"]]


def _essence(information: Mapping[str, Any]) -> tuple[Any, ...]:
    topics = {}
    for topic in information["topics_with_message_count"]:
        if count := topic["message_count"]:  # recorders differ in listing topics without messages
            entry = topic["topic_metadata"]
            topics[entry["name"]] = (entry["type"], entry["serialization_format"], _profiles(entry), count)
    return (
        information["storage_identifier"],
        information["duration"]["nanoseconds"],
        information["starting_time"]["nanoseconds_since_epoch"],
        information["message_count"],
        topics,
        file_names(information),
        str(information.get("compression_mode")).lower() == "file",  # then they would have other names
    )


def _profiles(topic: Mapping[str, Any]) -> Any:
    """Return the quality of service, which is text in versions up to 8."""
    profiles = topic.get("offered_qos_profiles")
    return from_yaml(profiles) if isinstance(profiles, str) else profiles
