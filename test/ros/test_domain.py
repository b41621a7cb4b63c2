# SPDX-License-Identifier: Apache-2.0
"""A ROS domain of one's own."""

import os

import pytest

from conveyor_sim.ros.domain import private_domain


def test_two_domains_held_at_once_differ() -> None:
    with private_domain() as first, private_domain() as second:
        assert first != second
        assert os.environ["ROS_DOMAIN_ID"] == str(second)


def test_the_environment_is_local_only_and_put_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DISCOVERY_SERVER", "10.0.0.1:11811")
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    monkeypatch.delenv("ROS_AUTOMATIC_DISCOVERY_RANGE", raising=False)
    with private_domain():
        assert os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "LOCALHOST"
        assert "ROS_DISCOVERY_SERVER" not in os.environ
    assert os.environ["ROS_DISCOVERY_SERVER"] == "10.0.0.1:11811"
    assert os.environ["ROS_DOMAIN_ID"] == "7"
    assert "ROS_AUTOMATIC_DISCOVERY_RANGE" not in os.environ
