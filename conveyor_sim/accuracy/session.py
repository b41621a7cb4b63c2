# SPDX-License-Identifier: Apache-2.0
"""Session of a study: a predicted answer, a preliminary one, the final one; on Ctrl-C the best so far."""

from __future__ import annotations

import math
import signal
from collections.abc import Callable
from pathlib import Path
from types import FrameType

from conveyor_sim.accuracy.effort import PROCESSORS, Bars, Effort
from conveyor_sim.accuracy.report.forecast import forecast
from conveyor_sim.accuracy.report.interim import PRELIMINARY, Interim, predicted
from conveyor_sim.accuracy.report.lines import Asked, recommended, summary
from conveyor_sim.accuracy.report.no_contact import NoContact, without_contact
from conveyor_sim.accuracy.results import AccuracyStudy
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.accuracy.study import run_study
from conveyor_sim.scene import Scene
from conveyor_sim.support.signals import HandledOnce

ANSWER = "Answer:"

Say = Callable[[str], object]


class Session:
    """One study of a scene for somebody who waits. To be called in this order: `predict`, then `run`."""

    def __init__(self, scene: Scene, tolerance: float, answer: Say, say: Say, asked: Asked = "forces") -> None:
        """Prepare a study.

        tolerance: relative error. answer: called with each line of the answer; say: of progress, interim answers.
        asked: quantities that the setting is recommended for.
        """
        self.scene = scene
        self.setting: Setting | None = None
        """Recommended in the end; None: nothing is."""
        self._tolerance = tolerance
        self._asked = asked
        self._answer = answer
        self._say = say
        self._known = forecast(scene, tolerance)
        self._best = predicted(self._known)
        self._struck = False

    def predict(self, folder: Path, effort: Effort) -> None:
        """Show what is predicted, and say what is to come; nothing runs yet."""
        if not self._known.touches:
            return
        self._show_interim(self._best)
        minutes = effort.limit / 60.0
        self._say(
            f"study of {self.scene.name} in {folder}: on {PROCESSORS} free processors a preliminary answer within a "
            f"minute, the answer within {math.ceil(minutes)}, compiling left out; Ctrl-C shows the best so far, and "
            "the same command goes on"
        )

    def run(self, folder: Path, effort: Effort, bars: Bars) -> AccuracyStudy | None:
        """Make the study and show its answers; None on a line without contacts, of which there is none.

        On Ctrl-C the best answer so far is shown, and KeyboardInterrupt raised. Else raises what `run_study` does.
        """
        if not self._known.touches:
            self._show_without_contact(None)
            return None
        try:
            with HandledOnce([signal.SIGINT], self._strike):
                study = run_study(self.scene, folder, self._tolerance, effort, bars, self._report, self._compiles)
        except NoContact as found:
            self._show_without_contact(found.looked)
            return None
        except (KeyboardInterrupt, Exception) as error:
            # Where compiling is broken off, the compiler may make another error of it.
            if not (self._struck or isinstance(error, KeyboardInterrupt)):
                raise
            self.show_best()
            raise KeyboardInterrupt from None
        self.setting = recommended(study, self._asked)
        self._show(ANSWER, summary(study, self._asked))
        return study

    def show_best(self) -> None:
        """Show the best answer so far, for an interrupted study."""
        self._show(f"Interrupted; the best answer so far. {self._best.title}", self._best.lines)

    def _report(self, interim: Interim) -> None:
        self._best = interim
        if interim.title == PRELIMINARY:
            self._show_interim(interim)

    def _show_without_contact(self, looked: float | None) -> None:
        self.setting, lines = without_contact(self.scene, self._known, looked)
        self._show(ANSWER, lines)

    def _show_interim(self, interim: Interim) -> None:
        for line in (interim.title, *interim.lines):
            self._say(line)

    def _show(self, title: str, lines: tuple[str, ...] | list[str]) -> None:
        for line in (title, *lines):
            self._answer(line)

    def _compiles(self) -> None:
        self._say(
            "compiling kernels for this kind of scene: half a minute to minutes that do not count; the next study "
            "finds them in the cache"
        )

    def _strike(self, number: int, frame: FrameType | None) -> None:
        self._struck = True
        signal.default_int_handler(number, frame)
