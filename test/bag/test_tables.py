# SPDX-License-Identifier: Apache-2.0
"""Recordings as tables, read back by pandas, polars, duckdb and pyarrow."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
import pandas
import polars
import pytest
from bag.editing import edited
from bag.small_line import SMALL_LINE, record
from click.testing import CliRunner, Result
from facts import missing, stating
from pyarrow import parquet

from conveyor_sim.bag import tables
from conveyor_sim.bag.export import export_tables
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.bag.tables import TABLES
from conveyor_sim.cli import main
from conveyor_sim.errors import BagError
from conveyor_sim.scene import load_scene

TICKS = 100

Export = Callable[..., Result]


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small line, with commands, events and contacts."""
    folder = tmp_path_factory.mktemp("tables") / "bag"
    record(load_scene(SMALL_LINE), folder, TICKS)
    return folder


def export(bag: Path, *arguments: object) -> Result:
    return CliRunner().invoke(main, ["export", str(bag), *map(str, arguments)], catch_exceptions=False)


@pytest.mark.parametrize("topic", ["bottles", "contacts"])
def test_frames_have_the_rows_of_all_messages(bag: Path, topic: str) -> None:
    with open_bag(bag) as opened:
        frame = opened.frame(topic)
        messages = list(opened.read(topic))
        line = opened.line
    ids = "id" if topic == "bottles" else "a"
    assert len(frame) == sum(len(getattr(message.data, ids)) for message in messages) > 0
    for field in ("x", "y", ids):
        assert (frame[field] == np.concatenate([getattr(message.data, field) for message in messages])).all()
    assert (frame["tick"] * line.tick_ns * 1e-9 - frame["time"]).abs().max() < 1e-9
    assert frame.attrs["units"]["x"] == "m"
    if topic == "bottles":
        belt = np.concatenate([message.data.belt for message in messages])
        assert list(frame["belt"].cat.categories) == line.belts
        assert [*frame["belt"].astype(object).where(frame["belt"].notna(), None)] == [
            None if index < 0 else line.belts[index] for index in belt
        ]
        assert set(frame["type"]) <= set(line.bottle_types)
    else:
        rails = frame[frame["kind"] == "rail"]
        assert [line.rails[index] for index in rails["b"]] == list(rails["rail"])
        assert frame[frame["kind"] == "bottle"]["rail"].isna().all()


def test_a_frame_of_signals_has_a_column_per_signal(bag: Path) -> None:
    with open_bag(bag) as opened:
        frame, names, tags = opened.frame("signals"), opened.line.signal_names, opened.line.tags
        images = np.array([message.data for message in opened.signals()])
    assert list(frame.columns) == ["time", "tick", *names]
    assert (frame[names].to_numpy() == images).all()
    units = {tag.name: tag.unit for tag in tags}
    assert {name: frame.attrs["units"].get(name, "1") for name in names} == {name: units[name] for name in names}


def test_a_frame_of_events_has_their_ticks_and_absent_bottles(bag: Path) -> None:
    with open_bag(bag) as opened:
        frame = opened.frame("events")
        columns = [message.data for message in opened.read("events")]
    assert list(frame["tick"]) == [int(at) for column in columns for at in column.at]
    assert list(frame["kind"]) == [kind for column in columns for kind in column.kind]
    assert [None if pandas.isna(bottle) else bottle for bottle in frame["bottle"]] == [
        None if bottle < 0 else bottle for column in columns for bottle in column.bottle
    ]
    assert frame["bottle"].isna().any() and frame["bottle"].notna().any()


def test_parquet_and_csv_are_the_frames(bag: Path, tmp_path: Path) -> None:
    result = export(bag, "--parquet", "--csv", "--out", tmp_path / "out", *(f"--table={topic}" for topic in TABLES))
    assert result.exit_code == 0, result.output
    lines = result.stdout.splitlines()
    assert len(lines) <= 12 and str(tmp_path / "out") in lines[-1]
    with open_bag(bag) as opened:
        frames = {topic: opened.frame(topic) for topic in TABLES}
    for topic, frame in frames.items():
        file = tmp_path / "out" / f"{topic}.parquet"
        pandas.testing.assert_frame_equal(
            pandas.read_parquet(file), frame, check_dtype=False, check_categorical=False, check_names=False
        )
        units = {field.name: field.metadata[b"unit"].decode() for field in parquet.read_schema(file) if field.metadata}
        assert units == frame.attrs["units"]
        assert polars.read_parquet(file).shape == frame.shape
        assert duckdb.execute(f"select count(*) from '{file}'").fetchone() == (len(frame),)
        text = pandas.read_csv(tmp_path / "out" / f"{topic}.csv", keep_default_na=True)
        assert list(text.columns) == list(frame.columns) and len(text) == len(frame)
        for name in frame.select_dtypes("number").columns:
            assert np.array_equal(text[name].astype(float), frame[name].astype(float), equal_nan=True), name
    peak = duckdb.execute(f"select max(peak_force) from '{tmp_path / 'out' / 'bottles.parquet'}'").fetchone()
    assert peak == (frames["bottles"]["peak_force"].max(),)


