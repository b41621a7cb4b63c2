# SPDX-License-Identifier: Apache-2.0
"""Interface packages of ROS that are built here: the same types, constants and comments as the released packages."""

import hashlib
import importlib
import json
import os
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from conveyor_sim.bag.messages.typestore import DISTROS, default_distro

TOOLS = Path(__file__).resolve().parents[2] / "tools" / "message_build"
PACKAGES = json.loads((TOOLS / "packages.json").read_text())
RELEASED = {
    file: blob
    for blob, file in map(str.split, (Path(__file__).parent / "simulation_interfaces.txt").read_text().splitlines()[2:])
}
"""Git's names of the contents of the released definitions, by file."""


def definitions(folder: Path) -> dict[str, str]:
    """Return the definitions in a folder, by file."""
    files = [file for kind in ("msg", "srv", "action") for file in folder.glob(f"{kind}/*.{kind}")]
    return {str(file.relative_to(folder)): file.read_text() for file in files}


def share(package: str) -> Path:
    prefixes = os.environ.get("AMENT_PREFIX_PATH", sys.prefix).split(os.pathsep)
    return next(folder for prefix in prefixes if (folder := Path(prefix, "share", package)).is_dir())


def test_the_definitions_are_those_of_the_release() -> None:
    """Comments and constants included: they are not part of a type's hash."""
    contents = {file: text.encode() for file, text in definitions(TOOLS / "definitions/simulation_interfaces").items()}
    names = {file: hashlib.sha1(b"blob %d\0" % len(data) + data).hexdigest() for file, data in contents.items()}
    assert names == RELEASED


@pytest.mark.parametrize("package", PACKAGES)
def test_the_installed_package_has_these_definitions(package: str) -> None:
    assert definitions(share(package)) == definitions(TOOLS / "definitions" / package)


@pytest.mark.parametrize("package", PACKAGES)
def test_the_installed_package_has_the_version_of_the_distribution(package: str) -> None:
    version = ElementTree.parse(share(package) / "package.xml").findtext("version")
    assert version == PACKAGES[package]["version"][default_distro()]
    assert set(PACKAGES[package]["version"]) == set(DISTROS)


@pytest.mark.parametrize("package", PACKAGES)
def test_hashes_of_messages_follow_from_the_definitions(package: str) -> None:
    """rosbags derives the RIHS01 hashes from the text alone. ROS announces the ones in the .json files."""
    texts = {file: text for file, text in definitions(TOOLS / "definitions" / package).items() if file.endswith(".msg")}
    assert texts
    store, types = get_typestore(Stores.ROS2_JAZZY), {}
    names = {file: f"{package}/msg/{Path(file).stem}" for file in texts}
    for file, text in texts.items():
        types.update(get_types_from_msg(text, names[file]))
    store.register({name: fields for name, fields in types.items() if name not in store.fielddefs})
    for file, name in names.items():
        description = json.loads((share(package) / file).with_suffix(".json").read_text())
        announced = {entry["type_name"]: entry["hash_string"] for entry in description["type_hashes"]}
        assert store.hash_rihs01(name) == announced[name], name


@pytest.mark.parametrize("package", PACKAGES)
def test_constants_of_the_python_classes_are_those_of_the_definitions(package: str) -> None:
    classes = importlib.import_module(f"{package}.msg")
    for file, text in definitions(TOOLS / "definitions" / package).items():
        if not file.endswith(".msg"):
            continue
        lines = [line.partition("#")[0].split() for line in text.splitlines()]
        constants = {name: int(value) for _, name, _, value in (line for line in lines if line[2:3] == ["="])}
        kind = getattr(classes, Path(file).stem)
        assert {name: getattr(kind, name) for name in constants} == constants
