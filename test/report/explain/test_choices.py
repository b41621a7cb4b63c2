# SPDX-License-Identifier: Apache-2.0
"""Output of `explain`: each effect with the line that decides it, bounds of the time step, prices."""

import math
import re

import pytest
from click.testing import CliRunner
from facts import missing
from rich.console import Console

from conveyor_sim.cli import main
from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.timestep.prediction import WHOLE_SCENE, percent
from conveyor_sim.report.explain.choices import explanation, price_table, setting_line
from conveyor_sim.report.explain.effect_cost import ALL, Price, PriceList
from conveyor_sim.scene import parse_scene

TEXT = """\
name: small
duration: 1.0
contacts:
  - between: [glass, glass]
    stiffness: 5000
    friction: 0.1
bottle_types:
  jar: {radius: 0.05, mass: 0.2, material: glass}
bottles:
  - {type: jar, position: [0, 0]}
  - {type: jar, position: [1, 0]}
floor: {friction: 0.4}
outputs: {contacts: 0}
effects:
  rotation: off
"""


def shown(content: object, width: int = 140) -> list[str]:
    """Lines as a terminal would show them, without the space around."""
    console = Console(width=width, markup=False, highlight=False, force_terminal=False)
    with console.capture() as capture:
        console.print(content)
    return [" ".join(line.split()) for line in capture.get().splitlines()]


def explained(text: str = TEXT, width: int = 140, **overrides: object) -> list[str]:
    scene = parse_scene(text, "plant.yaml", overrides)
    return shown(explanation(scene, build_model(scene)), width)


def test_effects_are_told_with_line_field_law_and_source() -> None:
    lines = explained()
    for line in (
        "bottle_contact on 9 bottles: 2 bottles in all",
        "contact between bottles; (22)-(23)",
        "linear on 5 contacts[0].stiffness: 5000 N/m",
        "N = k delta; (22)-(23)",
        "hertz off no contact with hertz_stiffness",
        "base_friction on 12 floor: friction 0.4",
        "rotation off 15 forced off by effects.rotation; contacts[0].friction: 0.1 enables it",
        "contact_arrays off outputs.contacts is 0",
    ):
        assert line in lines


def test_what_is_not_in_the_file_has_no_line() -> None:
    """Defaults and overrides call for effects, too."""
    assert "peaks on outputs.bottles: 50 Hz (default)" in explained()
    lines = explained(outputs={"bottles": 20}, friction_curve="atan")
    assert "peaks on outputs.bottles: 20 Hz (override)" in lines
    assert "atan_friction on friction_curve: atan (override)" in lines


def test_bounds_are_told_with_the_one_that_rules() -> None:
    lines = explained(TEXT.replace("friction: 0.1", "friction: 0.0"))
    names = ("base slip", "impact of two bottles", "base friction 1.274 ms", "lattice stability")
    rows = [line for line in lines if line.startswith(names)]
    assert [row.startswith(name) for row, name in zip(rows, names, strict=True)] == [True] * 4
    assert rows[0].endswith("79 20 steps in v_lim / (mu g) at mu = 0.4 (sets the step)")
    assert rows[3].endswith("a hexagonal packing at k = 5000 N/m, for stability")
    assert not any(row.endswith("(sets the step)") for row in rows[1:])
    assert "integrator leapfrog" in lines
    assert "accuracy standard (1 % in contact force)" in lines
    assert any(line.startswith("time step 126.6 us: 79 steps a tick: standard (1 % in") for line in lines)


MISSED, BRAKED = 0.6 * (math.pi / 14.05) ** 2 / 8, 0.4 * 9.81 * 1e-3 / (2 * 0.2 * 1.0)
"""Of a peak, in steps of 1 ms, and of the speed of impact, a fifth of 1 m/s: 14 ms of contact without damping."""
SLIPPED = r"0\.3[23] %"  # 0.325: the last bit decides which way it is rounded
EXPECTED = percent(WHOLE_SCENE * math.hypot(MISSED, BRAKED))


def test_the_errors_to_expect_are_told_with_their_reasons() -> None:
    lines = explained(TEXT.replace("duration: 1.0", "duration: 1.0\naccuracy: {per_tick: 10}"))
    parts = f"braking by the base {percent(BRAKED)}, peak between steps {percent(MISSED)},"
    impact = f"impact of two bottles, 14 steps a contact, {parts}"
    assert f"predicted error {EXPECTED} in the peak force of impacts: {impact}" in " ".join(lines)
    (resting,) = (line for line in lines if line.startswith("resting load"))
    assert missing(resting, ["not", "time step"]) == []
    slipped = re.compile(rf"{SLIPPED} in tangential speed after an impact: 14 steps per impact")
    assert any(slipped.match(line) for line in lines)


def test_a_setting_in_one_line() -> None:
    scene = parse_scene(TEXT, "plant.yaml", {"accuracy": {"per_tick": 10}})
    line = setting_line(build_model(scene))
    assert "\n" not in line
    assert line.startswith("leapfrog, dt = 1 ms (10 steps a tick, given in the scene; ")
    tangential = f"{SLIPPED} in tangential speed after an impact"
    assert re.search(f"; predicted error: {EXPECTED} in the peak force of impacts, {tangential}$", line)


def test_a_scene_without_bounds() -> None:
    text = TEXT.split("contacts:")[0] + "bottle_types:\n  jar: {radius: 0.05, mass: 0.2, material: glass}\n"
    assert any(not missing(line, ["nothing", "bounds", "time step"]) for line in explained(text))


@pytest.mark.parametrize("width", [60, 80])
def test_nothing_is_cut_off_on_a_narrow_terminal(width: int) -> None:
    assert "…" not in "".join(explained(width=width))


def price(effect: str, cost: float, spread: float, *takes_along: str) -> Price:
    return Price(effect, takes_along, 50.0, 50.0 - cost, cost, cost - spread, cost + spread)


def test_prices_tell_what_is_noise() -> None:
    prices = PriceList(
        time=1.5, bottles=7, full=50.0,
        prices=(price("contact_friction", 20.0, 1.0, "rotation"), price("peaks", 0.4, 0.5)),
        together=price(ALL, 30.0, 2.0), failed={"belts": "it diverged"}, fixed=("linear", "curved_belts"),
    )  # fmt: skip
    lines = shown(price_table(prices))
    for line in (
        "contact_friction 50.0 30.0 +20.0 +19.0 .. +21.0",
        "peaks 50.0 49.6 +0.4 -0.1 .. +0.9 noise",
        "all of these 50.0 20.0 +30.0 +28.0 .. +32.0 not the sum",
        "contact_friction takes along rotation",
        "belts: not measured, the scene does not run without it: it diverged",
        "not measured, as they can't be forced off: linear, curved_belts",
    ):
        assert line in lines
    facts = ["ns per bottle and step", "50.0", "all effects", "7 bottles", "1.5 s", "one thread"]
    assert missing(" ".join(lines), facts) == []
    assert "…" not in "".join(shown(price_table(prices), 80))


def test_the_command() -> None:
    result = CliRunner().invoke(main, ["explain", "two_bottles"])
    assert result.exit_code == 0, result.output
    assert "normal_damping" in result.output


@pytest.mark.parametrize("arguments", [["--at", "1"], ["--price", "--at", "-1"], ["--price", "--at", "1e9"]])
def test_a_moment_that_can_not_be_measured_is_refused(arguments: list[str]) -> None:
    result = CliRunner().invoke(main, ["explain", "two_bottles", *arguments])
    assert result.exit_code == 1
    assert "--at" in result.output
    assert "Traceback" not in result.output
