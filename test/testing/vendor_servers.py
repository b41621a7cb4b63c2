# SPDX-License-Identifier: Apache-2.0
"""Soft PLCs behind the servers of vendors' protocols: snap7's and pyads' in this process, cpppo in another one.

cpppo is under the GPL 3: it is started as a command and reached over TCP, and nothing of this project imports it.
"""

from __future__ import annotations

import asyncio
import os
import re
import struct
import sys
import tempfile
import time
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from testing.plc_servers import ALARM, OWN, SoftPlc
from testing.soft_plc import BOTTLES, MOST, SETPOINT

from conveyor_sim.support.child_process import Process

SPEED = 0.43
"""m/s. No number of 32 bits."""
NAMES = {BOTTLES: "bottles", SETPOINT: "speed", ALARM: "full", "run/tick": "tick", "run/target_tick": "target"}
FIRST = {"bottles": 0, "tick": 2**31 - 1, "target": 0, "speed": 0.0, "full": False}
FILL = 400
"""Further values of type REAL, by the names fill0, fill1, ..."""


def program(bottles: float) -> tuple[float, bool]:
    """Speed of the first zone, and whether the alarm stands."""
    return (0.0, True) if bottles > MOST else (SPEED, False)


class VendorPlc(SoftPlc):
    """One with named values, whose speed is a REAL or an LREAL."""

    library, extra = "", ""
    pause = 0.0002
    """s between two looks at the tick."""

    def __init__(self, real: str = "REAL") -> None:
        super().__init__()
        self.real = real

    @abstractmethod
    async def get(self, name: str) -> float: ...

    async def get_all(self, names: Sequence[str]) -> list[float]:
        return [await self.get(name) for name in names]

    @abstractmethod
    async def put(self, values: Mapping[str, float]) -> None: ...

    @abstractmethod
    def place(self, name: str) -> str:
        """Return the place of a value in a map."""

    def places(self) -> dict[str, str]:
        return {ours: self.place(theirs) for ours, theirs in NAMES.items()} | {OWN: self.place("target")}

    async def _clear(self) -> None:
        await self.put(FIRST)

    async def _run(self) -> None:
        last = await self.get("tick")
        while not self._ends:
            tick = await self.get("tick")
            if tick != last:
                last = tick
                answer, full = program(await self.get("bottles"))
                await self.put({"speed": answer, "full": full})
                self.scans += 1
                await self.put({"target": tick + 1})
            await asyncio.sleep(self.pause)


S7_PLACES = {
    "tick": (0, ">I", "DB1.DBD0 UDINT"),
    "target": (4, ">i", "DB1.DBD4 DINT"),
    "bottles": (8, ">h", "DB1.DBW8 INT"),
    "REAL": (12, ">f", "DB1.DBD12 REAL"),
    "LREAL": (16, ">d", "DB1.DBX16.0 LREAL"),
    **{f"fill{number}": (32 + 4 * number, ">f", f"DB1.DBD{32 + 4 * number} REAL") for number in range(FILL)},
}
FULL_BYTE, FULL_BIT = 10, 3


class S7Plc(VendorPlc):
    """snap7's server."""

    library, extra = "snap7", "s7"

    async def start(self, port: int) -> str:
        from snap7.server import Server
        from snap7.type import SrvArea

        class _Server(Server):
            """One that writes a bit alone; snap7's own writes the byte of it."""

            def _parse_address_specification(self, addr_spec: bytes) -> dict[str, Any]:
                address = super()._parse_address_specification(addr_spec)
                return address | {"bit": addr_spec[11] % 8}

            def _parse_write_address(self, request: dict[str, Any]) -> Any:
                parsed = super()._parse_write_address(request)
                address = request["parameters"]["address_spec"]
                if parsed is None or address["word_len"] != 1:
                    return parsed
                area, number, start, count, data = parsed
                mask = 1 << address["bit"]
                now = self.memory_areas[area, number][start]
                return area, number, start, count, bytearray([now | mask if data[0] else now & ~mask])

        self._server = _Server(log=False)
        self._server.register_area(SrvArea.DB, 1, bytearray(32 + 4 * FILL))
        self._server.register_area(SrvArea.MK, 0, bytearray(64))
        (self.memory,) = (data for (_, number), data in self._server.memory_areas.items() if number == 1)
        (self.merkers,) = (data for (_, number), data in self._server.memory_areas.items() if number == 0)
        self._server.start_to("127.0.0.1", port)
        return f"s7://127.0.0.1:{self._server.server_socket.getsockname()[1]}"  # type: ignore[union-attr]

    async def get(self, name: str) -> float:
        at, code, _ = S7_PLACES[self.real if name == "speed" else name]
        return float(struct.unpack_from(code, self.memory, at)[0])

    async def put(self, values: Mapping[str, float]) -> None:
        for name, value in values.items():
            if name == "full":
                mask = 1 << FULL_BIT
                now = self.memory[FULL_BYTE]
                self.memory[FULL_BYTE] = now | mask if value else now & ~mask
            else:
                at, code, _ = S7_PLACES[self.real if name == "speed" else name]
                struct.pack_into(code, self.memory, at, value if code in (">f", ">d") else int(value))

    def place(self, name: str) -> str:
        return f"DB1.DBX{FULL_BYTE}.{FULL_BIT} BOOL" if name == "full" else S7_PLACES[self._of(name)][2]

    def _of(self, name: str) -> str:
        return self.real if name == "speed" else name

    async def _close(self) -> None:
        self._server.stop()


