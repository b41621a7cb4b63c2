# SPDX-License-Identifier: Apache-2.0
"""Links to PLCs, whose answers are flipped, cut off, doubled, replaced, delayed or lost.

Each call returns or fails as a ConveyorError. A value that comes is that of the PLC at that time, unless its bytes were
changed. Afterwards a new link works.
"""

from __future__ import annotations

import atexit
import random
from contextlib import ExitStack
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from fuzz.violation import Violation
from testing.faults import RIGHT_VALUES, WRONG_VALUES, after, cut_off
from testing.faulty_proxy import FaultyProxy, healthy
from testing.plc_servers import KINDS as SCADA_KINDS
from testing.vendor_servers import VENDORS

from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.tag import count
from conveyor_sim.protocols.attach import isolated_link, modbus_link, opcua_client, vendor_links
from conveyor_sim.protocols.attach.links import LIBRARIES, plc_link
from conveyor_sim.protocols.attach.tag_map import MappedTag
from conveyor_sim.protocols.hosting.server_thread import ServerThread

KINDS = {"opc.tcp": SCADA_KINDS["opcua"], "modbus": SCADA_KINDS["modbus"], **VENDORS}
ROUNDS = 3
"""Writes and reads of one case."""
PATIENCE, LIMIT = 1.0, 5.0
"""s for an answer of a faulty PLC, and for a process that waits for one."""
USUAL = vendor_links.PATIENCE, isolated_link.LIMIT


class Station:
    """A PLC of each kind behind a proxy."""

    def __init__(self, scheme: str) -> None:
        """Start the PLC."""
        self._open = ExitStack()
        self._plcs, self.links = (self._open.enter_context(ServerThread()) for _ in range(2))
        self._made: Any = KINDS[scheme]()
        url = self._plcs.run(self._made.start(0))
        self._open.callback(lambda: self._plcs.run(self._made.stop()))
        self._plcs.run(self._made._clear())
        port = int(url.rpartition(":")[2])
        self.proxy = FaultyProxy(port)
        self._open.callback(self.proxy.close)
        self._url = url.replace(f":{port}", f":{self.proxy.port}")
        places = self._made.places()
        self.mapped = [MappedTag(count(name, "status", ""), place, "map: line 1") for name, place in places.items()]
        self.names = [each.tag.name for each in self.mapped]

    def link(self) -> Any:
        """Return a new link through the proxy."""
        return plc_link(self._url, self.mapped)

    def close(self) -> None:
        """End everything."""
        self._open.close()


@cache
def _station(scheme: str) -> Station:
    station = Station(scheme)
    atexit.register(station.close)
    return station


def attack(seed: int, folder: Path) -> str:
    """Play one case. Return the kind of link and what became of it. Raise Violation."""
    rng = random.Random(seed)
    scheme = rng.choice([scheme for scheme, (library, _) in LIBRARIES.items() if find_spec(library)])
    station, begin = _station(scheme), rng.randrange(12)
    kind = rng.choice([*WRONG_VALUES, *RIGHT_VALUES, "cut off"])
    damage = {**WRONG_VALUES, **RIGHT_VALUES}.get(kind)
    station.proxy.fault = cut_off(begin, rng) if damage is None else after(begin, damage, rng)
    _wait_up_to(PATIENCE, LIMIT)
    outcome = _play(station, kind not in WRONG_VALUES, rng)
    _wait_up_to(*USUAL)
    station.proxy.fault = healthy
    station.proxy.cut()
    if (again := _play(station, True, rng)) != "works":
        raise Violation("not reached again", f"{scheme} after {kind}: {again}")
    return f"{scheme} {outcome}"


def _wait_up_to(patience: float, limit: float) -> None:
    vendor_links.PATIENCE = modbus_link.PATIENCE = opcua_client.PATIENCE = patience
    isolated_link.LIMIT = limit


def _play(station: Station, is_right: bool, rng: random.Random) -> str:
    link, run = station.link(), station.links.run
    written = ("run/tick", "run/target_tick")
    try:
        run(link.connect())
        for _ in range(ROUNDS):
            values = {name: float(rng.randrange(2**31)) for name in written}
            run(link.write(values))
            answer = run(link.read(station.names))
            if [*answer] != station.names and set(answer) != set(station.names):
                raise Violation("names", f"{sorted(answer)} for {sorted(station.names)}")
            if is_right and any(answer[name] != value for name, value in values.items()):
                raise Violation("stale value", f"{answer} after {values}")
    except ConveyorError:
        return "refused"
    finally:
        run(link.close())
    return "works"
