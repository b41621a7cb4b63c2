# SPDX-License-Identifier: Apache-2.0
"""ROS that can't start says why in one sentence."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import pytest
from ros.conftest import SMALL_LINE
from ros.recording import record
from warm import run

from conveyor_sim.bag.recover import recover
from conveyor_sim.ros.context import UNPROTECTED

SIM_NODE = ["-m", "conveyor_sim.ros.sim_node", "--ros-args", "-p", f"scene:={SMALL_LINE}"]
CONVEYOR_SIM = ["-c", "from conveyor_sim.cli import main; main()"]
ENFORCE = {"ROS_SECURITY_ENABLE": "true", "ROS_SECURITY_STRATEGY": "Enforce"}
MISSING = {**ENFORCE, "ROS_SECURITY_KEYSTORE": "/no/such"}
NO_FOLDER = (
    "ROS_SECURITY_KEYSTORE: '/no/such' given, which has no folder enclaves/, expected a keystore made by "
    "`ros2 security create_keystore`, because ROS_SECURITY_STRATEGY is Enforce"
)
ALONE = {"ROS_DOMAIN_ID": "99", "ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}


def refused(arguments: list[str], environment: Mapping[str, str]) -> str:
    """The sentence with which a program ends."""
    return said(arguments, environment).splitlines()[-1]


def said(arguments: list[str], environment: Mapping[str, str]) -> str:
    """All that a program says until it ends with exit code 1."""
    done = run(arguments, env={**os.environ, **ALONE, **environment})
    assert done.returncode == 1, done.stderr
    assert "Traceback" not in done.stdout + done.stderr
    return done.stderr


@pytest.mark.parametrize(
    ("arguments", "environment", "sentence"),
    [
        ([], MISSING, NO_FOLDER),
        ([], ENFORCE, "ROS_SECURITY_KEYSTORE: not set, expected a keystore"),
        ([], {"ROS_DOMAIN_ID": "233"}, "ROS_DOMAIN_ID: '233' given, expected a whole number from 0 to 232"),
        (["--params-file", "no_such.yaml"], {}, "Couldn't parse params file: '--params-file no_such.yaml'"),
        (["--no-such-option"], {}, "ROS can't start: ['--no-such-option']"),
        (["-r", "poses:=bottles"], {}, "ROS can't start: Failed to create publisher: "),
        ([], {"FASTRTPS_DEFAULT_PROFILES_FILE": "/no/such"}, "'/no/such' given, which can't be read (No such file"),
        ([], {"FASTRTPS_DEFAULT_PROFILES_FILE": __file__}, "which is no XML (not well-formed"),
    ],
    ids=["keystore", "no keystore", "domain", "parameters", "option", "names", "no profile", "profile"],
)
def test_of_the_simulation(arguments: list[str], environment: Mapping[str, str], sentence: str) -> None:
    text = refused([*SIM_NODE, *arguments], environment)
    assert text.startswith("sim_node: ")
    assert sentence in text
    assert ".c:" not in text


def test_of_names_that_clash_where_there_is_a_recording(tmp_path: Path) -> None:
    text = refused([*SIM_NODE, "-p", f"record:={tmp_path / 'bag'}", "-r", "commands:=line"], {})
    assert text.startswith("sim_node: ROS can't start: Failed to create subscription: ")
    assert recover(tmp_path / "bag").healthy


def test_of_a_keystore_that_cannot_be_used(tmp_path: Path) -> None:
    """The wheels are built without security; where it is there, these files are no certificates."""
    enclave = tmp_path / "enclaves"
    enclave.mkdir()
    for name in ("identity_ca.cert", "cert", "key", "permissions_ca.cert"):
        (enclave / f"{name}.pem").write_text("none")
    for name in ("governance", "permissions"):
        (enclave / f"{name}.p7s").write_text("none")
    text = refused(SIM_NODE, {**ENFORCE, "ROS_SECURITY_KEYSTORE": str(tmp_path)})
    assert text.startswith("sim_node: ROS can't start: ")


@pytest.mark.parametrize("strategy", [{}, {"ROS_SECURITY_STRATEGY": "enforce"}], ids=["none", "wrong"])
def test_who_asks_for_security_and_does_not_enforce_it_is_warned(strategy: Mapping[str, str]) -> None:
    environment = {"ROS_SECURITY_ENABLE": "true", "ROS_SECURITY_KEYSTORE": "/no/such", **strategy}
    assert UNPROTECTED in said([*SIM_NODE, "-p", "clock_rate:=-1.0"], environment)


def test_of_a_controller() -> None:
    assert refused(["-m", "conveyor_sim.ros.controller_node"], MISSING) == f"controller_node: {NO_FOLDER}"


def test_of_a_playback(tmp_path: Path) -> None:
    record(tmp_path / "bag")
    assert NO_FOLDER in refused([*CONVEYOR_SIM, "replay", str(tmp_path / "bag"), "--publish"], MISSING)
