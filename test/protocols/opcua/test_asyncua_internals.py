# SPDX-License-Identifier: Apache-2.0
"""Assumptions about private names of asyncua; a new release that breaks one fails here first."""

from __future__ import annotations

import inspect
import re

import pytest

from conveyor_sim.protocols.opcua import asyncua_internals

CLASSES = [
    kind
    for kind in vars(asyncua_internals).values()
    if inspect.isclass(kind) and kind.__module__ == asyncua_internals.__name__
]


@pytest.mark.parametrize("kind", CLASSES)
def test_the_library_has_each_private_name(kind: type) -> None:
    (base,) = kind.__bases__
    names = set(re.findall(r"\._([a-z]\w*)|def _([a-z]\w*)", inspect.getsource(kind)))
    assert names
    for first, second in names:
        assert re.search(rf"\b_{first or second}\b", inspect.getsource(inspect.getmodule(base)))


@pytest.mark.parametrize("kind", CLASSES)
def test_no_public_name_is_one_of_the_library(kind: type) -> None:
    (base,) = kind.__bases__
    assert {name for name in vars(kind) if not name.startswith("_")} & set(dir(base)) == set()


def test_sessions_and_publish_requests_are_where_they_are_expected() -> None:
    from asyncua.server import internal_server, uaprocessor

    assert "self._external_sessions" in inspect.getsource(internal_server)
    assert "self._publish_results_subs" in inspect.getsource(uaprocessor)
