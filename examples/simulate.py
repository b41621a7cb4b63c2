# SPDX-License-Identifier: Apache-2.0
"""The README's first steps: a scene, a command, positions and forces; without ROS."""

from conveyor_sim import Simulation, load_scene

simulation = Simulation(load_scene("examples/push.yaml"))
simulation.advance(900)  # ticks of 10 ms: bottles queue at the stop
simulation.command(["belts/main/cmd_speed"], [0.1])  # m/s, from the next tick on
simulation.advance(100)
print(simulation.take_outcomes())
print(simulation.bottles().x, simulation.contacts().normal_force)
