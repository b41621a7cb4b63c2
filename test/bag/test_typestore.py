# SPDX-License-Identifier: Apache-2.0
"""Message types without ROS agree with the ones ROS has built."""

import json
import os
import sys
from pathlib import Path

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from conveyor_sim.bag.messages.topics import OUTPUTS
from conveyor_sim.bag.messages.typestore import DISTROS, definition, type_hash, typestore
from conveyor_sim.errors import ConveyorError

TYPES = sorted({output.type for output in OUTPUTS.values()})


@pytest.mark.parametrize("name", TYPES)
def test_hash_equals_the_one_of_the_installed_message_package(name: str) -> None:
    """`share/<package>/msg/<Name>.json` is written by ROS's own generator."""
    package, _, short_name = name.split("/")
    prefixes = os.environ.get("AMENT_PREFIX_PATH", sys.prefix).split(os.pathsep)
    files = [Path(prefix) / "share" / package / "msg" / f"{short_name}.json" for prefix in prefixes]
    installed = [file for file in files if file.exists()]
    if not installed:
        pytest.skip(f"{package} is not installed")
    description = json.loads(installed[0].read_text())
    hashes = {entry["type_name"]: entry["hash_string"] for entry in description["type_hashes"]}
    assert type_hash(name) == hashes[name]


@pytest.mark.parametrize("name", TYPES)
def test_all_distributions_agree(name: str) -> None:
    """So bags and nodes of both can be mixed."""
    assert len({type_hash(name, distro) for distro in DISTROS}) == 1


@pytest.mark.parametrize("name", TYPES)
def test_definition_alone_is_enough_to_know_the_type(name: str) -> None:
    """A reader that has nothing but the schema in the file gets the same type."""
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(definition(name), name))
    assert store.hash_rihs01(name) == type_hash(name)


def test_definition_keeps_the_units() -> None:
    assert "# m/s" in definition("conveyor_msgs/msg/Bottles")


def test_unknown_distribution_is_refused_by_name() -> None:
    with pytest.raises(ConveyorError, match="'indigo' given, expected one of jazzy, kilted"):
        typestore("indigo")
