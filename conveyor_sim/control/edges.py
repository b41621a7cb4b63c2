"""What happened at a photo-eye since the last scan, from its signals blocked, rose, fell and edges."""

from __future__ import annotations

from dataclasses import dataclass, field

from conveyor_sim.control.scan import Inputs, eye_signal


@dataclass
class EyeEdges:
    """Read once a scan. The eye gives the time of its last edges only; `edges` counts them."""

    eye: str
    blocked: bool = field(default=False, init=False)
    edges: int = field(default=0, init=False)
    """In this scan, of both directions."""
    rises: int = field(default=0, init=False)
    """In this scan: bottles that came."""
    rose: float = field(default=0.0, init=False)
    """s, the last time at which a bottle came."""
    fell: float = field(default=0.0, init=False)
    """s, the last time at which one was gone."""
    fell_before: float | None = field(default=None, init=False)
    """s, when the bottle before the last one was gone; None if that was not seen."""
    _count: float | None = field(default=None, init=False, repr=False)
    _beam: bool = field(default=False, init=False, repr=False)
    """Whether a bottle is in the beam; `blocked` comes after the eye's delays."""
    _falls: int = field(default=0, init=False, repr=False)

    def read(self, inputs: Inputs) -> EyeEdges:
        """One scan; itself. The first one has no edges."""
        blocked, count = inputs.on(eye_signal(self.eye)), inputs[eye_signal(self.eye, "edges")]
        rose, fell = inputs[eye_signal(self.eye, "rose")], inputs[eye_signal(self.eye, "fell")]
        self.edges, self.rises = 0, 0
        beam = rose > fell if rose != fell else blocked
        if self._count is not None:
            self.edges = round(count - self._count)
            # Rises and falls take turns, so their number and the two states tell how many of each there were.
            self.rises = (self.edges + beam - self._beam) // 2
        falls = self.edges - self.rises
        if self.rises and beam:  # the last edge is a rise, so the last fall is the one before it
            self.fell_before = fell if self._falls + falls else None
        elif self.rises:
            self.fell_before = self.fell if self._falls and self.edges == 2 else None
        self._falls += falls
        self._count, self._beam, self.blocked, self.rose, self.fell = count, beam, blocked, rose, fell
        return self
