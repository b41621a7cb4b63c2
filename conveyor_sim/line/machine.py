"""What machines that give and take bottles have in common: run, a rate, a stop from outside."""

from collections.abc import Sequence

from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.process_image import Command, Signal, switch

ROUNDING = 1e-9
"""Of a cycle: sums of rate x tick must not miss the tick they fall on."""


class MachineDevice(Device):
    """A machine that works in cycles, one bottle each. It runs at the start."""

    def __init__(self, name: str, rate: float, rate_limit: float | None, signals: Sequence[Signal]) -> None:
        """rate, rate_limit: 1/s."""
        most = rate if rate_limit is None else rate_limit
        super().__init__(
            name,
            [Signal(f"{name}/running", "1", "bool", "state"), *signals],
            [switch(f"{name}/run"), Command(f"{name}/rate", "1/s", "number", 0.0, most)],
            [switch(f"{name}/stop")],
        )
        self.run = True
        self.rate = rate
        self.stop = False
        self.cycle = 1.0
        """How much of the cycle is done; from 1 on it wants a bottle."""

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Take run, rate (1/s), or the fault stop."""
        setattr(self, name.removeprefix(f"{self.name}/"), value if name.endswith("/rate") else value != 0.0)

    @property
    def runs(self) -> bool:
        """Whether nobody has stopped it."""
        return self.run and not self.stop

    def turn(self, now: ScanContext) -> bool:
        """Go on with the cycle for the tick that has passed; whether it is done."""
        if self.runs and now.tick > 0:
            self.cycle += self.rate * now.length
        return self.runs and self.cycle >= 1.0 - ROUNDING

    def wait(self) -> None:
        """Stand at the end of the cycle: what is lost by waiting is not made up for."""
        self.cycle = 1.0
