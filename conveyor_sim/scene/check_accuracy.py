"""Checks of `accuracy`: settings that exclude each other, and steps longer than a tick."""

from collections.abc import Iterator

from conveyor_sim.scene.accuracy import CHOICES
from conveyor_sim.scene.problems import Problem
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.words import listed, shown


def accuracy_problems(scene: Scene) -> Iterator[Problem]:
    """Yield problems of the choice of the time step."""
    accuracy = scene.accuracy
    choices = [field for field in CHOICES if getattr(accuracy, field) is not None]
    if len(choices) > 1:
        yield Problem(("accuracy",), f"{' and '.join(choices)} given, expected at most one of {listed(list(CHOICES))}")
    if accuracy.error is not None and accuracy.integrator != "dormand_prince":
        yield Problem(
            ("accuracy", "error"),
            f"{shown(accuracy.error)} given, expected none with integrator {accuracy.integrator}: "
            "only dormand_prince chooses its own steps",
        )
    if accuracy.dt is not None and accuracy.dt > scene.tick:
        yield Problem(("accuracy", "dt"), f"{shown(accuracy.dt)} given, expected at most the tick, {scene.tick:g} (s)")
