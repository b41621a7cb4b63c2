# SPDX-License-Identifier: Apache-2.0
"""Bags that every reader accepts, and clear refusals where nothing can be written."""

import re
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest
from bag.small_line import record
from mcap.reader import NonSeekingReader, make_reader
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability, QosReliability
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from ruamel.yaml import YAML

from conveyor_sim.bag.folder import make_folder
from conveyor_sim.bag.messages.topics import OUTPUTS
from conveyor_sim.bag.messages.typestore import type_hash
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorder import Recorder, new_run_folder, run_folder
from conveyor_sim.bag.recover import recover
from conveyor_sim.errors import BagError
from conveyor_sim.scene import Scene

COUNTS = {
    "/line": 1,
    "/readback": 4,
    "/alarm_states": 2,
    "/plant": 1,
    "/outcomes": 5,
    "/bottles": 51,
    "/poses": 51,
    "/markers": 51,
    "/contacts": 51,
    "/belts": 51,
    "/signals": 101,
    "/counters": 2,
    "/events": 8,
}
SILENT = dict.fromkeys(("/guard", "/ledger", "/damage", "/rail_wear", "/damage_events", "/run_state", "/variables"), 0)
"""Topics without messages in this run: they are off, or had no events."""


def test_rosbags_decodes_every_topic_from_the_bag_alone(bag: Path) -> None:
    counts: Counter[str] = Counter()
    with AnyReader([bag]) as reader:
        for connection, _, data in reader.messages():
            reader.deserialize(data, connection.msgtype)
            counts[connection.topic] += 1
    assert counts == COUNTS


def test_mcap_decodes_every_topic_from_the_file_alone(bag: Path) -> None:
    """With no types but those that its schemas state."""
    counts: Counter[str] = Counter()
    with (bag / "small_0.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        store = get_typestore(Stores.EMPTY)
        for schema, channel, message in reader.iter_messages():
            assert schema is not None
            assert schema.encoding == "ros2msg"
            assert channel.message_encoding == "cdr"
            if schema.name not in store.types:
                store.register(get_types_from_msg(schema.data.decode(), schema.name))
            store.deserialize_cdr(message.data, schema.name)
            assert message.log_time == message.publish_time > 0
            counts[channel.topic] += 1
    assert counts == COUNTS


def test_metadata_tells_rosbag2_what_is_there(bag: Path) -> None:
    with Reader(bag) as reader:
        assert reader.message_count == sum(COUNTS.values())
        assert reader.start_time == 1
        assert reader.end_time == 1_000_000_001
        assert {c.topic: c.msgcount for c in reader.connections} == COUNTS | SILENT
        for connection in reader.connections:
            output = OUTPUTS[connection.topic[1:]]
            assert connection.msgtype == output.type
            assert connection.digest == type_hash(output.type)
            (qos,) = connection.ext.offered_qos_profiles  # type: ignore[union-attr]
            latched = output.name in ("line", "plant", "readback", "alarm_states", "run_state")
            assert qos.durability == (QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE)
            assert qos.reliability == QosReliability.RELIABLE
            assert qos.depth == output.qos.depth
    information = YAML(typ="safe").load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert information["version"] == 9
    assert information["storage_identifier"] == "mcap"
    assert information["relative_file_paths"] == ["small_0.mcap"]
    assert information["ros_distro"] in ("jazzy", "kilted")


def test_file_repeats_the_metadata_and_is_compressed_in_chunks(bag: Path) -> None:
    with (bag / "small_0.mcap").open("rb") as file:
        reader = make_reader(file)
        line, record = reader.iter_metadata()
        assert (line.name, record.name) == ("conveyor_sim.line", "rosbag2")
        in_file = YAML(typ="safe").load(record.metadata["serialized_metadata"])
        summary = reader.get_summary()
    beside = YAML(typ="safe").load((bag / "metadata.yaml").read_text())
    assert in_file == beside["rosbag2_bagfile_information"]
    assert summary is not None
    assert summary.chunk_indexes
    assert {chunk.compression for chunk in summary.chunk_indexes} == {"zstd"}
    for channel in summary.channels.values():
        assert set(channel.metadata) == {"offered_qos_profiles", "topic_type_hash"}


def test_only_chosen_topics_are_recorded(tmp_path: Path) -> None:
    with Recorder(tmp_path / "bag", topics=["signals"]) as recorder:
        assert recorder.wants("signals")
        assert not recorder.wants("bottles")


def test_folder_that_is_not_empty_is_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(BagError, match=f"{tmp_path}: is not empty, expected a new or an empty folder"):
        Recorder(tmp_path)
    assert [file.name for file in tmp_path.iterdir()] == ["notes.txt"]


def test_path_that_can_not_be_a_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(BagError, match=r"file/run: can't be created .*Not a directory"):
        Recorder(tmp_path / "file" / "run")


def test_closing_twice_is_harmless_and_ends_the_recording(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "bag")
    recorder.close()
    recorder.close()
    with pytest.raises(BagError, match="has ended"):
        recorder.write("signals", b"", 1)


def test_run_folders_do_not_collide(tmp_path: Path) -> None:
    """Processes that begin in the same second get different folders."""
    folders = [new_run_folder(tmp_path / "runs") for _ in range(3)]
    assert sorted(folders) == sorted((tmp_path / "runs").iterdir())


def test_run_folder_of_a_run_that_failed_is_gone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ZeroDivisionError), run_folder(None) as folder:
        assert folder.is_dir()
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []


