# SPDX-License-Identifier: Apache-2.0
"""Bags that end in the middle are repaired, with everything that was written."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from bag.small_line import SMALL_LINE, record
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.bag.recover import recover
from conveyor_sim.bag.replay import replay
from conveyor_sim.errors import BagError
from conveyor_sim.scene import Scene, load_scene
from conveyor_sim.simulation import Simulation

Make = Callable[[str, int], Path]
TICKS = 60

ENDLESS = """
import sys
from pathlib import Path
from bag.small_line import SMALL_LINE
from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation
simulation = Simulation(load_scene(SMALL_LINE))
recorder = Recorder(Path(sys.argv[1]))
outputs = OutputWriter(simulation, [recorder], run_id="run")
outputs.start()
while True:
    simulation.advance()
    outputs.after_tick()
    if simulation.tick % 50 == 0:
        recorder.flush()
        print(simulation.tick, flush=True)
"""


def whole(folder: Path) -> list[tuple[str, int, bytes]]:
    """All messages of a bag, which rosbags and mcap must both accept and agree on."""
    with open_bag(folder) as opened:
        found = list(opened.raw())
    with AnyReader([folder]) as reader:
        for connection, _, data in reader.messages():
            reader.deserialize(data, connection.msgtype)
    with next(folder.glob("*.mcap")).open("rb") as file:
        messages = make_reader(file, validate_crcs=True).iter_messages()
        in_file = [(channel.topic[1:], message.log_time, message.data) for _, channel, message in messages]
    assert in_file == found
    return found


def cut(folder: Path, length: int) -> Path:
    """Cuts a bag's file after `length` bytes, as a kill does, and leaves no metadata.yaml."""
    file = next(folder.glob("*.mcap"))
    os.truncate(file, length)
    (folder / "metadata.yaml").unlink()
    return file


def test_bag_killed_while_it_was_written_keeps_all_that_was_flushed(tmp_path: Path) -> None:
    folder = tmp_path / "killed"
    process = subprocess.Popen(
        [sys.executable, "-c", ENDLESS, str(folder)], stdout=subprocess.PIPE, text=True, cwd=Path(__file__).parents[1]
    )
    try:
        assert process.stdout is not None
        flushed = [int(process.stdout.readline()) for _ in range(4)][-1]
        time.sleep(0.02)  # so that it is killed between two flushes
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    with pytest.raises(BagError, match="recover"):
        open_bag(folder)
    report = recover(folder)
    assert not report.healthy
    assert [file.name for file in report.kept] == ["killed_0.mcap.damaged"]
    messages = whole(folder)
    assert len(messages) == report.message_count
    assert sum(topic == "signals" for topic, _, _ in messages) >= flushed + 1
    assert sum(topic == "bottles" for topic, _, _ in messages) >= flushed // 2 + 1
    replayed = replay(folder)
    assert replayed.difference is None
    assert replayed.last_tick >= flushed


@pytest.mark.parametrize("share", [0.3, 0.5, 0.8, 0.999])
def test_bag_cut_anywhere_keeps_a_beginning_of_its_messages(record_line: Make, share: float) -> None:
    folder = record_line("cut", TICKS)
    before = whole(folder)
    file = next(folder.glob("*.mcap"))
    cut(folder, int(share * file.stat().st_size))
    report = recover(folder)
    after = whole(folder)
    assert after == before[: len(after)]
    assert len(after) == report.message_count > 0


