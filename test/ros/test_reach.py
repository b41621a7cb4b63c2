# SPDX-License-Identifier: Apache-2.0
"""Access by another machine on the network (docs/ros.md, Security). Network namespaces stand for machines."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import ExitStack

import pytest
from ros.conftest import SMALL_LINE

from conveyor_sim.ros.domain import own_domain

HERE, THERE = "10.77.0.1", "10.77.0.2"
LOCALHOST = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
STRANGER = {"ROS_STATIC_PEERS": HERE}  # who names this machine

SPEAK = """
import sys, rclpy
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("speaker")
publisher = node.create_publisher(String, "word", 1)
print("ready", flush=True)
node.create_timer(0.1, lambda: publisher.publish(String(data=sys.argv[1])))
rclpy.spin(node)
"""
LISTEN = """
import sys, time, rclpy
from rclpy.executors import SingleThreadedExecutor
from std_msgs.msg import String
heard, executors = set(), []
expected = set(sys.argv[1].split())
for domain in sys.argv[2:]:
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=int(domain))
    node = rclpy.create_node(f"listener_{domain}", context=context)
    node.create_subscription(String, "word", lambda word: heard.add(word.data), 1)
    executors.append(SingleThreadedExecutor(context=context))
    executors[-1].add_node(node)
begun = time.monotonic()
# Long enough to hear who should not be heard, and on a busy machine until all are heard who should be.
while (past := time.monotonic() - begun) < 4.0 or (past < 20.0 and not expected <= heard):
    for executor in executors:
        executor.spin_once(timeout_sec=0.05)
print("heard", *sorted(heard), flush=True)
"""
RESET = """
import rclpy
from simulation_interfaces.srv import ResetSimulation
rclpy.init()
node = rclpy.create_node("stranger")
client = node.create_client(ResetSimulation, "conveyor_sim/reset_simulation")
assert client.wait_for_service(60.0)
future = client.call_async(ResetSimulation.Request())
rclpy.spin_until_future_complete(node, future, timeout_sec=60.0)
print("result", future.result().result.result, flush=True)
"""


class Machine:
    """A machine with its own network and shared memory."""

    def __init__(self, stack: ExitStack) -> None:
        """Raises OSError if this is not allowed here."""
        enter = "mount -t tmpfs none /dev/shm && ip link set lo up && echo ready && exec sleep 600"
        self._holder = stack.enter_context(
            subprocess.Popen(["unshare", "--net", "--mount", "sh", "-c", enter], stdout=subprocess.PIPE, text=True)
        )
        stack.callback(self._holder.kill)
        assert self._holder.stdout is not None
        if self._holder.stdout.readline() != "ready\n":
            raise OSError("no network namespaces")
        self.pid = str(self._holder.pid)

    def run(self, *command: str) -> None:
        subprocess.run([*self._inside(), *command], check=True)

    def start(
        self, stack: ExitStack, *arguments: str, environment: Mapping[str, str]
    ) -> tuple[subprocess.Popen[str], str]:
        """Run Python; the process, and the first line that it prints."""
        before = {name: value for name, value in os.environ.items() if not name.startswith("ROS_")}
        process = stack.enter_context(
            subprocess.Popen(
                [*self._inside(), sys.executable, *arguments],
                env={**before, **environment},
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
            )
        )
        stack.callback(process.kill)
        assert process.stdout is not None
        return process, process.stdout.readline().strip()

    def _inside(self) -> list[str]:
        return ["nsenter", "-t", self.pid, "--net", "--mount", f"--wd={os.getcwd()}"]


@pytest.fixture(scope="module")
def machines() -> Iterator[tuple[Machine, Machine]]:
    """This machine and another one, on one Ethernet."""
    if not all(shutil.which(command) for command in ("unshare", "nsenter", "ip", "mount")):
        pytest.skip("needs unshare, nsenter and ip (util-linux, iproute2)")
    with ExitStack() as stack:
        try:
            here, there = Machine(stack), Machine(stack)
            link = ["ip", "link", "add", "wire", "netns", here.pid, "type", "veth", "peer", "wire", "netns", there.pid]
            subprocess.run(link, check=True)
        except (OSError, subprocess.CalledProcessError):
            pytest.skip("needs to be root: network namespaces stand for two machines")
        for machine, address in ((here, HERE), (there, THERE)):
            machine.run("ip", "addr", "add", f"{address}/24", "dev", "wire")
            machine.run("ip", "link", "set", "wire", "up")
        yield here, there


def test_localhost_keeps_out_who_does_not_name_this_machine_and_the_profile_everybody(
    machines: tuple[Machine, Machine],
) -> None:
    here, there = machines
    with own_domain() as private, ExitStack() as stack:
        private_range = {name: value for name, value in private.items() if os.environ.get(name) != value}
        speakers = {
            "default": {"ROS_DOMAIN_ID": "31"},
            "localhost": {"ROS_DOMAIN_ID": "32", **LOCALHOST},
            "profile": private_range,
        }
        for name, environment in speakers.items():
            assert here.start(stack, "-c", SPEAK, name, environment=environment)[1] == "ready"
        domains = [environment["ROS_DOMAIN_ID"] for environment in speakers.values()]
        for machine, environment, expected in (
            (there, {}, "default"),
            (there, STRANGER, "default localhost"),
            (here, LOCALHOST, "default localhost profile"),  # the profile is not mute
        ):
            listen = ["-c", LISTEN, expected, *domains]
            heard = machine.start(stack, *listen, environment=environment)[1]
            if not environment and heard == "heard":
                pytest.skip("multicast does not reach from one network namespace to another here")
            assert heard == f"heard {expected}"


def test_localhost_alone_lets_a_machine_that_names_this_one_reset_the_simulation(
    machines: tuple[Machine, Machine],
) -> None:
    here, there = machines
    domain = {"ROS_DOMAIN_ID": "33"}
    node = ["-m", "conveyor_sim.ros.sim_node", "--ros-args", "-p", f"scene:={SMALL_LINE}", "-p", "start_paused:=true"]
    with ExitStack() as stack:
        here.start(stack, *node, environment={**domain, **LOCALHOST})
        assert there.start(stack, "-c", RESET, environment={**domain, **STRANGER})[1] == "result 1"  # RESULT_OK
