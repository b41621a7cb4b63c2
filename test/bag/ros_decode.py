# SPDX-License-Identifier: Apache-2.0
"""Decodes messages with ROS itself and compares them with rosbags' objects."""

from typing import Any

import numpy as np
import pytest


def deserialize(type_name: str, data: bytes) -> Any:
    """The rclpy object that the bytes are; skips the test where ROS is not installed."""
    serialization = pytest.importorskip("rclpy.serialization")
    package, _, name = type_name.split("/")
    return serialization.deserialize_message(data, getattr(pytest.importorskip(f"{package}.msg"), name))


def assert_same(ros: Any, other: Any) -> None:
    """Every field of an rclpy message equals that of a rosbags message, NaN included."""
    if hasattr(ros, "get_fields_and_field_types"):
        for name in ros.get_fields_and_field_types():
            assert_same(getattr(ros, name), getattr(other, name))
    elif isinstance(ros, (str, bool, int, float)):
        np.testing.assert_equal(other, ros)
    elif len(ros) and hasattr(ros[0], "get_fields_and_field_types"):
        assert len(ros) == len(other)
        for one, two in zip(ros, other, strict=True):
            assert_same(one, two)
    else:
        np.testing.assert_array_equal(np.asarray(other), np.asarray(ros))
