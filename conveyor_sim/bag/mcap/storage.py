# SPDX-License-Identifier: Apache-2.0
"""Storages of bags other than MCAP, recognised by how their files begin, and how to get MCAP from them."""

from __future__ import annotations

from pathlib import Path, PurePath
from shlex import quote

MAGICS = {
    b"SQLite format 3\0": "sqlite3",
    b"\x28\xb5\x2f\xfd": "zstd",
    b"\x04\x22\x4d\x18": "lz4",
    b"\x1f\x8b": "gzip",
    b"#ROSBAG V": "ROS 1",
}
"""First bytes of a file, and its format: SQLite 3 file format, RFC 8878, LZ4 frame format, RFC 1952, ROS bag format."""
SUFFIX = ".db3"
"""Suffix of the files of sqlite3 bags. It identifies files that are empty or cut as well."""
OF_BAGS = frozenset({".mcap", SUFFIX, ".bag"})
UNPACKED_BY = {
    "zstd": "zstd -d {name} -o {unpacked}",
    "lz4": "lz4 -d {name} {unpacked}",
    "gzip": "gzip -dc {name} > {unpacked}",
}


def other_storage(path: Path) -> str:
    """Return a clause that names the storage of a bag that is not MCAP and says how to get MCAP from it; "": none."""
    try:
        candidates = path.iterdir() if path.is_dir() else [path]
        for file in sorted(file for file in candidates if file == path or not OF_BAGS.isdisjoint(file.suffixes)):
            if file.is_file() and (kind := _kind(file)):
                return _clause(file.name, kind)
    except OSError:
        pass  # the caller reports what can't be read
    return ""


def packed_message(data: bytes | memoryview) -> str:
    """Return a clause for a bag with compressed messages, which only metadata.yaml states; "" for others."""
    kind = next((MAGICS[magic] for magic in MAGICS if bytes(data[:16]).startswith(magic)), "")
    if kind not in UNPACKED_BY:
        return ""
    return f"its messages are compressed by {kind}, expected the bag's folder with metadata.yaml, which says so"


def packed_part(folder: Path) -> str:
    """Return a clause that names an MCAP file of a bag that is compressed and lies there in no other form; "": none."""
    for file in sorted(folder.glob("*.mcap.*")):
        if file.is_file() and _kind(file) in UNPACKED_BY and not (folder / _unpacked(file.name)).exists():
            return _clause(file.name, _kind(file))
    return ""


def _kind(file: Path) -> str:
    with file.open("rb") as stream:
        head = stream.read(max(map(len, MAGICS)))
    kind = next((name for magic, name in MAGICS.items() if head.startswith(magic)), "")
    return kind or ("sqlite3" if file.suffix == SUFFIX else "")


def _clause(name: str, kind: str) -> str:
    if kind == "sqlite3":
        return f"its storage is sqlite3 ({name}), expected MCAP: `ros2 bag convert` makes an MCAP bag of it"
    if kind == "ROS 1":
        return f"its storage is ROS 1 ({name}), expected MCAP: `rosbags-convert` makes a rosbag2 folder of it"
    command = UNPACKED_BY[kind].format(name=quote(name), unpacked=quote(_unpacked(name)))
    return f"its file is compressed by {kind} ({name}), expected MCAP: `{command}` unpacks it"


def _unpacked(name: str) -> str:
    """Return the name without the suffix of its compression, or another name if there is no such suffix."""
    short = name.rpartition(".")[0]
    return short if PurePath(short).suffix in (".mcap", SUFFIX) else f"unpacked_{name}"
