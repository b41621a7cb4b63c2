"""What machines that give and take bottles have in common: run, a rate, a stop from outside."""

from collections.abc import Sequence

from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.tag import Tag, number, switch

ROUNDING = 1e-9
"""Of a cycle: sums of rate x tick must not miss the tick they fall on."""


class MachineDevice(Device):
    """A machine that works in cycles, one bottle each. It runs at the start."""

    def __init__(self, name: str, rate: float, rate_limit: float | None, signals: Sequence[Tag]) -> None:
        """rate, rate_limit: 1/s."""
        most = rate if rate_limit is None else rate_limit
        super().__init__(
            name,
            [
                switch(f"{name}/running", "status", "It runs, and nobody has stopped it.", 1.0, "state"),
                *signals,
                switch(f"{name}/run", "command", "Runs while on.", 1.0),
                number(f"{name}/rate", "setpoint", "Bottles a second.", "1/s", 0.0, most, rate, nominal=rate),
                switch(f"{name}/stop", "fault", "Stopped from outside while on."),
            ],
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
