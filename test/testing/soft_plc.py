# SPDX-License-Identifier: Apache-2.0
"""A soft PLC in a separate process: it holds the first zone while bottles are on the second. By Modbus or OPC UA.

Argument: number of scans after which it ends without output, "" for never.
"""

from __future__ import annotations

import asyncio
import os
import sys
import time

MOST = 2  # bottles on the second zone
SPEED = 0.5  # m/s
PAUSE = 0.001  # s of wall time between two looks at the tick
BOTTLES, SETPOINT = "belts/zone2/bottles", "belts/zone1/cmd_speed"


def speed(bottles: float) -> float:
    """The program."""
    return 0.0 if bottles > MOST else SPEED


def by_modbus(host: str, port: int, scans: int | None) -> None:
    """Three requests a scan; the target is in the last address of the last."""
    from pymodbus.client import ModbusTcpClient

    from conveyor_sim.line.line import image_of
    from conveyor_sim.protocols.modbus.address_map import HANDSHAKE, modbus_map
    from conveyor_sim.scene import load_scene

    rows = {row.name: row for row in modbus_map(image_of(load_scene("config/scenarios/zoned_line.yaml")).tags)}
    with ModbusTcpClient(host, port=port, timeout=60) as client:
        word = client.DATATYPE.UINT32
        done = 0
        while scans is None or done < scans:
            now = client.convert_from_registers(client.read_input_registers(HANDSHAKE, count=2).registers, word)
            read = client.read_input_registers(rows[BOTTLES].address, count=2).registers
            answer = speed(client.convert_from_registers(read, word))
            words = client.convert_to_registers(answer, client.DATATYPE.FLOAT32)
            assert not client.write_registers(rows[SETPOINT].address, words).isError()
            target = client.convert_to_registers(now + 1, word)
            for _ in range(2):  # repeats are harmless
                assert not client.write_registers(HANDSHAKE, target).isError()
            while now == client.convert_from_registers(client.read_input_registers(HANDSHAKE, count=2).registers, word):
                time.sleep(PAUSE)
            done += 1


async def by_opcua(address: str, scans: int | None) -> None:
    """The tick is monitored, as it is the last of all values that change."""
    from asyncua import Client, ua

    client = Client(address, timeout=60, watchdog_intervall=60)
    client.set_user("plc")
    client.set_password(os.environ["CONVEYOR_SIM_PASSWORD"])
    await client.set_security_string(SECURITY.format(*await own_certificate()))
    async with client:
        tick, target, bottles, setpoint = (
            client.get_node(f"ns=2;s={name}") for name in ("run/tick", "run/target_tick", BOTTLES, SETPOINT)
        )
        now, done = await tick.read_value(), 0
        while scans is None or done < scans:
            answer = speed(await bottles.read_value())
            await setpoint.write_value(ua.Variant(answer, ua.VariantType.Double))
            await target.write_value(ua.Variant(now + 1, ua.VariantType.Int64))
            while (reached := await tick.read_value()) == now:
                await asyncio.sleep(PAUSE)
            now, done = reached, done + 1


SECURITY = "Basic256Sha256,SignAndEncrypt,{},{}"


async def own_certificate() -> tuple[str, str]:
    """Make certificate and key of this client in the working folder, and return their paths."""
    from asyncua.crypto.cert_gen import setup_self_signed_certificate
    from cryptography.x509.oid import ExtendedKeyUsageOID

    folder = os.environ["SOFT_PLC_FOLDER"]
    from pathlib import Path

    key, certificate = Path(folder) / "key.pem", Path(folder) / "certificate.der"
    await setup_self_signed_certificate(
        key, certificate, "urn:soft_plc", "localhost", [ExtendedKeyUsageOID.CLIENT_AUTH], {"commonName": "soft_plc"}
    )
    return str(certificate), str(key)


if __name__ == "__main__":
    kind, _, rest = os.environ["CONVEYOR_SIM_ADDRESS"].partition("://")
    scans = int(sys.argv[1]) if sys.argv[1:] else None
    if kind == "modbus":
        host, _, port = rest.rpartition(":")
        by_modbus(host, int(port), scans)
    else:
        asyncio.run(by_opcua(os.environ["CONVEYOR_SIM_ADDRESS"], scans))
