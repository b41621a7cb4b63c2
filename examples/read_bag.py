# SPDX-License-Identifier: Apache-2.0
"""Reads a recording with rosbags alone: positions of bottles, and the forces between them.

    pip install rosbags
    python read_bag.py runs/20250131T120501Z

Needs neither ROS nor conveyor_sim: the recording states its own message types. Works as well on what `ros2 bag record`
made of the node's topics. A recording that was killed while it was written needs `conveyor-sim recover` first.
"""

import sys
from pathlib import Path

from rosbags.highlevel import AnyReader


def main(path: str) -> None:
    with AnyReader([Path(path)]) as reader:
        by_topic = {connection.topic: connection for connection in reader.connections}

        line_topic = by_topic["/line"]
        _, _, data = next(reader.messages(connections=[line_topic]))
        line = reader.deserialize(data, line_topic.msgtype)
        print(f"{line.scene_name}: {len(line.belts)} belts, {len(line.rails)} rails, dt = {line.dt:g} s")

        # Messages are columns: entry i of each array is one bottle, or one contact.
        print("\ntime s   bottles   first bottle: id, x m, y m   peak force N")
        for connection, _, data in reader.messages(connections=[by_topic["/bottles"]]):
            bottles = reader.deserialize(data, connection.msgtype)
            if bottles.tick * line.tick_ns % 500_000_000 == 0 and len(bottles.id):
                first = f"{bottles.id[0]}  {bottles.x[0]:.3f}  {bottles.y[0]:.3f}"
                time = bottles.tick * line.tick_ns * 1e-9
                print(f"{time:6.2f}   {len(bottles.id):7d}   {first}   {bottles.peak_force.max():.2f}")

        print("\ntime s   contacts   strongest: a, b, normal force N, tangential force N")
        for connection, _, data in reader.messages(connections=[by_topic["/contacts"]]):
            contacts = reader.deserialize(data, connection.msgtype)
            if contacts.tick * line.tick_ns % 500_000_000 == 0 and len(contacts.a):
                top = contacts.normal_force.argmax()
                rail = contacts.kind[top] == contacts.BOTTLE_RAIL
                partner = line.rails[contacts.b[top]] if rail else f"bottle {contacts.b[top]}"
                forces = f"{contacts.normal_force[top]:.2f}  {contacts.tangential_force[top]:.2f}"
                time = contacts.tick * line.tick_ns * 1e-9
                print(f"{time:6.2f}   {len(contacts.a):8d}   bottle {contacts.a[top]}  {partner}  {forces}")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python read_bag.py BAG")
    try:
        main(sys.argv[1])
    except Exception as error:  # a damaged bag makes the reader raise almost anything
        sys.exit(f"{sys.argv[1]}: can't be read ({error!r:.200}); `conveyor-sim recover` may help")