def test_a_recorder_that_comes_second_does_not_take_away_the_first_ones_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def overtaken(path: Path) -> list[Path]:
        """Another process records to the folder that this one has just found empty."""
        made = make_folder(path)
        (path / "both_0.mcap").write_bytes(b"of the other")
        return made

    monkeypatch.setattr("conveyor_sim.bag.recorder.make_folder", overtaken)
    with pytest.raises(BagError, match=r"both_0\.mcap: can't be written"):
        Recorder(tmp_path / "both")
    assert (tmp_path / "both" / "both_0.mcap").read_bytes() == b"of the other"


FILL = """
import resource, signal, sys
from pathlib import Path
from bag.small_line import SMALL_LINE, record
from conveyor_sim.errors import BagError
from conveyor_sim.scene import load_scene
scene, folder = load_scene(SMALL_LINE), Path(sys.argv[1])
record(scene, folder.with_name("first"), 2)  # compiled kernels are files too, and larger than the limit
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, 40_000))
try:
    record(scene, folder, 2000, 50)  # chunks by ticks: on a fast machine the second one in time would be past the limit
except BagError as error:
    print(error)
"""


def test_disk_that_fills_up_ends_the_recording_with_a_bag_that_can_be_recovered(tmp_path: Path) -> None:
    """A limit on the file's size stands in for the end of the disk: the write fails the same way."""
    folder = tmp_path / "full"
    done = subprocess.run(
        [sys.executable, "-c", FILL, str(folder)], capture_output=True, text=True, cwd=Path(__file__).parents[1]
    )
    assert "recording stopped at" in done.stdout, done.stderr
    assert f"conveyor-sim recover {folder}" in done.stdout
    assert len(done.stdout.strip().splitlines()) == 1
    with pytest.raises(BagError, match="recover"):
        open_bag(folder)
    report = recover(folder)
    with open_bag(folder) as bag:
        ticks = [frame.tick for frame in bag.bottles()]
    assert ticks == list(range(0, 2 * len(ticks), 2))
    assert report.message_count > 100


def test_what_was_recorded_reaches_the_file_without_another_message(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "bag", topics=["signals"])
    recorder.write("signals", b"first", 1)
    (file,) = (tmp_path / "bag").glob("*.mcap")
    before = file.stat().st_size
    recorder.write("signals", b"last", 2)
    end = time.monotonic() + 60.0
    while file.stat().st_size == before and time.monotonic() < end:
        time.sleep(0.01)
    with file.open("rb") as stream:
        messages = NonSeekingReader(stream).iter_messages(log_time_order=False)
        assert [message.data for _, _, message in (next(messages), next(messages))] == [b"first", b"last"]
    recorder.close()


NO_ROOM = """
import resource, signal, sys, time
from pathlib import Path
from bag.small_line import SMALL_LINE, record
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.errors import BagError
from conveyor_sim.scene import load_scene
folder, hard = Path(sys.argv[1]), resource.getrlimit(resource.RLIMIT_FSIZE)[1]
scene = load_scene(SMALL_LINE)
record(scene, folder.with_name("first"), 2)
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
def room(size):
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
def told(function):
    try:
        function()
    except BagError as error:
        print(error)
room(0)
told(lambda: Recorder(folder / "deep"))  # not even the first bytes
print(folder.exists())
room(3000)
told(lambda: record(scene, folder, 2))  # the first bytes, but not the first message
print(folder.exists())
room(hard)
record(scene, folder, 2)  # now there is room: the same folder can be recorded to
recorder = Recorder(folder.with_name("waiting"), topics=["signals"])
recorder.write("signals", b"first", 1)
room(10)
recorder.write("signals", b"later", 2)  # found full by the thread that flushes
while not recorder._ended:
    time.sleep(0.01)
told(recorder.flush)
recorder.close()
"""


def test_disk_that_is_full_from_the_start_is_told_and_leaves_nothing_behind(tmp_path: Path) -> None:
    folder = tmp_path / "full"
    done = subprocess.run(
        [sys.executable, "-c", NO_ROOM, str(folder)], capture_output=True, text=True, cwd=Path(__file__).parents[1]
    )
    assert done.stderr == ""
    no_bytes, there, no_message, still_there, later = done.stdout.splitlines()
    assert re.fullmatch(r".*full/deep/deep_0\.mcap: can't be written \(File too large\)", no_bytes)
    assert no_message.startswith(
        f"{folder}: can't be recorded to (File too large): there is no room for the first message"
    )
    assert there == still_there == "False"
    assert "recording stopped at 0.00 s (File too large)" in later
    with open_bag(folder) as bag:
        assert bag.counts["signals"] == 3


def test_folder_with_a_recording_is_refused_by_its_name(record_line: Callable[[str, int], Path]) -> None:
    folder = record_line("bag", 2)
    with pytest.raises(BagError, match=r"is not empty \(it holds a recording, bag_0\.mcap\), expected a new"):
        Recorder(folder)


def test_bag_of_another_distribution_says_so(scene: Scene, tmp_path: Path) -> None:
    with Recorder(tmp_path / "bag", distro="kilted"):
        pass
    assert "ros_distro: kilted" in (tmp_path / "bag" / "metadata.yaml").read_text()


def test_recording_into_an_existing_empty_folder(scene: Scene, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    record(scene, tmp_path / "empty", 2)
    with open_bag(tmp_path / "empty") as opened:
        assert opened.counts["bottles"] == 2


def test_bag_is_found_by_its_file_too(record_line: Callable[[str, int], Path]) -> None:
    with open_bag(record_line("bag", 4) / "bag_0.mcap") as opened:
        assert opened.line.scene_name == "small_line"
