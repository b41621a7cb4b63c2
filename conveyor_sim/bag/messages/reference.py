# SPDX-License-Identifier: Apache-2.0
"""The tables of docs/ros/topics.md that list topics, from their rows."""

from __future__ import annotations

from conveyor_sim.bag.messages.qos import Qos
from conveyor_sim.bag.messages.topics import TOPICS, Topic
from conveyor_sim.scene.schema import Outputs


def tables() -> dict[str, dict[str, str]]:
    """Return the tables by their names; pages by their path in docs/ without suffix."""
    ours = sorted((topic for topic in TOPICS.values() if not topic.subscribed), key=lambda topic: topic.rate is None)
    theirs = [topic for topic in TOPICS.values() if topic.subscribed]
    tables = {
        "published": _table(
            ("published", "type", "what", "when (simulated time)"),
            [(f"`{topic.name}`", _type(topic), topic.what, topic.when or _rate(topic)) for topic in ours],
        ),
        "subscribed": _table(
            ("subscribed", "type", "what"), [(f"`{topic.name}`", _type(topic), topic.what) for topic in theirs]
        ),
        "qualities": _table(
            ("topics", "reliability", "durability", "history"),
            [
                (", ".join(f"`{topic.name}`" for topic in TOPICS.values() if topic.qos == qos), *_words(qos))
                for qos in dict.fromkeys(topic.qos for topic in (*ours, *theirs))
            ],
        ),
    }
    return {"ros/topics": tables}


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join(f"|{'|'.join(line)}|" if line[0] == "---" else f"| {' | '.join(line)} |" for line in lines)


def _type(topic: Topic) -> str:
    return topic.type.replace("/msg/", "/")


def _rate(topic: Topic) -> str:
    """Return the default of a scene, if the scene has a rate for the topic."""
    hertz = Outputs.model_fields[str(topic.rate)].default
    return f"{hertz:g} Hz ¹" if hertz else "never ¹"


def _words(qos: Qos) -> tuple[str, str, str]:
    return qos.reliability, qos.durability.replace("_", " "), f"keep last {qos.depth}"
