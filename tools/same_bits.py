# SPDX-License-Identifier: Apache-2.0
"""Records a corpus of runs with a checkout of this project, and compares two corpora bit for bit.

    python tools/same_bits.py record FOLDER                     # with the checkout that holds this file
    python tools/same_bits.py record FOLDER --source CHECKOUT   # with another one
    python tools/same_bits.py compare OLD NEW                   # exit status 1 if anything differs
    python tools/same_bits.py replay OLD                        # `conveyor-sim replay` of recordings of another version

The corpus (tools/corpus/entries.yaml) holds state hashes and recordings of simulations, recordings of `conveyor-sim
run` with controllers, and inputs and hashes of the scenarios in examples/scenarios. Recordings are compared by topic:
order and times of the messages, each field bit for bit, definitions and metadata of the topics. The layout of files,
versions and the fields in IGNORED are not compared. Texts for people (TEXTS) are compared between equal sources only;
otherwise changed texts are counted, and listed by `--texts`.
"""

from __future__ import annotations

import argparse
import fnmatch
import hashlib
import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from mcap.reader import make_reader
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

ROOT = Path(__file__).resolve().parent.parent
CORPUS = ROOT / "tools" / "corpus"
REPLAYED = ("buffer_lane/bag", "paper_plant/bag", "plant/bag", "two_stations/bag", "st_cascade/bag", "run_push/bag")
"""Recordings for `replay`."""

IGNORED = {"conveyor_msgs/msg/Line": {"run_id", "versions", "engine_hash", "machine"}}
"""Fields that differ between two recordings of the same bits, by message type."""

TEXTS = {
    "conveyor_msgs/msg/Line": {"dt_reason", "scene_text", "tags.description"},
    "conveyor_msgs/msg/CommandOutcome": {"reason"},
    "conveyor_msgs/msg/RunState": {"reason"},
    "conveyor_msgs/msg/Events": {"text"},
    "conveyor_msgs/msg/GuardEvent": {"text"},
    "conveyor_msgs/msg/DamageEvent": {"text"},
    "conveyor_msgs/msg/AlarmStates": {"text"},
}
"""Fields that hold sentences for people, without indices. Of scene_text only comments and layout may change."""


@dataclass
class Comparison:
    """Differences and reworded texts, with the numbers of what was compared."""

    strict_texts: bool
    differences: list[str] = field(default_factory=list)
    texts: dict[str, None] = field(default_factory=dict)
    entries: int = 0
    messages: int = 0
    hashes: int = 0

    def differ(self, *place: object) -> None:
        """Note one difference."""
        self.differences.append(": ".join(map(str, place)))

    def reword(self, place: str, old: object, new: object) -> None:
        """Note a changed text; a difference if the sources are equal."""
        if self.strict_texts:
            self.differ(place, f"{old!r:.90} -> {new!r:.90}")
        else:
            topic = re.sub(r"^[\w.]+/[\w.]+(?=/)", "", place.split(": tick")[0])  # once for all entries
            self.texts[f"{topic}: {old!r:.200} -> {new!r:.200}"] = None


def sources_hash(source: Path) -> str:
    """Return a hash of the package's sources and message definitions."""
    digest = hashlib.blake2b(digest_size=8)
    for file in sorted([*(source / "conveyor_sim").rglob("*.py"), *(source / "msg_defs").rglob("*.msg")]):
        digest.update(f"{file.relative_to(source)}\0".encode() + file.read_bytes())
    return digest.hexdigest()


def record(folder: Path, source: Path, only: list[str]) -> int:
    """Record the corpus, or the entries whose names match one of the patterns."""
    source = source.resolve()
    folder.mkdir(parents=True)
    table = yaml.safe_load((CORPUS / "entries.yaml").read_text("utf-8"))
    chosen = {
        kind: {name: entry for name, entry in entries.items() if _matches(name, only)}
        for kind, entries in table.items()
    }
    began = time.monotonic()
    request = {"source": str(source), "out": str(folder.resolve()), "entries": chosen["simulated"]}
    _run([str(CORPUS / "simulate.py")], source, input=json.dumps(request))
    for name, entry in chosen["commands"].items():
        print(name, flush=True)
        _record_command(folder.resolve() / name, source, entry)
    if _matches("scenarios", only):
        print("scenarios", flush=True)
        inputs = {"SAME_BITS_INPUTS": str(folder.resolve() / "scenarios"), "PYTHONPATH": f"{source}:{CORPUS}"}
        tests = str(source / "examples" / "scenarios")
        options = ["-q", "-p", "keep_inputs", "-p", "no:cacheprovider", f"--rootdir={source}", tests]
        _run(["-m", "pytest", *options], source, env=inputs, stdout=subprocess.DEVNULL)
    manifest = {"sources": sources_hash(source), "only": only}
    (folder / "manifest.json").write_text(json.dumps(manifest) + "\n")
    print(f"recorded to {folder} in {time.monotonic() - began:.0f} s")
    return 0


