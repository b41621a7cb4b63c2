# SPDX-License-Identifier: Apache-2.0
"""Servers of PLC protocols without a program: `python -m bench.plc_servers SCHEME COUNT` prints the URL, then serves.

Values are v0, v1, ... of type REAL, besides tick and target. cpppo (GPL 3) is started as a command, not imported.
"""

from __future__ import annotations

import asyncio
import logging
import os
import sys
import threading
from collections.abc import Callable, Mapping
from typing import Any

TICK, TARGET = "tick", "target"


def place(scheme: str, name: str) -> str:
    """Return the place of a value in a map."""
    number = int(name[1:]) if name not in (TICK, TARGET) else (0 if name == TICK else 1)
    if name in (TICK, TARGET):
        return {
            "opc.tcp": f"ns=2;s={name}",
            "modbus": f"holding register {2 * number} uint32",
            "s7": f"DB1.DBD{4 * number} UDINT",
            "eip": name,
            "ads": f"GVL.{name}",
        }[scheme]
    return {
        "opc.tcp": f"ns=2;s={name}",
        "modbus": f"holding register {4 + 2 * number} float32",
        "s7": f"DB1.DBD{8 + 4 * number} REAL",
        "eip": f"v[{number}]",
        "ads": f"GVL.{name}",
    }[scheme]


async def _opcua(count: int) -> str:
    from asyncua import Server, ua

    server = Server()
    await server.init()
    server.set_endpoint("opc.tcp://127.0.0.1:0")
    server.set_security_policy([ua.SecurityPolicyType.NoSecurity])
    await server.register_namespace("urn:plc")
    kinds = {TICK: "UInt32", TARGET: "UInt32", **{f"v{number}": "Float" for number in range(count)}}
    for name, kind in kinds.items():
        value = ua.Variant(0, ua.VariantType[kind])
        await (await server.nodes.objects.add_variable(ua.NodeId(name, 2), name, value)).set_writable()
    await server.start()
    return f"opc.tcp://127.0.0.1:{server.bserver.port}"


async def _modbus(count: int) -> str:
    from pymodbus.server import ModbusTcpServer
    from pymodbus.simulator import DataType, SimData, SimDevice

    words = SimData(0, values=[0] * (4 + 2 * count), datatype=DataType.REGISTERS)
    nothing = SimData(0, values=[0], datatype=DataType.REGISTERS)
    bits = SimData(0, values=[False] * 16, datatype=DataType.BITS)
    server = ModbusTcpServer(SimDevice(1, simdata=([bits], [bits], [words], [nothing])), address=("127.0.0.1", 0))
    await server.serve_forever(background=True)
    transport: Any = server.transport
    return f"modbus://127.0.0.1:{transport.sockets[0].getsockname()[1]}"


async def _s7(count: int) -> str:
    from snap7.server import Server
    from snap7.type import SrvArea

    server = Server(log=False)
    server.register_area(SrvArea.DB, 1, bytearray(8 + 4 * count))
    server.start_to("127.0.0.1", 0)
    listener: Any = server.server_socket
    return f"s7://127.0.0.1:{listener.getsockname()[1]}"


async def _ads(count: int) -> str:
    from pyads import constants
    from pyads.testserver import AdsTestServer, AdvancedHandler, PLCVariable

    class _Handler(AdvancedHandler):  # type: ignore[misc]
        """Handler whose sum requests take handles, as those of TwinCAT."""

        def get_variable_by_indices(self, index_group: int, index_offset: int) -> Any:
            return self.get_variable_by_handle(index_offset)

    handler = _Handler()
    for name in (TICK, TARGET):
        handler.add_variable(PLCVariable(f"GVL.{name}", 0, constants.ADST_UINT32, "UDINT"))
    for number in range(count):
        handler.add_variable(PLCVariable(f"GVL.v{number}", 0.0, constants.ADST_REAL32, "REAL"))
    server = AdsTestServer(handler=handler, ip_address="127.0.0.1", port=0)
    server.server.listen()
    server.start()
    return f"ads://5.1.2.3.1.1:851?host=127.0.0.1:{server.server.getsockname()[1]}"


SERVERS: Mapping[str, Callable[[int], Any]] = {"opc.tcp": _opcua, "modbus": _modbus, "s7": _s7, "ads": _ads}


def main() -> None:
    """Serve until standard input ends."""
    scheme, count = sys.argv[1], int(sys.argv[2])
    if scheme == "eip":
        tags = [f"{TICK}=DINT", f"{TARGET}=DINT", f"v=REAL[{count}]"]
        options = ["--no-config", "-A", "--no-udp", "--no-print", "-a", "127.0.0.1:0"]
        os.execv(sys.executable, [sys.executable, "-m", "cpppo.server.enip", *options, *tags])
    logging.disable(logging.WARNING)

    async def serve() -> None:
        print(await SERVERS[scheme](count), flush=True)
        over = asyncio.Event()
        loop = asyncio.get_running_loop()
        threading.Thread(target=lambda: (sys.stdin.read(), loop.call_soon_threadsafe(over.set)), daemon=True).start()
        await over.wait()
        os._exit(0)

    asyncio.run(serve())


if __name__ == "__main__":
    main()
