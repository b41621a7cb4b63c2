# SPDX-License-Identifier: Apache-2.0
"""The commands, as a user types them."""

import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from bag.small_line import SMALL_LINE, record
from click.testing import CliRunner, Result
from facts import missing
from warm import run

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.cli import main
from conveyor_sim.report.labelled import MOST_LINES
from conveyor_sim.scene import load_scene

Command = Callable[..., Result]


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Command:
    """Runs `conveyor-sim` with some arguments in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return lambda *arguments: CliRunner().invoke(main, [str(argument) for argument in arguments])


def assert_refused(result: Result, words: str) -> None:
    """One sentence, exit code 1, no traceback."""
    assert result.exit_code == 1
    assert re.search("^Error: ", result.output, re.MULTILINE)
    assert re.search(words, result.output)
    assert "Traceback" not in result.output


def test_check_tells_and_draws(command: Command, tmp_path: Path) -> None:
    result = command("check", SMALL_LINE, "--details")
    assert result.exit_code == 0, result.output
    words = " ".join(result.output.split())
    for phrase in (
        "7 at the start",
        "straight, turn",
        "turn_outer",
        "100 steps a tick, given in the scene; 3 x beyond the bound of stability by contact friction",
        "accuracy given, 100 steps a tick",
        "% in the peak force of impacts: impact of two bottles, ",
        "normal_damping off: no contact with damping law normal",
        "arc_rails on: belts.turn.rails.inner",
    ):
        assert phrase in words
    assert (tmp_path / "small_line.png").stat().st_size > 1000


def test_check_takes_the_name_of_a_shipped_scene(command: Command, tmp_path: Path) -> None:
    result = command("check", "two_bottles", "--details", "--out", "pictures")
    assert result.exit_code == 0, result.output
    speed, bound, change, _ = result.output.splitlines()[-4:]
    assert re.match(r"speed: about \d+ x real time on one core with 2 bottles, an estimate", speed)
    assert bound.startswith("bound: impact of two bottles needs 2 steps a tick")
    assert change.startswith("change: no single change")
    assert (tmp_path / "pictures" / "two_bottles.png").exists()


def test_check_refuses_a_wrong_scene_by_line_and_field(command: Command, tmp_path: Path) -> None:
    (tmp_path / "wrong.yaml").write_text(SMALL_LINE.read_text().replace("mass: 0.1", "mass: -0.1"))
    assert_refused(command("check", "wrong.yaml"), r"wrong\.yaml:\d+: bottle_types\.small\.mass: -0\.1 given, expected")


def test_run_records_sums_up_and_draws(command: Command, tmp_path: Path) -> None:
    result = command("run", SMALL_LINE, "--duration", "0.4")
    assert result.exit_code == 0, result.output
    (folder,) = (tmp_path / "runs").iterdir()
    assert re.fullmatch(r"\d{8}T\d{6}Z", folder.name)
    with open_bag(folder) as bag:
        assert bag.counts["signals"] == 41
    assert json.loads((folder / "summary.json").read_text())["simulated"] == pytest.approx(0.4)
    assert list((folder / "pictures").glob("*.png"))
    lines = outline_of(result)
    assert missing(lines[0], ["small_line", "0.4 s", "x real time"]) == []
    assert [line.split()[0] for line in lines[1:]] == ["bottles", "forces", "warning", "recorded", "next"]
    assert missing(lines[3], ["overlap", "of the diameter"]) == []
    assert missing(lines[-2], [str(folder.relative_to(tmp_path)), "page.html", "summary.json", "pictures"]) == []


def outline_of(result: Result) -> list[str]:
    """The lines that a command printed to the standard output: at most twelve, without trailing spaces."""
    lines = result.stdout.splitlines()
    assert len(lines) <= MOST_LINES, result.stdout
    assert [line.rstrip() for line in lines] == lines
    return lines


def test_details_of_a_run_are_printed_on_request(command: Command) -> None:
    result = command("run", SMALL_LINE, "--duration", "0.1", "--no-pictures", "--details")
    assert result.exit_code == 0, result.output
    for words in ("leapfrog, dt = 100 us", "predicted error", "achieved", "straight", "signals"):
        assert words in result.output
    assert [line.partition(":")[0] for line in result.output.splitlines()[-3:]] == ["speed", "bound", "change"]


def test_run_draws_nothing_where_that_is_asked_for(command: Command, tmp_path: Path) -> None:
    result = command("run", SMALL_LINE, "--duration", "0.1", "--out", "bag", "--no-pictures")
    assert result.exit_code == 0, result.output
    assert "picture" not in result.output
    assert {path.name for path in (tmp_path / "bag").iterdir()} == {"bag_0.mcap", "metadata.yaml", "summary.json"}


def test_run_with_nothing_to_draw_is_a_good_run(command: Command, tmp_path: Path) -> None:
    text = SMALL_LINE.read_text().replace("{bottles: 50,", "{bottles: 0,")
    (tmp_path / "quiet.yaml").write_text(text + "effects: {peaks: on}\n")  # the kernels of the others
    result = command("run", "quiet.yaml", "--out", "bag", "--duration", "0.1")
    assert result.exit_code == 0, result.output
    assert "no pictures: " in result.output
    assert (tmp_path / "bag" / "summary.json").exists()


def test_run_into_a_folder_that_is_taken_is_refused(command: Command, tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("keep")
    assert_refused(command("run", SMALL_LINE, "--out", "mine"), "mine: is not empty")


def test_run_of_a_duration_that_is_no_number_of_ticks_is_refused(command: Command) -> None:
    assert_refused(command("run", SMALL_LINE, "--duration", "0.005"), r"duration.*0\.005")


def test_run_without_a_recording(command: Command, tmp_path: Path) -> None:
    result = command("run", SMALL_LINE, "--no-record", "--duration", "0.1")
    assert result.exit_code == 0, result.output
    lines = outline_of(result)
    assert missing(lines[0], ["small_line", "0.1 s", "x real time"]) == []
    assert missing(lines[1], ["forces", "peak"]) == []
    assert list(tmp_path.iterdir()) == []


def test_details_of_a_run_without_a_recording(command: Command) -> None:
    result = command("run", SMALL_LINE, "--no-record", "--duration", "0.1", "--details")
    assert result.exit_code == 0, result.output
    *_, speed, bound, change = result.stdout.splitlines()
    assert "100 steps a tick, given in the scene" in result.output and "; predicted error: " in result.output
    assert re.fullmatch(r"speed: 0\.10 s simulated in .* x real time; \d+ % in the kernels, .*", speed)
    # On a busy machine the few steps of 0.1 s may take less time than what comes with each tick.
    steps = "bound: 100 steps a tick are given in the scene; contact friction needs "
    assert bound.startswith((steps, "bound: devices and the guard, which act once a tick"))
    assert change.startswith("change: ")


def test_record_is_another_name_of_out(command: Command, tmp_path: Path) -> None:
    result = command("run", SMALL_LINE, "--record", "bag", "--duration", "0.1", "--no-pictures")
    assert result.exit_code == 0, result.output
    assert (tmp_path / "bag" / "bag_0.mcap").exists()


def test_recover_and_replay_a_bag_that_was_cut(command: Command, tmp_path: Path) -> None:
    command("run", SMALL_LINE, "--out", "bag", "--duration", "0.6", "--no-pictures")
    assert "nothing to do" in command("recover", "bag").output
    replayed = command("replay", "bag")
    assert replayed.exit_code == 0, replayed.output
    assert missing(replayed.output, ["equal", "bit for bit", "tick 60", "0.60 s"]) == []
    file = tmp_path / "bag" / "bag_0.mcap"
    file.write_bytes(file.read_bytes()[:-50])
    assert_refused(command("replay", "bag"), "conveyor-sim recover")
    recovered = command("recover", "bag")
    assert recovered.exit_code == 0, recovered.output
    assert "repaired, with" in recovered.output
    assert missing(recovered.output, ["damaged original", "bag_0.mcap.damaged"]) == []
    assert command("replay", "bag").exit_code == 0


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--rate", "2"), "--rate: given without --publish, expected both or neither"),
        (("--start", "0"), "--start: given without --publish"),
        (("--", "--ros-args"), "--ros-args: given without --publish"),
        (("--publish", "--rate", "-1"), "--rate: -1 given, expected a number of at least 0"),
        (("--publish", "--rate", "nan"), "--rate: nan given"),
    ],
)
def test_replay_refuses_options_that_cannot_be(command: Command, arguments: tuple[str, ...], sentence: str) -> None:
    assert_refused(command("replay", "bag", *arguments), sentence)


def test_replay_over_ros_says_what_it_lacks() -> None:
    without_ros = "import sys; sys.modules['rclpy'] = None; from conveyor_sim.cli import main; main()"
    done = run(["-c", without_ros, "replay", "bag", "--publish"])
    assert done.returncode == 1
    assert re.search("^Error: replay --publish: .*rclpy.*, expected ROS 2 with rclpy and conveyor_msgs", done.stderr)
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ("serve", "two_bottles", "--modbus", "0", "--real-time-factor", "nan"),
        ("attach", "two_bottles", "modbus://127.0.0.1:1", "--tags", "tags.csv", "--period", "NaN"),
    ],
)
def test_what_is_no_number_is_in_no_range(command: Command, arguments: tuple[str, ...]) -> None:
    refused = command(*arguments)
    assert refused.exit_code == 2
    words = rf"Invalid value for '{arguments[-2]}': {arguments[-1]} is not in the range .*<=x<="
    assert re.search(words, refused.output)


def test_plot_draws_into_a_folder(command: Command, tmp_path: Path) -> None:
    command("run", SMALL_LINE, "--out", "bag", "--duration", "0.4", "--no-pictures")
    result = command("plot", "bag", "--out", "drawn", "--time", "0.2", "--bottle", "0")
    assert result.exit_code == 0, result.output
    assert (tmp_path / "drawn" / "velocity_bottle_0.png").exists()
    assert_refused(command("plot", "bag", "--time", "99"), "99")


@pytest.mark.parametrize("name", ["replay", "plot", "recover", "events", "alarms"])
def test_bag_that_is_not_there_is_refused(command: Command, name: str) -> None:
    assert_refused(command(name, "gone"), "gone: no ")


def test_scene_that_is_not_there_is_refused(command: Command) -> None:
    assert_refused(command("run", "gone.yaml"), "gone.yaml")


def test_a_description_does_not_command_the_terminal(command: Command, tmp_path: Path) -> None:
    text = SMALL_LINE.read_text(encoding="utf-8")
    (tmp_path / "evil.yaml").write_text(re.sub("description: .*", r'description: "red \\e[31m"', text))
    output = command("check", "evil.yaml", "--details").output
    assert r"red \x1b[31m" in output
    assert "\x1b" not in output


def test_what_can_not_be_written_out_is_one_sentence(tmp_path: Path) -> None:
    """A full disk behind the output, and a path that is no text."""
    code = "from conveyor_sim.cli import main; main()"
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-c", code, "explain", str(SMALL_LINE)], stdout=full, stderr=subprocess.PIPE, text=True
        )
    assert (done.returncode, done.stderr) == (1, "Error: No space left on device\n")
    odd = tmp_path / "\udcff"
    record(load_scene(SMALL_LINE), odd, 5)
    done = subprocess.run([sys.executable, "-c", code, "recover", str(odd)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert r"\udcff: is intact" in done.stdout


@pytest.mark.parametrize("name", ["recover", "replay", "plot"])
def test_a_path_that_is_too_long_is_refused(command: Command, name: str) -> None:
    assert_refused(command(name, "x" * 300), "File name too long")


def test_help_names_the_commands(command: Command) -> None:
    result = command("--help")
    for name in ("check", "run", "plot", "replay", "recover"):
        assert re.search(rf"^  {name} ", result.output, re.MULTILINE)