def test_cut_chunk_yields_the_messages_that_were_written_of_it(scene: Scene, tmp_path: Path) -> None:
    """Nearly all of the recording is one chunk here; cut in two, its first half is still there."""
    folder = tmp_path / "half"
    record(scene, folder, 400)
    with next(folder.glob("*.mcap")).open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    last = summary.chunk_indexes[-1]
    cut(folder, last.chunk_start_offset + last.chunk_length // 2)
    report = recover(folder)
    assert any("the last chunk was cut" in sentence for sentence in report.damage)
    assert report.message_count > sum(index.message_index_length > 0 for index in summary.chunk_indexes[:-1])
    whole(folder)


def test_a_damaged_first_chunk_takes_along_the_messages_whose_topics_it_names(tmp_path: Path) -> None:
    """The first message is in a separate chunk; a byte of that is wrong, and the file's end is missing."""
    folder = tmp_path / "bad"
    simulation = Simulation(load_scene(SMALL_LINE))
    with Recorder(folder) as recorder:
        outputs = OutputWriter(simulation, [recorder], run_id="run")
        outputs.start()
        for _ in range(20):
            simulation.advance()
            outputs.after_tick()
    file = next(folder.glob("*.mcap"))
    with file.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    first, last = summary.chunk_indexes[0], summary.chunk_indexes[-1]
    content = bytearray(file.read_bytes())[: last.chunk_start_offset + last.chunk_length]
    content[first.chunk_start_offset + first.chunk_length - 5] ^= 0xFF
    file.write_bytes(content)
    (folder / "metadata.yaml").unlink()
    with pytest.raises(BagError, match="holds not one message that can be read"):
        recover(folder)


def test_only_the_index_missing_loses_nothing(record_line: Make) -> None:
    folder = record_line("index", TICKS)
    before = whole(folder)
    file = next(folder.glob("*.mcap"))
    cut(folder, file.stat().st_size - 100)
    recover(folder)
    assert whole(folder) == before


def test_only_metadata_missing_is_rebuilt_without_touching_the_file(record_line: Make) -> None:
    folder = record_line("yaml", TICKS)
    metadata, file = folder / "metadata.yaml", next(folder.glob("*.mcap"))
    before, written = metadata.read_text(), file.stat().st_mtime_ns
    metadata.unlink()
    report = recover(folder)
    assert report.kept == ()
    assert metadata.read_text() == before
    assert file.stat().st_mtime_ns == written


def test_zeros_at_the_end_are_left_out(record_line: Make) -> None:
    """Some file systems leave zeros after a loss of power."""
    folder = record_line("zeros", TICKS)
    before = whole(folder)
    file = next(folder.glob("*.mcap"))
    cut(folder, file.stat().st_size - 8)
    with file.open("ab") as stream:
        stream.write(bytes(5000))
    recover(folder)
    assert whole(folder) == before


def test_whole_bag_is_left_alone(record_line: Make) -> None:
    folder = record_line("whole", TICKS)
    before = {file.name: file.stat().st_mtime_ns for file in folder.iterdir()}
    report = recover(folder)
    assert report.healthy
    assert {file.name: file.stat().st_mtime_ns for file in folder.iterdir()} == before


def test_damaged_original_is_kept_unchanged(record_line: Make) -> None:
    folder = record_line("kept", TICKS)
    file = cut(folder, 20_000)
    damaged = file.read_bytes()
    (kept,) = recover(folder).kept
    assert kept.read_bytes() == damaged
    assert recover(folder).healthy


def test_recovered_bag_damaged_again_keeps_both_originals(record_line: Make) -> None:
    folder = record_line("twice", TICKS)
    cut(folder, 20_000)
    recover(folder)
    cut(folder, (folder / "twice_0.mcap").stat().st_size - 100)
    report = recover(folder)
    assert [file.name for file in report.kept] == ["twice_0.mcap.damaged-2"]
    assert (folder / "twice_0.mcap.damaged").stat().st_size == 20_000


def test_single_file_can_be_recovered(record_line: Make) -> None:
    file = cut(record_line("single", TICKS), 20_000)
    report = recover(file)
    assert report.message_count > 0
    assert not (file.parent / "metadata.yaml").exists()
    with open_bag(file) as opened:
        assert opened.counts["line"] == 1


def test_file_without_a_message_is_refused_and_left_as_it_was(record_line: Make) -> None:
    file = cut(record_line("empty", TICKS), 40)
    with pytest.raises(BagError, match="not one message that can be read"):
        recover(file.parent)
    assert [path.name for path in file.parent.iterdir()] == [file.name]
    assert file.stat().st_size == 40


def test_file_that_is_no_mcap_is_refused(tmp_path: Path) -> None:
    (tmp_path / "x.mcap").write_text("not a bag")
    with pytest.raises(BagError, match="does not begin as an MCAP file"):
        recover(tmp_path)


def test_folder_without_a_bag_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="no MCAP file found"):
        recover(tmp_path)