def _matches(name: str, only: list[str]) -> bool:
    return not only or any(fnmatch.fnmatch(name, pattern) for pattern in only)


def _run(arguments: list[str], source: Path, env: dict[str, str] | None = None, **options: Any) -> None:
    result = subprocess.run([sys.executable, *arguments], env=_environment(source) | (env or {}), text=True, **options)
    if result.returncode:
        raise SystemExit(f"{' '.join(arguments)[:200]}: exit status {result.returncode}")


def _environment(source: Path) -> dict[str, str]:
    kept = {name: value for name, value in os.environ.items() if name not in ("ROS_DISTRO", "PYTHONPATH")}
    return {**kept, "PYTHONPATH": str(source), "PYTHONDONTWRITEBYTECODE": "1"}


def _command_line(source: Path) -> list[str]:
    """Return the start of a command that runs `conveyor-sim` of a checkout."""
    match = re.search(r"conveyor-sim\s*=\s*([\w.]+):(\w+)", (source / "setup.py").read_text("utf-8"))
    if match is None:
        raise SystemExit(f"{source}/setup.py: no entry point conveyor-sim")
    module, function = match.groups()
    start = f"import sys; sys.argv[0] = 'conveyor-sim'; from {module} import {function}; {function}()"
    return [sys.executable, "-c", start]


def _record_command(out: Path, source: Path, entry: dict[str, Any]) -> None:
    out.mkdir()
    arguments = ["run", _path(entry["scene"], source), "--out", str(out / "bag"), "--no-pictures", "--threads", "1"]
    arguments += ["--duration", str(entry["seconds"])]
    if "controller" in entry:
        arguments += ["--controller", _path(entry["controller"], source)]
    if "parameters" in entry:
        arguments += ["--parameters", entry["parameters"]]
    for pattern in entry.get("variables", []):
        arguments += ["--record-variables", pattern]
    distro = {"ROS_DISTRO": entry.get("distro", "jazzy")}
    result = subprocess.run(
        [*_command_line(source), *arguments],
        env=_environment(source) | distro,
        cwd=out,
        capture_output=True,
        text=True,
    )
    (out / "status.json").write_text(f"{result.returncode}\n")
    (out / "output.txt").write_text(result.stdout + result.stderr)
    if not (out / "bag").is_dir():
        raise SystemExit(f"{out.name}: nothing was recorded\n{result.stderr}")


def _path(path: str, source: Path) -> str:
    return str(CORPUS / path.removeprefix("corpus/") if path.startswith("corpus/") else source / path)


def compare(old: Path, new: Path, show_texts: bool) -> int:
    """Compare two corpora, print the differences and a summary; return the exit status."""
    manifests = [json.loads((folder / "manifest.json").read_text()) for folder in (old, new)]
    comparison = Comparison(manifests[0]["sources"] == manifests[1]["sources"])
    names = [{path.name for path in folder.iterdir() if path.is_dir()} for folder in (old, new)]
    for name in sorted(names[0] | names[1]):
        if not all(_matches(name, manifest["only"]) for manifest in manifests):
            continue
        if name in names[0] and name in names[1]:
            comparison.entries += 1
            compare_entry(name, old / name, new / name, comparison)
        else:
            comparison.differ(name, "only in OLD" if name in names[0] else "only in NEW")
    print("\n".join(comparison.differences), end="\n" if comparison.differences else "")
    if show_texts:
        print("\n".join(comparison.texts), end="\n" if comparison.texts else "")
    verdict = f"{len(comparison.differences)} differences" if comparison.differences else "equal"
    texts = f"; {len(comparison.texts)} texts reworded" if comparison.texts else ""
    counts = f"{comparison.entries} entries, {comparison.hashes} hashes, {comparison.messages} messages"
    print(f"{counts}: {verdict}{texts}")
    return 1 if comparison.differences else 0


def compare_entry(name: str, old: Path, new: Path, comparison: Comparison) -> None:
    """Compare the files of one entry."""
    files = [{str(path.relative_to(folder)) for path in _parts(folder)} for folder in (old, new)]
    for file in sorted(files[0] | files[1]):
        place = f"{name}/{file}"
        if file not in files[0] or file not in files[1]:
            comparison.differ(place, "only in OLD" if file in files[0] else "only in NEW")
        elif file.endswith(".json"):
            _compare_lists(
                place, json.loads((old / file).read_text()), json.loads((new / file).read_text()), comparison
            )
        elif file.endswith(".jsonl"):
            logs = [[json.loads(line) for line in (folder / file).open()][1:] for folder in (old, new)]
            _compare_lists(place, logs[0], logs[1], comparison)
        else:
            compare_bags(place, old / file, new / file, comparison)


