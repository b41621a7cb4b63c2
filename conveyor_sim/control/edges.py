# SPDX-License-Identifier: Apache-2.0
"""`EyeEdges`: edges of a photo-eye since the last scan, from its signals blocked, rose, fell and edges."""

from __future__ import annotations

from dataclasses import dataclass, field

from conveyor_sim.control.scan import Inputs, eye_signal


@dataclass
class EyeEdges:
    """Edges of a photo-eye, read once per scan. The eye reports times of its last edges only; `edges` counts them."""

    eye: str
    blocked: bool = field(default=False, init=False)
    edges: int = field(default=0, init=False)
    """Number of edges in this scan, both directions."""
    rises: int = field(default=0, init=False)
    """Number of rising edges in this scan: bottles that arrived."""
    rose: float = field(default=0.0, init=False)
    """Time when a bottle last arrived, s."""
    fell: float = field(default=0.0, init=False)
    """Time when a bottle last left, s."""
    fell_before: float | None = field(default=None, init=False)
    """Time when the bottle before the last one left, s; None if that was not observed."""
    _count: float | None = field(default=None, init=False, repr=False)
    _beam: bool = field(default=False, init=False, repr=False)
    """True while a bottle is in the beam; `blocked` follows after the delays."""
    _falls: int = field(default=0, init=False, repr=False)

    def read(self, inputs: Inputs) -> EyeEdges:
        """Read the signals of one scan, and return self. The first scan has no edges."""
        blocked, count = inputs.on(eye_signal(self.eye)), inputs[eye_signal(self.eye, "edges")]
        rose, fell = inputs[eye_signal(self.eye, "rose")], inputs[eye_signal(self.eye, "fell")]
        self.edges, self.rises = 0, 0
        beam = rose > fell if rose != fell else blocked
        if self._count is not None:
            self.edges = round(count - self._count)
            # Rises and falls alternate, so their number and the two states determine how many there were of each.
            self.rises = (self.edges + beam - self._beam) // 2
        falls = self.edges - self.rises
        if self.rises and beam:  # the last edge is a rise, so the last fall is the one before it
            self.fell_before = fell if self._falls + falls else None
        elif self.rises:
            self.fell_before = self.fell if self._falls and self.edges == 2 else None
        self._falls += falls
        self._count, self._beam, self.blocked, self.rose, self.fell = count, beam, blocked, rose, fell
        return self