EIP_TYPES = {"tick": "DINT", "target": "DINT", "bottles": "INT", "full": "BOOL"}


class EipPlc(VendorPlc):
    """cpppo, whose tags the program reads and writes as a client."""

    library, extra = "pylogix", "ethernet_ip"
    pause = 0.001

    async def start(self, port: int) -> str:
        from pylogix import PLC

        types = {**EIP_TYPES, "speed": self.real}
        tags = [*(f"{name}={kind}" for name, kind in types.items()), f"fill=REAL[{FILL}]"]
        server = [sys.executable, "-m", "cpppo.server.enip", "--no-config", "-A", "--no-udp", "--no-print"]
        self._folder = tempfile.TemporaryDirectory()
        command = [*server, "-a", f"127.0.0.1:{port}", *tags]
        self._process = Process("cpppo", command, {**os.environ, "PYTHONUNBUFFERED": "1"}, Path(self._folder.name))
        while (line := re.search(r"address = .*, (\d+)\)", self._process.log.read_text())) is None:
            assert self._process.exit_code is None, self._process.obituary()
            await asyncio.sleep(0.01)
        port = int(line[1])
        self._client = PLC("127.0.0.1", 0, 60.0, port=port)
        self._one_request = asyncio.Lock()  # a test writes while the program scans, over the same connection
        return f"eip://127.0.0.1:{port}"

    async def get(self, name: str) -> float:
        return float((await self._ask(self._client.Read, self.place(name))).Value)

    async def get_all(self, names: Sequence[str]) -> list[float]:
        answers = await self._ask(self._client.Read, [self.place(name) for name in names])
        return [float(answer.Value) for answer in answers]

    async def put(self, values: Mapping[str, float]) -> None:
        types = {"tick": int, "target": int, "bottles": int, "full": bool}
        pairs = [(self.place(name), types.get(name, float)(value)) for name, value in values.items()]
        await self._ask(self._client.Write, pairs)

    async def _ask(self, request: Callable[[Any], Any], of: Any) -> Any:
        async with self._one_request:
            return await asyncio.to_thread(request, of)

    def place(self, name: str) -> str:
        return re.sub(r"^fill(\d+)$", r"fill[\1]", name)

    async def _close(self) -> None:
        self._client.Close()
        self._process.stop()
        self._folder.cleanup()


ADS_TYPES = {"tick": "UDINT", "target": "UDINT", "bottles": "INT", "full": "BOOL"}
ADS_CODES = {"UDINT": "<I", "INT": "<h", "BOOL": "<?", "REAL": "<f", "LREAL": "<d"}


class AdsPlc(VendorPlc):
    """pyads' test server."""

    library, extra = "pyads", "ads"

    async def start(self, port: int) -> str:
        from pyads import constants
        from pyads.testserver import AdsTestServer, AdvancedHandler, PLCVariable

        class _Handler(AdvancedHandler):  # type: ignore[misc]
            """One whose sum requests take handles, as those of TwinCAT, and that names errors."""

            def get_variable_by_indices(self, index_group: int, index_offset: int) -> Any:
                by_handle = index_group == constants.ADSIGRP_SYM_VALBYHND
                find = self.get_variable_by_handle if by_handle else super().get_variable_by_indices
                return find(*((index_offset,) if by_handle else (index_group, index_offset)))

            def handle_request(self, request: Any) -> Any:
                from pyads.testserver.handler import AmsResponseData

                try:
                    return super().handle_request(request)
                except KeyError:
                    state = struct.pack("<H", struct.unpack("<H", request.ams_header.state_flags)[0] | 1)
                    return AmsResponseData(state, b"\0\0\0\0", struct.pack("<II", 0x710, 0))

        codes = {"REAL": constants.ADST_REAL32, "LREAL": constants.ADST_REAL64, "BOOL": constants.ADST_BIT}
        codes |= {"UDINT": constants.ADST_UINT32, "INT": constants.ADST_INT16}
        kinds = {**ADS_TYPES, "speed": self.real, **{f"fill{number}": "REAL" for number in range(FILL)}}
        if not hasattr(self, "handler"):
            self.handler = _Handler()
            self.variables = {name: PLCVariable(f"GVL.{name}", 0, codes[kind], kind) for name, kind in kinds.items()}
            for variable in self.variables.values():
                self.handler.add_variable(variable)
        self._server = AdsTestServer(handler=self.handler, ip_address="127.0.0.1", port=port)
        self._server.start()
        port = self._server.server.getsockname()[1]
        while not getattr(self._server, "_run", False):
            time.sleep(0.01)
        return f"ads://5.1.2.3.1.1:851?host=127.0.0.1:{port}"

    async def get(self, name: str) -> float:
        variable = self.variables[name]
        return float(struct.unpack(ADS_CODES[variable.symbol_type], variable.value)[0])

    async def put(self, values: Mapping[str, float]) -> None:
        for name, value in values.items():
            variable = self.variables[name]
            code = ADS_CODES[variable.symbol_type]
            fitted = value if code in ("<f", "<d") else bool(value) if code == "<?" else int(value)
            variable.value = struct.pack(code, fitted)

    def place(self, name: str) -> str:
        return f"GVL.{name}"

    async def _close(self) -> None:
        self._server.close()


VENDORS: dict[str, type[VendorPlc]] = {"s7": S7Plc, "eip": EipPlc, "ads": AdsPlc}
