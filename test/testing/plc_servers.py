# SPDX-License-Identifier: Apache-2.0
"""Soft PLCs that are servers, made with the protocols' own libraries: each scans once `tick` has changed.

A scan that is asked to end ends by itself: one that is cancelled may go on, as `asyncio.wait_for` within the libraries
loses that if an answer comes at the same moment.
"""

from __future__ import annotations

import asyncio
import gc
from abc import ABC, abstractmethod
from collections.abc import Callable
from pathlib import Path

from testing.soft_plc import BOTTLES, SETPOINT, speed

ALARM = "alarms/second zone full"
OWN = "plc/next tick"
Program = Callable[[float], "tuple[float, bool]"]


def program(bottles: float) -> tuple[float, bool]:
    """Speed of the first zone, and whether the alarm stands."""
    return speed(bottles), speed(bottles) == 0.0


class SoftPlc(ABC):
    """One whose values can be as at first again, which is cheaper than another server."""

    def __init__(self) -> None:
        self.scans = 0
        self._ends = False
        self._task: asyncio.Task[None] | None = None

    @abstractmethod
    async def start(self, port: int) -> str:
        """Listen; its address. It does not scan yet."""

    async def scan(self) -> None:
        """Begin, with all values as at first."""
        await self._clear()
        self.scans, self._ends = 0, False
        self._task = asyncio.create_task(self._run())

    async def halt(self) -> None:
        """Scan no more; the server stays."""
        self._ends = True
        if self._task is not None:
            await self._task

    async def stop(self) -> None:
        await self.halt()
        await self._close()

    @abstractmethod
    async def _clear(self) -> None: ...

    @abstractmethod
    async def _run(self) -> None: ...

    @abstractmethod
    async def _close(self) -> None: ...


class OpcUaPlc(SoftPlc):
    """Variables of namespace 2."""

    async def start(self, port: int) -> str:
        from asyncua import Server, ua

        self._server = server = Server()
        gc.disable()  # to look through its thousands of nodes for garbage takes as long as to make them
        try:
            await server.init()
        finally:
            gc.enable()
        server.set_endpoint(f"opc.tcp://127.0.0.1:{port}")
        server.set_security_policy([ua.SecurityPolicyType.NoSecurity])
        assert await server.register_namespace("urn:plc") == 2
        types = {"bottles": "UInt16", "tick": "UInt32", "target": "UInt32", "speed": "Float", "full": "Boolean"}
        self._nodes = {}
        for name, kind in types.items():
            first = False if kind == "Boolean" else 0
            node = await server.nodes.objects.add_variable(
                ua.NodeId(f"GVL.{name}", 2), name, ua.Variant(first, ua.VariantType[kind])
            )
            await node.set_writable()
            self._nodes[name] = node
        await server.start()
        return f"opc.tcp://127.0.0.1:{server.bserver.port}"

    async def _clear(self) -> None:
        first = {"bottles": (0, "UInt16"), "tick": (2**32 - 1, "UInt32"), "target": (0, "UInt32")}
        for name, (value, kind) in {**first, "speed": (0.0, "Float"), "full": (False, "Boolean")}.items():
            await self._write(name, value, kind)

    async def _write(self, name: str, value: float, kind: str) -> None:
        from asyncua import ua

        await self._nodes[name].write_value(ua.Variant(value, ua.VariantType[kind]))

    async def _run(self) -> None:
        last = await self._nodes["tick"].read_value()
        while not self._ends:
            tick = await self._nodes["tick"].read_value()
            if tick != last:
                last = tick
                answer, full = program(await self._nodes["bottles"].read_value())
                await self._write("speed", answer, "Float")
                await self._write("full", full, "Boolean")
                self.scans += 1
                await self._write("target", tick + 1, "UInt32")
            await asyncio.sleep(0.0005)

    async def _close(self) -> None:
        await self._server.stop()

    @staticmethod
    def places() -> dict[str, str]:
        names = {BOTTLES: "bottles", SETPOINT: "speed", ALARM: "full", "run/tick": "tick", "run/target_tick": "target"}
        names[OWN] = "target"
        return {ours: f"ns=2;s=GVL.{theirs}" for ours, theirs in names.items()}


FIRST = [0xFFFF, 0xFFFF, *[0] * 20]
"""Its registers."""


class ModbusPlc(SoftPlc):
    """A soft PLC whose program reads and writes the registers of its server as a client."""

    async def start(self, port: int) -> str:
        from pymodbus.client import AsyncModbusTcpClient
        from pymodbus.server import ModbusTcpServer
        from pymodbus.simulator import DataType, SimData, SimDevice

        words = SimData(0, values=[0] * len(FIRST), datatype=DataType.REGISTERS)
        bits = SimData(0, values=[False] * 16, datatype=DataType.BITS)
        nothing = SimData(0, values=[0], datatype=DataType.REGISTERS)
        self._server = ModbusTcpServer(
            SimDevice(1, simdata=([bits], [bits], [words], [nothing])), address=("127.0.0.1", port)
        )
        await self._server.serve_forever(background=True)
        port = self._server.transport.sockets[0].getsockname()[1]  # type: ignore[union-attr,attr-defined]
        self._client = AsyncModbusTcpClient("127.0.0.1", port=port, timeout=60)
        await self._client.connect()
        return f"modbus://127.0.0.1:{port}"

    async def _clear(self) -> None:
        await self._client.write_registers(0, FIRST)
        await self._client.write_coil(3, False)

    async def _run(self) -> None:
        client, word, real = self._client, self._client.DATATYPE.UINT32, self._client.DATATYPE.FLOAT32
        last = 2**32 - 1
        while not self._ends:
            registers = (await client.read_holding_registers(0, count=4)).registers
            tick = client.convert_from_registers(registers[:2], word)
            if tick != last:
                last = tick
                answer, full = program(registers[2])
                await client.write_registers(8, client.convert_to_registers(answer, real, word_order="little"))
                await client.write_coil(3, full)
                self.scans += 1
                await client.write_registers(10, client.convert_to_registers(tick + 1, word))
            await asyncio.sleep(0.0005)

    async def _close(self) -> None:
        self._client.close()
        await self._server.shutdown()

    @staticmethod
    def places() -> dict[str, str]:
        return {
            BOTTLES: "holding register 2 uint16",
            SETPOINT: "holding register 8 float32 little",
            ALARM: "coil 3 bool",
            "run/tick": "holding register 0 uint32",
            "run/target_tick": "holding register 10 uint32 big",
            OWN: "holding register 10 uint32",
        }


KINDS = {"opcua": OpcUaPlc, "modbus": ModbusPlc}


def write_map(path: Path, places: dict[str, str]) -> Path:
    """A file of tags."""
    path.write_text("tag,theirs\n" + "".join(f"{ours},{theirs}\n" for ours, theirs in places.items()))
    return path
