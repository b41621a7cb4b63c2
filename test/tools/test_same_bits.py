# SPDX-License-Identifier: Apache-2.0
"""The comparison of recorded corpora: equal ones pass, and a changed bit, hash, message or entry is reported."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from types import ModuleType

import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

TOOLS = Path(__file__).parent.parent.parent / "tools"
ENTRY = "too_fast"


@pytest.fixture(scope="module")
def tool() -> ModuleType:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(TOOLS))
        import same_bits
    return same_bits


@pytest.fixture(scope="module")
def recorded(tool: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A corpus of one entry, whose run is stopped by the guard."""
    folder = tmp_path_factory.mktemp("corpus") / "old"
    assert tool.record(folder, TOOLS.parent, [ENTRY]) == 0
    return folder


@pytest.fixture
def corpus(recorded: Path, tmp_path: Path) -> Path:
    """A copy of the corpus, to be changed."""
    return Path(shutil.copytree(recorded, tmp_path / "new"))


def rewrite(corpus: Path, topic: str = "", bit: int = 0, place: int = 0) -> None:
    """Write the recording anew in another layout, with one byte of the longest message of a topic changed.

    bit: mask of the change; 0 leaves that message out. place: index of the byte; 0 for the one in the middle.
    """
    (file,) = (corpus / ENTRY / "bag").glob("*.mcap")
    with file.open("rb") as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        rows = [(channel.topic, message) for _, channel, message in reader.iter_messages(log_time_order=False)]
    assert summary is not None
    lengths = [len(message.data) if name == topic else 0 for name, message in rows]
    chosen = lengths.index(max(lengths)) if topic else -1
    with file.open("wb") as stream:
        writer = Writer(stream, chunk_size=500)
        writer.start()
        channels = {}
        for channel in summary.channels.values():
            schema = summary.schemas[channel.schema_id]
            number = writer.register_schema(schema.name, schema.encoding, schema.data)
            channels[channel.topic] = writer.register_channel(
                channel.topic, channel.message_encoding, number, channel.metadata
            )
        for index, (name, message) in enumerate(rows):
            data = bytearray(message.data)
            if index == chosen:
                if not bit:
                    continue
                data[place or len(data) // 2] ^= bit
            writer.add_message(channels[name], message.log_time, bytes(data), message.publish_time)
        writer.finish()  # type: ignore[no-untyped-call]


def change_sources(corpus: Path) -> None:
    manifest = json.loads((corpus / "manifest.json").read_text())
    (corpus / "manifest.json").write_text(json.dumps(manifest | {"sources": "others"}))


def test_a_corpus_equals_itself_in_another_layout(
    tool: ModuleType, recorded: Path, corpus: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rewrite(corpus)
    assert tool.compare(recorded, corpus, False) == 0
    assert "1 entries" in capsys.readouterr().out


@pytest.mark.parametrize("topic", ["/signals", "/markers", "/contacts", "/bottles"])
def test_one_bit_of_a_payload_is_reported(
    tool: ModuleType, recorded: Path, corpus: Path, capsys: pytest.CaptureFixture[str], topic: str
) -> None:
    rewrite(corpus, topic, 1)
    assert tool.compare(recorded, corpus, False) == 1
    assert f"{ENTRY}/bag{topic}" in capsys.readouterr().out


def test_a_missing_message_is_reported(
    tool: ModuleType, recorded: Path, corpus: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rewrite(corpus, "/signals")
    assert tool.compare(recorded, corpus, False) == 1
    assert f"{ENTRY}/bag/signals" in capsys.readouterr().out


def test_another_hash_is_reported(
    tool: ModuleType, recorded: Path, corpus: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    hashes = json.loads((corpus / ENTRY / "hashes.json").read_text())
    hashes[-1][-1] = f"{int(hashes[-1][-1], 16) ^ 1:016x}"
    (corpus / ENTRY / "hashes.json").write_text(json.dumps(hashes))
    assert tool.compare(recorded, corpus, False) == 1
    assert f"{ENTRY}/hashes.json" in capsys.readouterr().out


def test_a_missing_entry_is_reported(
    tool: ModuleType, recorded: Path, corpus: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.rmtree(corpus / ENTRY)
    assert tool.compare(recorded, corpus, False) == 1
    assert ENTRY in capsys.readouterr().out


@pytest.mark.parametrize(("same_sources", "status"), [(True, 1), (False, 0)])
def test_a_text_may_change_with_the_sources_only(
    tool: ModuleType,
    recorded: Path,
    corpus: Path,
    capsys: pytest.CaptureFixture[str],
    same_sources: bool,
    status: int,
) -> None:
    rewrite(corpus, "/guard", 2, -2)  # the last character of its text, before the zero that ends it
    if not same_sources:
        change_sources(corpus)
    assert tool.compare(recorded, corpus, True) == status
    assert "/guard" in capsys.readouterr().out


def test_fields_of_the_run_are_ignored(tool: ModuleType) -> None:
    line = tool.IGNORED["conveyor_msgs/msg/Line"]
    assert line == {"run_id", "versions", "engine_hash", "machine"}


def test_zeros_of_both_signs_differ(tool: ModuleType) -> None:
    assert tool._leaves(0.0, -0.0, "x") == [("x", 0.0, -0.0)]
    assert tool._leaves([1.0, float("nan")], [1.0, float("nan")], "x") == []
