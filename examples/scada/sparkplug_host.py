# SPDX-License-Identifier: Apache-2.0
"""A host application of MQTT Sparkplug B: shows the values of a line as they change, and gives commands.

python examples/scada/sparkplug_host.py zoned_line/zoned_line                              # all values
python examples/scada/sparkplug_host.py zoned_line/zoned_line 'belts/*/speed'              # of some metrics
python examples/scada/sparkplug_host.py zoned_line/zoned_line --set belts/zone1/mode=3     # a command
"""

import argparse
import sys
import time
from fnmatch import fnmatchcase
from typing import Any

from paho.mqtt.client import Client
from paho.mqtt.enums import CallbackAPIVersion

from conveyor_sim.protocols.mqtt.line_metrics import BOOLEAN, INT32, INT64, Payload, add_metric, decoded, whole

parser = argparse.ArgumentParser(description="Shows the values of a line as they change, and gives commands.")
parser.add_argument("line", metavar="GROUP/NODE", help="as conveyor-sim serve --mqtt names them")
parser.add_argument("metrics", nargs="*", default=["*"], help="patterns of what is shown (default: all)")
parser.add_argument("--set", action="append", default=[], metavar="METRIC=NUMBER", help="a command, after the birth")
parser.add_argument("--host", default="127.0.0.1", help="of the broker")
parser.add_argument("--port", type=int, default=1883)
given = parser.parse_args()
if given.line.count("/") != 1:
    parser.error(f"{given.line} given, expected GROUP/NODE")
group, node = given.line.split("/")
try:
    commands = {name: float(value) for name, value in (each.split("=", 1) for each in given.set)}
except ValueError:
    parser.error(f"--set {' '.join(given.set)} given, expected METRIC=NUMBER")


def publish(kind: str, device: str, metrics: list[tuple[str, int, float]]) -> None:
    payload = Payload(timestamp=int(time.time() * 1e3))
    for name, datatype, value in metrics:
        add_metric(payload, name, datatype, value, payload.timestamp)
    client.publish(f"spBv1.0/{group}/{kind}/{node}{device}", payload.SerializeToString())


def connected(client: Client, *_: Any) -> None:
    client.subscribe([(f"spBv1.0/{group}/{kind}/{node}/#", 1) for kind in ("NBIRTH", "NDATA", "NDEATH")])
    client.subscribe([(f"spBv1.0/{group}/{kind}/{node}/line", 1) for kind in ("DBIRTH", "DDATA", "DDEATH")])
    publish("NCMD", "", [("Node Control/Rebirth", BOOLEAN, 1.0)])  # a host that starts late requests all births


def heard(client: Client, _: Any, message: Any) -> None:
    kind = message.topic.split("/")[2]
    if kind.endswith("DEATH"):
        print(f"{kind}: what was known of it is stale", flush=True)
    metrics = {metric.name: metric for metric in decoded(message.payload).metrics}
    for name, metric in metrics.items():
        if any(fnmatchcase(name, pattern) for pattern in given.metrics):
            print(f"{name} = {value_of(metric)}", flush=True)
    if kind == "DBIRTH" and commands:
        if unknown := commands.keys() - metrics.keys():
            print(f"{', '.join(sorted(unknown))}: not in the birth of {given.line}, nothing is sent", file=sys.stderr)
        else:
            publish("DCMD", "/line", [(name, metrics[name].datatype, value) for name, value in commands.items()])
        commands.clear()


def value_of(metric: Any) -> Any:
    field = metric.WhichOneof("value")
    value = None if field is None else getattr(metric, field)
    return whole(field, value) if metric.datatype in (INT32, INT64) and value is not None else value


client = Client(CallbackAPIVersion.VERSION2)
client.on_connect, client.on_message = connected, heard
try:
    client.connect(given.host, given.port)
except OSError as error:
    sys.exit(f"mqtt://{given.host}:{given.port}: the broker can't be reached ({error})")
print(f"waiting for the birth of {given.line}", file=sys.stderr)
try:
    client.loop_forever()
except KeyboardInterrupt:
    client.disconnect()
