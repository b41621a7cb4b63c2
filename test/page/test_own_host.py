# SPDX-License-Identifier: Apache-2.0
"""Names by which a browser may request a server of this machine, in all their spellings."""

from __future__ import annotations

import pytest

from conveyor_sim.page.own_host import authority, is_own, is_same_origin

OWN = [
    "127.0.0.1",
    "127.0.0.1:80",
    "127.0.0.1:8080",
    "127.0.0.1:",
    "127.0.0.1.",
    "localhost",
    "LocalHost:80",
    "localhost.",
    "localhost.:80",
    "[::1]",
    "[::1]:80",
    "[0:0:0:0:0:0:0:1]:80",
]
FOREIGN = [
    "",
    "evil.example",
    "evil.example:80",
    "127.0.0.1.evil.example",
    "localhost.evil.example",
    "localhost..",
    "127.0.0.1@evil.example",
    "evil.example:80@127.0.0.1",
    "127.0.0.1:80:80",
    "127.0.0.1:x",
    "127.0.0.1:99999",
    "127.0.0.1:-1",
    "127.0.0.1:٨٠",  # digits of another script
    "127.0.0.1/x",
    "127.0.0.1 ",
    "127.0.0.1\n",
    "::1",
    "[::1",
    "[::1]x",
    "[::1%25lo]",
    "[::2]",
    "[evil]",
    "0.0.0.0",
    "a" * 100_000,
]


@pytest.mark.parametrize("host", OWN)
def test_names_of_this_machine_are_its_own(host: str) -> None:
    assert is_own([host], "http")


@pytest.mark.parametrize("host", FOREIGN)
def test_other_names_are_foreign(host: str) -> None:
    assert not is_own([host], "http")


def test_there_is_one_header_of_each() -> None:
    host = "127.0.0.1"
    assert not is_own([], "http") and not is_own([host, host], "http")
    origin = f"http://{host}"
    assert is_same_origin([origin], [host], "http")
    assert not is_same_origin([], [host], "http") and not is_same_origin([origin] * 2, [host], "http")
    assert not is_same_origin([origin], [], "http") and not is_same_origin([origin], [host] * 2, "http")


@pytest.mark.parametrize(
    ("origin", "host", "scheme", "same"),
    [
        ("http://127.0.0.1", "127.0.0.1:80", "http", True),
        ("http://127.0.0.1:80", "127.0.0.1", "http", True),
        ("http://127.0.0.1", "127.0.0.1", "http", True),
        ("https://line.example", "line.example:443", "https", True),
        ("https://LINE.example.", "line.example", "https", True),
        ("http://[::1]", "[0:0::1]:80", "http", True),
        ("http://127.0.0.1", "127.0.0.1:8080", "http", False),
        ("http://127.0.0.1:443", "127.0.0.1", "http", False),
        ("https://127.0.0.1", "127.0.0.1", "http", False),
        ("http://127.0.0.1", "127.0.0.1", "https", False),
        ("http://localhost", "127.0.0.1", "http", False),
        ("http://evil.example", "127.0.0.1", "http", False),
        ("http://jo@127.0.0.1", "127.0.0.1", "http", False),
        ("http://127.0.0.1/x", "127.0.0.1", "http", False),
        ("http://[", "127.0.0.1", "http", False),
        ("null", "127.0.0.1", "http", False),
        ("", "127.0.0.1", "http", False),
    ],
)
def test_an_origin_is_that_of_the_server_with_its_default_port(origin: str, host: str, scheme: str, same: bool) -> None:
    assert is_same_origin([origin], [host], scheme) == same


def test_a_default_port_is_that_of_the_scheme() -> None:
    assert authority("line", "http") == ("line", 80) and authority("line", "https") == ("line", 443)
