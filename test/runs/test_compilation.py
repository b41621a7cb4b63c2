"""What a run may need of the engine is there before it begins."""

from __future__ import annotations

import subprocess
import sys

import pytest

CODE = """
import sys
from conveyor_sim import Simulation, load_scene
from conveyor_sim.simulation import compile_kernels
from conveyor_sim.support.resources import scene_path

scene = load_scene(scene_path("scenarios/" + sys.argv[1]))
compile_kernels(scene)
simulation = Simulation(scene, threads=1)
from conveyor_sim.engine.sensors import beams, crossings, regions
sensors = (beams.block_beams, crossings.find_crossings, regions.find_inside)
before = [len(kernel.signatures) for kernel in sensors]
for name in simulation.process_image.command_names:
    if name.endswith("/fire"):
        simulation.command((name,), (1.0,))
simulation.advance(300)
simulation.signals()
after = [len(kernel.signatures) for kernel in sensors]
print(before == after, max(after))
"""


@pytest.mark.parametrize("scene", ["reject_line", "zoned_line", "buffer_lane"])
def test_sensors_and_rejects_compile_nothing_in_the_middle_of_a_run(scene: str) -> None:
    run = subprocess.run([sys.executable, "-c", CODE, scene], capture_output=True, text=True, check=False)
    assert run.stdout.split() == ["True", "1"], run.stderr
