# SPDX-License-Identifier: Apache-2.0
"""Bags whose storage is not MCAP: read where rosbags can, else a sentence names the storage and the way to MCAP."""

from __future__ import annotations

import gzip
import os
import shutil
from pathlib import Path

import lz4.frame  # type: ignore[import-untyped]
import pytest
import zstandard
from click.testing import CliRunner
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from conveyor_sim.bag.messages.typestore import typestore
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recover import recover
from conveyor_sim.bag.replay import replay
from conveyor_sim.cli import main
from conveyor_sim.errors import BagError

READ = ("replay", "events", "serve")


def stock(bag: Path, folder: Path, plugin: StoragePlugin, mode: CompressionMode = CompressionMode.NONE) -> Path:
    """Return a copy of a bag in another storage."""
    writer = Writer(folder, version=9, storage_plugin=plugin)
    if mode is not CompressionMode.NONE:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    store = typestore()
    with open_bag(bag) as opened, writer:
        topics = {
            topic: writer.add_connection(f"/{topic}", kind, typestore=store) for topic, kind in opened.types.items()
        }
        for topic, time, data in opened.raw():
            writer.write(topics[topic], time, data)
    return folder


@pytest.fixture(scope="module")
def stored(bag: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Bags by kind. Not to be written to."""
    folder = tmp_path_factory.mktemp("stored")
    return {
        "sqlite3": stock(bag, folder / "plain", StoragePlugin.SQLITE3),
        "zstd": stock(bag, folder / "packed", StoragePlugin.MCAP, CompressionMode.FILE),
        "zstd of sqlite3": stock(bag, folder / "both", StoragePlugin.SQLITE3, CompressionMode.FILE),
    }


@pytest.mark.parametrize(
    ("kind", "named"),
    [
        ("sqlite3", ("sqlite3", "plain.db3", "ros2 bag convert")),
        ("zstd", ("zstd", "packed.mcap.zstd", "zstd -d packed.mcap.zstd -o packed.mcap")),
        ("zstd of sqlite3", ("zstd", "both.db3.zstd", "zstd -d both.db3.zstd -o both.db3")),
    ],
)
def test_the_storage_and_the_way_to_mcap_are_named(
    stored: dict[str, Path], bag: Path, tmp_path: Path, kind: str, named: tuple[str, ...]
) -> None:
    """`recover` names them, and so does each command that can't read the bag."""
    folder = stored[kind]
    assert replay(folder).compared == replay(bag).compared
    alone = tmp_path / "alone"
    shutil.copytree(folder, alone)
    (alone / "metadata.yaml").unlink()
    (file,) = alone.iterdir()
    tried = [("recover", folder), ("recover", alone), ("recover", file), *((command, alone) for command in READ)]
    if file.suffix != ".db3":
        tried += [(command, file) for command in READ]
    for command, path in tried:
        done = CliRunner().invoke(main, [command, str(path)])
        assert done.exit_code == 1, (command, path)
        assert all(text in done.output for text in named), (command, path, done.output)
        assert "expected a rosbag2 folder" not in done.output
    assert sorted(path.name for path in alone.iterdir()) == [file.name]


def test_the_named_command_leads_to_a_bag_that_recover_completes(stored: dict[str, Path], tmp_path: Path) -> None:
    folder = tmp_path / "bag"
    shutil.copytree(stored["zstd"], folder)
    (packed,) = folder.glob("*.zstd")
    (folder / packed.stem).write_bytes(zstandard.ZstdDecompressor().stream_reader(packed.read_bytes()).read())
    assert not recover(folder).healthy  # metadata.yaml names the compressed file
    assert replay(folder).difference is None
    assert recover(folder).healthy


def test_a_part_that_is_still_compressed_is_not_left_out_in_silence(stored: dict[str, Path], tmp_path: Path) -> None:
    """A recorder that compresses by file leaves such a folder when it is killed."""
    folder = tmp_path / "bag"
    shutil.copytree(stored["zstd"], folder)
    (packed,) = folder.glob("*.zstd")
    (folder / "last.mcap").write_bytes(zstandard.ZstdDecompressor().stream_reader(packed.read_bytes()).read())
    (folder / "metadata.yaml").unlink()
    with pytest.raises(BagError, match=r"zstd -d packed\.mcap\.zstd -o packed\.mcap"):
        recover(folder)
    assert not (folder / "metadata.yaml").exists()


@pytest.mark.parametrize("plugin", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_messages_that_are_compressed_one_by_one_are_not_called_damaged(
    bag: Path, tmp_path: Path, plugin: StoragePlugin
) -> None:
    """Only metadata.yaml states the compression, so the file alone can't be read."""
    folder = stock(bag, tmp_path / "single", plugin, CompressionMode.MESSAGE)
    assert replay(folder).difference is None
    (file,) = (path for path in folder.iterdir() if path.suffix != ".yaml")
    for command in READ:
        done = CliRunner().invoke(main, [command, str(file)])
        assert done.exit_code == 1
        assert "compressed by zstd" in done.output and "metadata.yaml" in done.output
        assert "damaged" not in done.output and "recover" not in done.output


@pytest.mark.parametrize(
    ("name", "content", "named"),
    [
        ("odd.mcap", zstandard.compress(b"x"), "zstd -d odd.mcap -o unpacked_odd.mcap"),
        ("a b.mcap.lz4", lz4.frame.compress(b"x"), "lz4 -d 'a b.mcap.lz4' 'a b.mcap'"),
        ("x.mcap.gz", gzip.compress(b"x", mtime=0), "gzip -dc x.mcap.gz > x.mcap"),
        ("x.bag", b"#ROSBAG V2.0\n", "rosbags-convert"),
        ("empty.db3", b"", "ros2 bag convert"),
    ],
)
def test_formats_are_known_by_how_files_begin(tmp_path: Path, name: str, content: bytes, named: str) -> None:
    file = tmp_path / name
    file.write_bytes(content)
    for command in (recover, open_bag):
        for path in (file, tmp_path):
            if path == tmp_path and file.suffix == ".mcap":
                continue  # then metadata.yaml is missing first
            with pytest.raises(BagError) as caught:
                command(path)
            assert named in str(caught.value)


def test_other_files_of_a_folder_are_not_treated_as_a_bag(tmp_path: Path) -> None:
    (tmp_path / "notes.txt.gz").write_bytes(gzip.compress(b"x", mtime=0))
    os.mkfifo(tmp_path / "pipe.mcap.zstd")
    with pytest.raises(BagError, match="no MCAP file found"):
        recover(tmp_path)
