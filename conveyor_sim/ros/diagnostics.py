# SPDX-License-Identifier: Apache-2.0
"""Topic /diagnostics: state and counts of the simulation, once per second of wall time."""

from __future__ import annotations

import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node

from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.ros.clock import GraphWatch, to_time
from conveyor_sim.ros.observer import TICK, WALL
from conveyor_sim.ros.publishers import RosSink
from conveyor_sim.ros.qos_overrides import publisher_qos
from conveyor_sim.run.run_state import SimulationState
from conveyor_sim.run.stepper import Stepper
from conveyor_sim.support.printable import printable

PERIOD = 1.0  # s of wall time


class Diagnostics:
    """Publishes one status: ERROR while the run can't go on.

    WARN after a second with overruns, refused or lost commands, or reports of the guard, and while other nodes use the
    names of this one.
    """

    def __init__(self, node: Node, stepper: Stepper, sink: RosSink, graph: GraphWatch) -> None:
        self._stepper = stepper
        self._sink = sink
        self._graph = graph
        self._name = f"{node.get_name()}: simulation"
        self._publisher = node.create_publisher(
            DiagnosticArray, "/diagnostics", publisher_qos(node, "/diagnostics", TOPICS["/diagnostics"].qos)
        )
        self._last_wall = time.monotonic()
        self._last_tick = 0
        self._last_run = ""
        self._last_faults: dict[str, int] = {}
        # A steady clock, because with use_sim_time the clock of the node stands still while paused.
        node.create_timer(PERIOD, self.publish, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def publish(self) -> None:
        """Publish the present state. Called in the thread of the executor."""
        stepper = self._stepper
        session, pacer = stepper.run.session, stepper.pacer
        simulation = session.simulation
        tick, counts = simulation.tick, simulation.counts
        counts_in, reception = stepper.run.inbox.counts, stepper.run.reception
        refusals = reception.refused + counts_in.turned_away
        faults = {
            "overruns": pacer.overruns,
            "refused commands": refusals,
            "lost commands": counts_in.lost,
            "warnings of the guard": stepper.run.guard_events,
        }
        new = {what: count - self._last_faults.get(what, 0) for what, count in faults.items()}
        self._last_faults = faults
        status = DiagnosticStatus(name=self._name, hardware_id=simulation.model.name)
        status.level, status.message = _verdict(stepper, new)
        not_alone = self._graph.look()
        if not_alone and status.level != DiagnosticStatus.ERROR:
            status.level = DiagnosticStatus.WARN
            status.message = f"{status.message}; not alone in this ROS domain"
        values = {
            "state": stepper.run.state.name,
            "run_id": session.run_id,
            TICK: tick,
            "simulated time (s)": f"{simulation.time:.9g}",
            "end of run (s)": f"{session.last_tick * pacer.tick:.9g}",
            "real_time_factor": f"{pacer.factor:g}",
            "real_time_factor measured": f"{self._measured(session.run_id, tick, pacer.tick):.4g}",
            WALL: f"{session.wall:.3f}",
            "dt (s)": f"{simulation.model.dt:.9g}",
            "steps per tick": simulation.model.steps_per_tick,
            "overruns": pacer.overruns,
            "wall time given up (s)": f"{pacer.lost:.3f}",
            "received commands": counts_in.received,
            "applied commands": reception.applied,
            "refused commands": refusals,
            "refusals for want of control": reception.without_control,
            "lost commands": counts_in.lost,
            "waiting commands": counts_in.waiting,
            "waiting commands (bytes)": counts_in.waiting_bytes,
            "guard events": stepper.run.guard_events,
            "ticks in shorter steps": simulation.integration.shortened_ticks,
            "deepest overlap (of a radius)": f"{simulation.integration.deepest_overlap:.3g}",
            "lockstep owner": printable(stepper.run.lockstep.owner),
            "bottles present": counts.present,
            "bottles fed": counts.fed,
            "bottles removed": counts.removed,
            "recording": session.bag or "",
            "not alone": "; ".join(not_alone),
        }
        values |= {f"published {topic}": count for topic, count in sorted(self._sink.published.items())}
        status.values = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
        message = DiagnosticArray(status=[status])
        message.header.stamp = to_time(simulation.stamp_ns)
        self._publisher.publish(message)

    def _measured(self, run: str, tick: int, tick_s: float) -> float:
        """Return the simulated seconds per wall second since the last message; 0 in the first one of a run."""
        now = time.monotonic()
        ticks = tick - self._last_tick if run == self._last_run else 0
        factor = ticks * tick_s / (now - self._last_wall)
        self._last_wall, self._last_tick, self._last_run = now, tick, run
        return factor


def _verdict(stepper: Stepper, faults: dict[str, int]) -> tuple[bytes, str]:
    if stepper.run.failure:
        return DiagnosticStatus.ERROR, f"stopped: {stepper.run.failure}"
    if warnings := [f"{count} {what}" for what, count in faults.items() if count]:
        return DiagnosticStatus.WARN, f"{' and '.join(warnings)} since the last message"
    return DiagnosticStatus.OK, SimulationState(stepper.run.state).name