def _parts(folder: Path) -> Iterator[Path]:
    """Return the files to compare, and the folders of recordings."""
    for path in folder.rglob("*"):
        if path.suffix == ".jsonl" or path.name in ("hashes.json", "status.json"):
            yield path
        elif path.suffix == ".mcap":
            yield path.parent


def _compare_lists(place: str, old: Any, new: Any, comparison: Comparison) -> None:
    """Compare lists of hashes or inputs, of which the first difference is noted."""
    olds, news = (value if isinstance(value, list) else [value] for value in (old, new))
    comparison.hashes += len(olds)
    for one, other in zip(olds, news, strict=False):
        if json.dumps(one) != json.dumps(other):  # tells NaN, -0.0 and 1 from 1.0
            comparison.differ(place, f"{one!s:.100} -> {other!s:.100}")
            return
    if len(olds) != len(news):
        comparison.differ(place, f"{len(olds)} -> {len(news)} lines")


@dataclass
class Recording:
    """Messages of a bag in the order of the file, and what describes their topics."""

    messages: list[tuple[str, int, int, bytes]]
    """Topic, log time and publish time in ns, payload."""
    topics: dict[str, tuple[str, str, dict[str, str]]]
    """Type, encodings and metadata by topic."""
    definitions: dict[str, str]
    """Definitions by type."""
    stores: dict[str, Any] = field(default_factory=dict)
    """Type stores by type, each made when a message is decoded first."""

    @staticmethod
    def read(folder: Path) -> Recording:
        """Read all MCAP files of a folder."""
        recording = Recording([], {}, {})
        for file in sorted(folder.glob("*.mcap")):
            with file.open("rb") as stream:
                reader = make_reader(stream)
                summary = reader.get_summary()
                assert summary is not None
                for channel in summary.channels.values():
                    schema = summary.schemas[channel.schema_id]
                    encodings = f"{schema.encoding}, {channel.message_encoding}"
                    recording.topics[channel.topic] = (schema.name, encodings, dict(channel.metadata))
                    recording.definitions[schema.name] = schema.data.decode()
                for _, channel, message in reader.iter_messages(log_time_order=False):
                    row = (channel.topic, message.log_time, message.publish_time, message.data)
                    recording.messages.append(row)
        return recording

    def decode(self, topic: str, data: bytes) -> Any:
        """Decode a message by the definition in the file."""
        name = self.topics[topic][0]
        if name not in self.stores:
            self.stores[name] = get_typestore(Stores.EMPTY)
            self.stores[name].register(get_types_from_msg(self.definitions[name], name))
        return self.stores[name].deserialize_cdr(data, name)


def compare_bags(place: str, old_folder: Path, new_folder: Path, comparison: Comparison) -> None:
    """Compare two recordings."""
    old, new = Recording.read(old_folder), Recording.read(new_folder)
    comparison.messages += len(old.messages)
    for topic in sorted(old.topics.keys() | new.topics.keys()):
        if topic not in old.topics or topic not in new.topics:
            comparison.differ(f"{place}{topic}", "only in OLD" if topic in old.topics else "only in NEW")
        elif old.topics[topic] != new.topics[topic]:
            comparison.differ(f"{place}{topic}", "type, encoding or metadata of the topic differs")
    for name in sorted(old.definitions.keys() & new.definitions.keys()):
        texts = old.definitions[name], new.definitions[name]
        if texts[0] != texts[1]:
            if _without_comments(texts[0]) != _without_comments(texts[1]):
                comparison.differ(place, f"definition of {name} differs")
            else:
                comparison.reword(f"definition of {name}", "comments", "other comments")
    if [row[:3] for row in old.messages] == [row[:3] for row in new.messages]:
        for topic in old.topics:
            _compare_topic(place, topic, old, new, comparison)
        return
    for topic in sorted(old.topics):
        counts = [sum(row[0] == topic for row in bag.messages) for bag in (old, new)]
        if counts[0] != counts[1]:
            comparison.differ(f"{place}{topic}", f"{counts[0]} -> {counts[1]} messages")
    pairs = zip(old.messages, new.messages, strict=False)
    first = next(((one[:2], other[:2]) for one, other in pairs if one[:3] != other[:3]), None)
    if first is not None:
        comparison.differ(place, f"order or time of messages: {first[0]} ns -> {first[1]} ns")


