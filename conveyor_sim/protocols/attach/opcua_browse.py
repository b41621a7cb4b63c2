# SPDX-License-Identifier: Apache-2.0
"""Variables of a PLC that is an OPC UA server, as a map of tags in which names are to be filled in."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from asyncua import ua

from conveyor_sim.line.tag import Tag
from conveyor_sim.protocols.attach.access import PlcAccess
from conveyor_sim.protocols.attach.opcua_client import close_client, open_client
from conveyor_sim.protocols.attach.opcua_link import problem
from conveyor_sim.protocols.attach.opcua_requests import OpcUaRequests, is_writable
from conveyor_sim.protocols.attach.tag_map import COLUMNS, NOTE, mappable
from conveyor_sim.support.printable import printable

MOST_NODES = 250_000
"""Largest number of nodes to look at. Servers may have endless trees."""

PATIENCE = 60.0
"""Longest time for each request, s of wall time. Servers are slow at folders with many nodes."""

_PART = 1000
"""Number of nodes between two reports of the progress."""

_SCALARS = (-1, -2, -3)
"""Value ranks of variables that may hold one value (OPC 10000-3, 5.6.2)."""

_SERVER = ua.NodeId(ua.ObjectIds.Server)


class PlcVariable(NamedTuple):
    """A variable that holds a number or a bool."""

    theirs: str
    """Node ID with the URI of its namespace, which stays the same when indices change."""
    path: tuple[str, ...]
    """Browse names from the folder Objects."""
    kind: str
    """Data type: Float, UInt16, ..."""
    writable: bool


async def browse(
    url: str, access: PlcAccess, say: Callable[[str], object], progress: Callable[[int, int], object]
) -> list[PlcVariable]:
    """Return the variables below the folder Objects of a server, without those that all servers have.

    access, say: as for `open_client`. progress: takes the numbers of nodes and of variables so far. If the server has
    more nodes than `MOST_NODES`, `say` reports it and the others are left out. Raise PlcLinkError, CertificateError.
    """
    client = await open_client(url, access, say, PATIENCE)
    try:
        requests = OpcUaRequests(url, client, PATIENCE)
        await requests.read_limits()
        uris = await requests.namespaces()
        root = ua.NodeId(ua.ObjectIds.ObjectsFolder)
        known: set[ua.NodeId] = {root, _SERVER}
        waiting: list[tuple[ua.NodeId, tuple[str, ...]]] = [(root, ())]
        variables: list[PlcVariable] = []
        while waiting:
            part, waiting = waiting[:_PART], waiting[_PART:]
            below: list[tuple[ua.NodeId, tuple[str, ...]]] = []
            for (_, path), children in zip(part, await requests.children([node for node, _ in part]), strict=True):
                for child in children:
                    node = ua.NodeId(child.NodeId.Identifier, child.NodeId.NamespaceIndex, child.NodeId.NodeIdType)
                    of_another = isinstance(child.NodeId, ua.ExpandedNodeId) and child.NodeId.ServerIndex
                    if node in known or of_another:
                        continue
                    known.add(node)
                    here = (*path, str(child.BrowseName.Name or ""))
                    waiting.append((node, here))
                    if child.NodeClass == ua.NodeClass.Variable and node.NamespaceIndex:
                        below.append((node, here))
            variables += await _described(requests, below, uris)
            progress(len(known), len(variables))
            if len(known) > MOST_NODES:
                say(f"{url}: has more than {MOST_NODES} nodes, the others are left out")
                break
        return variables
    finally:
        await close_client(url, client)


async def _described(
    requests: OpcUaRequests, nodes: Sequence[tuple[ua.NodeId, tuple[str, ...]]], uris: Sequence[str]
) -> list[PlcVariable]:
    """Return those of some variables that hold a number or a bool."""
    ranks = await requests.read([(node, ua.AttributeIds.ValueRank) for node, _ in nodes])
    scalars = [
        each for each, rank in zip(nodes, ranks, strict=True) if _value(rank) is None or _value(rank) in _SCALARS
    ]
    values = await requests.read([(node, ua.AttributeIds.Value) for node, _ in scalars])
    numbers = [(*each, value) for each, value in zip(scalars, values, strict=True) if problem(value) is None]
    rights = await requests.read([(node, ua.AttributeIds.UserAccessLevel) for node, _, _ in numbers])
    return [
        PlcVariable(_theirs(node, uris), path, value.Value.VariantType.name, is_writable(right))
        for (node, path, value), right in zip(numbers, rights, strict=True)
    ]


def tag_rows(variables: Iterable[PlcVariable], tags: Sequence[Tag]) -> str:
    """Return a map of tags (CSV) with a row for each variable. `tag` is empty unless the names match.

    A name matches if the end of the variable's path, or of its ID, has the letters and digits of exactly one tag, and
    no other variable has them: "GVL.belts.zone1.cmd_speed" matches `belts/zone1/cmd_speed`.
    """
    keys = {_key((name,)): name for name in mappable(tags)}
    variables = list(variables)
    matches: dict[str, list[int]] = {}
    for place, variable in enumerate(variables):
        words = re.split(r"[^\w ]+", variable.theirs.partition(";")[2])
        ends = {_key(path[start:]) for path in (variable.path, words) for start in range(len(path))}
        for key in ends & keys.keys():
            matches.setdefault(keys[key], []).append(place)
    names = {places[0]: name for name, places in matches.items() if len(places) == 1}
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow((*COLUMNS, NOTE))
    for place, variable in enumerate(variables):
        note = f"{variable.kind}{'' if variable.writable else ' read-only'} {printable('/'.join(variable.path))}"
        writer.writerow((names.get(place, ""), variable.theirs, note))
    return text.getvalue()


def _key(words: Sequence[str]) -> str:
    """Return the letters and digits of words, without their case."""
    return re.sub(r"[\W_]", "", "".join(words)).casefold()


def _value(data: ua.DataValue) -> object:
    return data.Value.Value if data.Value is not None else None


def _theirs(node: ua.NodeId, uris: Sequence[str]) -> str:
    """Return the text of a node ID with the URI of its namespace (OPC 10000-6, 5.1.12)."""
    index = node.NamespaceIndex
    if not 0 < index < len(uris):
        return str(node.to_string())
    uri = uris[index].replace("%", "%25").replace(";", "%3B")
    local = ua.NodeId(node.Identifier, 0, node.NodeIdType).to_string()
    return f"nsu={uri};{local}"
