# SPDX-License-Identifier: Apache-2.0
"""Plans saved by FreeCAD and LibreCAD: they are imported by the command, and the scene runs."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from conveyor_sim.cli.command import main
from conveyor_sim.scene import Scene, load_scene
from conveyor_sim.simulation import Simulation

pytest.importorskip("ezdxf", reason="ezdxf is not installed: pip install conveyor-sim[cad]")

PLANS = Path(__file__).parent / "plans"
BASE = """# a comment that stays
name: plan
duration: 20
bottle_types:
  bottle: {radius: 0.0325, mass: 0.4, material: glass}
contacts:
- {between: [glass, glass], stiffness: 1e4, damping: {law: normal, restitution: 0.5}, friction: 0.1}
- {between: [glass, steel], stiffness: 1e4, damping: {law: normal, restitution: 0.5}, friction: 0.1}
base:
- {between: [glass, chain], friction: 0.2}
"""
MAP = """
AXES*: {as: conveyor, width: 90 mm, material: chain, speed: 0.4}
RAILS*: {as: rail, material: steel}
EYES*:
- {as: photo_eye, block: PEC}
- {as: photo_eye}
EXITS*: {as: outfeed}
FEEDS: {as: infeed, bottle: bottle, gap: 0.02, speed: 0.4}
"""
FEED = "infeeds: {feed: {along: conveyor_1, at: 0.05, bottle: bottle, gap: 0.02}}\n"


def command(*arguments: object) -> str:
    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    assert result.exit_code == 0, result.output
    return result.output


def imported(folder: Path, plan: str, base: str, *options: str) -> tuple[Scene, str]:
    """Import a plan by the command; return the scene and the output."""
    (folder / "base.yaml").write_text(base)
    (folder / "map.yaml").write_text(MAP)
    out = folder / "line.yaml"
    files = ["--map", folder / "map.yaml", "--base", folder / "base.yaml", "-o", out]
    output = command("import", PLANS / plan, *files, *options)
    assert "# a comment that stays" in out.read_text()
    return load_scene(out), output


@pytest.mark.parametrize(("plan", "options"), [("freecad.dxf", []), ("freecad_r12.dxf", ["--unit", "mm"])])
def test_freecad(tmp_path: Path, plan: str, options: list[str]) -> None:
    scene, output = imported(tmp_path, plan, BASE + FEED, *options)
    assert "skipped" not in output
    assert scene.layout is not None
    (conveyor,) = scene.layout.conveyors.values()
    assert conveyor.route.length == pytest.approx(0.9 + 0.5 * 3.14159265 / 2 + 1.2, abs=2e-4)
    assert conveyor.route.end.xy == pytest.approx((1.4, -1.7), abs=2e-4)
    assert scene.photo_eyes["photo_eye_1"].from_[0] == pytest.approx(0.4)
    assert len(scene.rails) == 6
    assert delivered(scene) > 20


def test_librecad(tmp_path: Path) -> None:
    scene, output = imported(tmp_path, "librecad.dxf", BASE)
    assert "skipped TEXT on layer TITLE (6A)" in output
    assert "skipped CIRCLE on layer TITLE (6B)" in output
    assert scene.layout is not None
    assert set(scene.layout.conveyors) == {"first", "outer"}
    assert scene.layout.conveyors["outer"].route.end.xy == pytest.approx((0.0, 3.5))
    assert sorted(round(eye.from_[0], 6) for eye in scene.photo_eyes.values()) == [0.2, 0.4, 0.7, 0.8]
    assert delivered(scene) > 20


def delivered(scene: Scene) -> int:
    """Return the number of bottles that leave within the duration."""
    simulation = Simulation(scene)
    simulation.advance(scene.duration_ticks)
    return int(simulation.counts.removed)


def test_drawing_a_scene_without_ezdxf_or_format(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("conveyor_sim.page.drawings.dxf_file.find_spec", lambda name: None)
    for arguments in (["draw", "funnel", "--dxf", tmp_path / "a.dxf"], ["import", PLANS / "freecad.dxf"]):
        (tmp_path / "map.yaml").write_text(MAP)
        more = ["--map", tmp_path / "map.yaml", "-o", tmp_path / "x.yaml"] if arguments[0] == "import" else []
        result = CliRunner().invoke(main, [str(argument) for argument in [*arguments, *more]])
        assert result.exit_code == 1
        assert "conveyor_sim[cad]" in result.output
    result = CliRunner().invoke(main, ["draw", "funnel"])
    assert result.exit_code == 1
    assert "--dxf" in result.output