def test_small_blocks_give_the_same_rows(bag: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = export_tables(bag, tmp_path / "whole", ["parquet"])
    monkeypatch.setattr(tables, "ROWS", 10)
    parts = export_tables(bag, tmp_path / "parts", ["parquet"])
    for one, other in zip(whole, parts, strict=True):
        assert parquet.ParquetFile(other).num_row_groups >= parquet.ParquetFile(one).num_row_groups
        assert polars.read_parquet(one).equals(polars.read_parquet(other))
    assert parquet.ParquetFile(tmp_path / "parts" / "bottles.parquet").num_row_groups > 1


def test_what_was_not_recorded_is_left_out_unless_it_is_chosen(bag: Path, tmp_path: Path) -> None:
    kept = ["line", "bottles"]
    with open_bag(bag) as opened, Recorder(tmp_path / "few", topics=[*kept, "events"]) as recorder:
        for topic, log_time, data in opened.raw(kept):
            recorder.write(topic, data, log_time)
    result = export(tmp_path / "few", "--csv")
    assert result.exit_code == 0, result.output
    assert {file.name for file in (tmp_path / "few" / "tables").iterdir()} == {"bottles.csv", "events.csv"}
    assert (tmp_path / "few" / "tables" / "events.csv").read_text().splitlines() == [
        "time,tick,kind,name,bottle,value,text"
    ]
    refused = export(tmp_path / "few", "--csv", "--table", "contacts")
    assert (refused.exit_code, missing(refused.output, ["no topic contacts"])) == (1, [])
    with open_bag(tmp_path / "few") as opened:
        assert len(opened.frame("events")) == 0
        for topic in ("line", "poses", "gone"):
            with pytest.raises(BagError, match=stating(topic, "bottles, contacts, signals, events, belts")):
                opened.frame(topic)


@pytest.mark.parametrize(
    ("arguments", "facts"),
    [
        ([], ["--parquet", "--csv", "expected one of them"]),
        (["--csv", "--table", "plant"], ["plant", "bottles, contacts, signals, events, belts"]),
        (["--csv", "--out", "/proc/nowhere"], ["/proc/nowhere", "can't be created"]),
    ],
)
def test_errors_are_one_sentence(bag: Path, arguments: list[str], facts: list[str]) -> None:
    result = export(bag, *arguments)
    assert (result.exit_code, missing(result.output, facts)) == (1, [])
    assert len(result.output.strip().splitlines()) == 1


def test_a_failure_leaves_the_previous_file(bag: Path, tmp_path: Path) -> None:
    """A recording that names a belt that the line lacks, in its middle."""

    def forge(topic: str, message: Any) -> None:
        if topic == "bottles" and message.tick == 50:
            message.belt = np.full(len(message.id), 99, dtype=np.int32)

    edited(bag, tmp_path / "forged", forge)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "bottles.csv").write_text("before")
    refused = export(tmp_path / "forged", "--csv", "--out", tmp_path / "out")
    assert (refused.exit_code, missing(refused.output, ["belt 99", "tick 50"])) == (1, [])
    assert [file.name for file in (tmp_path / "out").iterdir()] == ["bottles.csv"]
    assert (tmp_path / "out" / "bottles.csv").read_text() == "before"


def test_values_that_are_no_numbers_are_empty_in_csv(bag: Path, tmp_path: Path) -> None:
    def forge(topic: str, message: Any) -> None:
        if topic == "bottles":
            message.x = np.full(len(message.id), math.nan)

    export(edited(bag, tmp_path / "forged", forge), "--csv", "--table", "bottles")
    text = pandas.read_csv(tmp_path / "forged" / "tables" / "bottles.csv")
    assert text["x"].isna().all() and text["y"].notna().all()
