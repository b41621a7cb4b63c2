"""Chatter (`guard/chatter.py`) of a scene with a setting, looked for from a state of the scene on."""

from conveyor_sim.accuracy.measure.failures import place
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.accuracy.trajectory import variant
from conveyor_sim.errors import SimulationError
from conveyor_sim.physics.stepping.guard.chatter import ChatterMeter
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation

STEPS = 48
"""Observed steps: chatter fills half of them, longer than any contact of five or more steps rings."""

LEAST = 0.05
"""Amplitude of chatter, of v_lim, from which it is reported. It settles at 2 (1 - b) of it, b the least stable step
over the one taken, and is 1 and more from twice that on."""


class ChatterProbe:
    """A scene with a setting, in ticks of one step."""

    def __init__(self, scene: Scene, setting: Setting) -> None:
        self.slip_limit = scene.slip_limit
        # A tick is a whole number of nanoseconds.
        step = max(1, round(scene.tick_ns / setting.per_tick)) * 1e-9
        supply = {name: "off" for name, there in (("infeed", scene.givers()), ("outfeed", scene.exits())) if any(there)}
        single = Setting(setting.integrator, 1, setting.stiffness, setting.error)
        self._simulation = variant(scene, single, tick=round(step, 9), duration=round(step, 9), effects=supply)

    def look(self, state: Simulation) -> str:
        """One sentence if the setting chatters from a state of the scene on, which stays as it is; else empty."""
        simulation = self._simulation
        simulation.restore_from(state)
        bottles = simulation.bottles()
        radius = simulation.model.type_radius[bottles.type]
        meter = ChatterMeter()
        for _ in range(STEPS):
            try:
                simulation.advance()
            except SimulationError:
                return ""
            now = simulation.bottles()
            meter.note(now.vx, now.vy, radius * now.omega)
        worst, amplitude = meter.worst()
        if amplitude <= LEAST * self.slip_limit:
            return ""
        share = amplitude / self.slip_limit
        return (
            f"chattering: {place(bottles, worst)} shakes by {share:.2g} of slip_limit at every step at {state.time:g} s"
        )
