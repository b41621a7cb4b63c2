# SPDX-License-Identifier: Apache-2.0
"""The answer on a line on which bottles only ride: there is no error in contact force, and none is looked for."""

from __future__ import annotations

from conveyor_sim.accuracy.candidates import own_setting, preset_setting
from conveyor_sim.accuracy.report.apply import line
from conveyor_sim.accuracy.report.forecast import Forecast, seconds
from conveyor_sim.accuracy.report.words import digits, percent
from conveyor_sim.accuracy.setting import Setting, with_setting
from conveyor_sim.physics.model import build_model
from conveyor_sim.scene import Scene


class NoContact(Exception):
    """No bottle touched another one or a rail in a run of the scene: a study has nothing to compare."""

    def __init__(self, looked: float) -> None:
        """Build the exception. looked: simulated time without contact, s."""
        super().__init__(f"nothing touched anything in {looked:g} s")
        self.looked = looked


def without_contact(scene: Scene, known: Forecast, looked: float | None) -> tuple[Setting, list[str]]:
    """Return the setting to use, and the lines of the answer: forces, throughput, cost, setting, exclusions.

    looked: simulated time without contact, s; None: contact is impossible.
    """
    setting = preset_setting(scene, "draft")
    prediction = build_model(with_setting(scene, setting)).prediction
    terms = [f"{percent(term.value)} in {term.quantity}" for term in prediction.terms]
    friction = f" (predicted: off by {', '.join(terms)})" if terms else ""
    lines = [
        f"Forces: none, because {_why(scene, looked)}.",
        f"Throughput: bottles only ride, so the friction of belts alone decides it{friction}.",
        f"Cost: about {digits(seconds(scene, setting, known.bottles))} s of one processor per simulated second "
        f"with {known.bottles} bottle{'s' * (known.bottles != 1)}, an estimate; "
        "a more accurate setting gains nothing here.",
        f"Setting: {line(setting)}, the preset draft: the cheapest within every bound of stability"
        + (" (the scene has it already)." if own_setting(scene) == setting else "."),
    ]
    if known.touches:
        lines.append(_otherwise(known, prediction.value))
    return setting, lines


def _why(scene: Scene, looked: float | None) -> str:
    if looked is None:
        return "nothing in the scene can touch"
    whole = looked >= scene.duration - 0.5 * scene.tick
    span = f"the {looked:g} s of the scene" if whole else f"the first {looked:g} s of {scene.duration:g} s"
    return f"no bottle touched another one or a rail in {span}"


def _otherwise(known: Forecast, draft: float | None) -> str:
    """Return the line for the case that bottles do touch."""
    impacts = "" if draft is None else f" draft has a predicted error of {percent(draft)} in impacts;"
    text = f"If bottles touch (a stop, a jam, other commands),{impacts}"
    if known.point is None:
        return f"{text} no setting is predicted to meet {percent(known.tolerance)}."
    return f"{text} predicted to meet {percent(known.tolerance)}: {line(known.point.setting)}."