def _without_comments(definition: str) -> list[str]:
    lines = (re.sub(r"\s*#.*", "", line).strip() for line in definition.splitlines())
    return [line for line in lines if line]


def _compare_topic(place: str, topic: str, old: Recording, new: Recording, comparison: Comparison) -> None:
    """Compare the payloads of a topic; the first difference is noted, and every reworded text."""
    kind = old.topics[topic][0]
    for one, other in zip(old.messages, new.messages, strict=True):
        if one[0] != topic or one[3] == other[3]:
            continue
        try:
            then, now = old.decode(topic, one[3]), new.decode(topic, other[3])
        except (SerdeError, IndexError, ValueError) as error:
            comparison.differ(f"{place}{topic}: {one[1]} ns", f"can't be decoded: {error}")
            return
        tick = f"tick {then.tick}" if hasattr(then, "tick") else f"{one[1]} ns"
        leaves = _leaves(then, now) or [("bytes between the fields", one[3], other[3])]
        differing = [leaf for leaf in leaves if leaf[0].split("[")[0] not in IGNORED.get(kind, ())]
        for path, value, changed in differing:
            where = f"{place}{topic}: {tick}: {path}"
            name = re.sub(r"\[\d+\]", "", path)
            if name in TEXTS.get(kind, ()) and (name != "scene_text" or _same_yaml(value, changed)):
                comparison.reword(where, value, changed)
            else:
                comparison.differ(where, f"{value!r:.60} -> {changed!r:.60}")
                return


def _same_yaml(one: str, other: str) -> bool:
    return bool(yaml.safe_load(one) == yaml.safe_load(other))


def _leaves(old: Any, new: Any, path: str = "") -> list[tuple[str, Any, Any]]:
    """Return paths and values of what differs between two decoded messages, bit for bit."""
    if is_dataclass(old):
        names = [one.name for one in fields(old) if one.name != "__msgtype__"]
        dot = f"{path}." if path else ""
        return [leaf for name in names for leaf in _leaves(getattr(old, name), getattr(new, name), f"{dot}{name}")]
    if isinstance(old, np.ndarray) and len(old) == len(new):
        size = old.dtype.itemsize
        bits = [array.tobytes() for array in (old, new)]
        places = range(len(old)) if bits[0] != bits[1] else range(0)
        changed = [at for at in places if bits[0][at * size : (at + 1) * size] != bits[1][at * size : (at + 1) * size]]
        return [(f"{path}[{at}]", old[at].item(), new[at].item()) for at in changed[:1]]
    if isinstance(old, list) and len(old) == len(new):
        pairs = enumerate(zip(old, new, strict=True))
        return [leaf for at, (one, other) in pairs for leaf in _leaves(one, other, f"{path}[{at}]")]
    if isinstance(old, (np.ndarray, list)):
        return [(path, f"{len(old)} values", f"{len(new)} values")]
    same = repr(old) == repr(new)  # tells -0.0 from 0.0
    return [] if same else [(path, old, new)]


def replay(old: Path, source: Path) -> int:
    """Replay recordings of a corpus with a checkout; return the exit status."""
    failed = 0
    for name in REPLAYED:
        command = [*_command_line(source), "replay", str((old / name).resolve())]
        result = subprocess.run(command, env=_environment(source), capture_output=True, text=True)
        failed += result.returncode != 0
        lines = (result.stdout.strip() or result.stderr.strip()).splitlines()
        print(f"{name}: exit status {result.returncode}: {lines[-1] if lines else ''}")
    return 1 if failed else 0


def main() -> int:
    """Read the command line and do what it says."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    recording = commands.add_parser("record", help="record the corpus to FOLDER, which must not exist")
    recording.add_argument("folder", type=Path)
    recording.add_argument("--source", type=Path, default=ROOT, help="checkout to record with")
    recording.add_argument("--only", action="append", default=[], help="pattern of the names of entries; repeatable")
    comparing = commands.add_parser("compare", help="compare two corpora")
    comparing.add_argument("old", type=Path)
    comparing.add_argument("new", type=Path)
    comparing.add_argument("--texts", action="store_true", help="list the reworded texts")
    replaying = commands.add_parser("replay", help="replay recordings of OLD")
    replaying.add_argument("old", type=Path)
    replaying.add_argument("--source", type=Path, default=ROOT, help="checkout to replay with")
    arguments = parser.parse_args()
    if arguments.command == "record":
        return record(arguments.folder, arguments.source, arguments.only)
    if arguments.command == "compare":
        return compare(arguments.old, arguments.new, arguments.texts)
    return replay(arguments.old, arguments.source.resolve())


if __name__ == "__main__":
    sys.exit(main())
