# SPDX-License-Identifier: Apache-2.0
"""Programs compiled to a shared library: the worked shim, and broken libraries."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
from pathlib import Path

import pytest

from conveyor_sim.control.scan import ControlError
from conveyor_sim.control.st import StructuredText
from conveyor_sim.control.st.library import CompiledProgram
from conveyor_sim.testing import Scenario

ROOT = Path(__file__).parent.parent.parent.parent
SHIM = ROOT / "examples" / "st" / "compiled" / "table.c"
TABLE = ROOT / "test" / "testing" / "table.yaml"
TAGS = {
    "eye": "photo_eyes/high/blocked",
    "feeder_speed": "belts/feeder/cmd_speed",
    "table_speed": "belts/table/cmd_speed",
    "held": "alarms/table full",
}
BODY = "TABLE_body(&p->program);"


def built(folder: Path, name: str = "table", text: str | None = None) -> Path:
    """Build the shim as a library, optionally from a changed text."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler")
    source, made = folder / f"{name}.c", folder / f"{name}.so"
    source.write_text(SHIM.read_text() if text is None else text)
    subprocess.run(
        [compiler, "-std=c11", "-Wall", "-Werror", "-shared", "-fPIC", f"-I{ROOT / 'include'}", "-o", made, source],
        check=True,
    )
    return made


def broken(folder: Path, body: str, patience: float = 5.0) -> CompiledProgram:
    """Build a library whose scan changes its behaviour from the tenth scan on."""
    text = SHIM.read_text()
    assert text.count(BODY) == 1
    text = "#include <threads.h>\n#include <unistd.h>\n" + text.replace(
        BODY, f"{BODY} if (time_ns >= 100000000) {{ {body} }}"
    )
    return CompiledProgram(built(folder, "broken", text), TAGS, patience=patience)


def test_the_worked_shim_does_what_the_program_does(tmp_path: Path) -> None:
    made = built(tmp_path)
    hashes = []
    for controller in (StructuredText(ROOT / "examples" / "st" / "table.st"), CompiledProgram(made, TAGS)):
        plant = Scenario(TABLE)
        plant.attach(controller)
        plant.inject("machines/packer/stop")
        plant.eventually(lambda s: s["alarms/table full"], within=40)
        plant.run_for(2.0)
        plant.inject("machines/packer/stop", 0)
        plant.eventually(lambda s: s["belts/feeder/speed"] > 0, within=15)
        hashes.append(plant.simulation.state_hash())
    assert hashes[0] == hashes[1]
    assert plant.signals["plc/held"] == 0


def test_two_side_by_side_share_neither_time_nor_state(tmp_path: Path) -> None:
    made = built(tmp_path)
    early, late = Scenario(TABLE), Scenario(TABLE)
    late.run_for(3.0)
    for plant in (early, late):
        plant.attach(CompiledProgram(made, TAGS))
    alone = Scenario(TABLE)
    alone.attach(CompiledProgram(made, TAGS))
    for _ in range(50):
        early.run_for(0.1)
        late.run_for(0.1)
    alone.run_for(5.0)
    assert early.simulation.full_state_hash() == alone.simulation.full_state_hash()


def test_its_state_is_part_of_a_checkpoint(tmp_path: Path) -> None:
    made = built(tmp_path)
    whole = Scenario(TABLE)
    whole.attach(CompiledProgram(made, TAGS))
    whole.inject("machines/packer/stop")
    whole.eventually(lambda s: s["alarms/table full"], within=40)
    whole.inject("machines/packer/stop", 0)
    whole.run_for(3.0)
    whole.save(tmp_path / "warm.npz")
    whole.run_for(10.0)
    second = Scenario(whole.scene, start=tmp_path / "warm.npz")
    second.attach(CompiledProgram(made, TAGS), resume=True)
    second.run_for(10.0)
    assert second.simulation.full_state_hash() == whole.simulation.full_state_hash()


def test_its_instance_is_destroyed_at_the_end(tmp_path: Path) -> None:
    text, last = SHIM.read_text(), tmp_path / "destroyed"
    assert text.count("{ free(p); }") == 1
    text = text.replace("{ free(p); }", f'{{ fclose(fopen("{last}", "w")); free(p); }}').replace(
        "#include <stdlib.h>", "#include <stdio.h>\n#include <stdlib.h>"
    )
    program = CompiledProgram(built(tmp_path, "ends", text), TAGS)
    assert not last.exists()
    program.close()
    assert last.exists()


@pytest.mark.parametrize(
    ("body", "text"),
    [
        ("*(volatile int *)0 = 1;", r"broken\.so: ended by SIGSEGV in scan, expected an answer"),
        ("abort();", r"broken\.so: ended by SIGABRT in scan, expected an answer"),
        ("exit(3);", r"broken\.so: ended with code 3 in scan, expected an answer"),
        (
            "for (;;) thrd_sleep(&(struct timespec){.tv_sec = 1}, 0);",
            r"broken\.so: watchdog: scan took more than 5 s of wall time",
        ),
        ("return 7;", r"broken\.so: the program has stopped, with code 7"),
    ],
)
def test_what_goes_wrong_in_it_fails_the_test_and_nothing_else(tmp_path: Path, body: str, text: str) -> None:
    plant = Scenario(TABLE)
    plant.attach(broken(tmp_path, body))
    with pytest.raises(ControlError, match=text):
        plant.run_for(0.2)
    assert plant.simulation.tick == 10


def test_a_real_at_a_limit_is_the_limit(tmp_path: Path) -> None:
    """The program's variable has 32 bits, its place in the interface 64."""
    text = SHIM.read_text()
    assert text.count("data->TABLE_SPEED = 0.4;") == 1
    made = built(tmp_path, "real", text.replace("data->TABLE_SPEED = 0.4;", "data->TABLE_SPEED = (float)0.6;"))
    plant = Scenario(TABLE, overrides={"conveyors": {"table": {"speed_limits": [0.0, 0.6]}}})
    plant.attach(CompiledProgram(made, TAGS))
    plant.run_for(0.02)
    names = plant.simulation.process_image.command_names
    assert plant.simulation.line.read_back.values[names.index("belts/table/cmd_speed")] == 0.6


def says(text: str) -> str:
    """Return C code that writes to the pipe of the simulator, beside the standard streams."""
    text = text.replace('"', '\\"').replace("\n", "\\n")
    return f'for (int way = 3; way < 1024; way++) if (write(way, "{text}", sizeof "{text}" - 1) < 0) {{}}'


@pytest.mark.parametrize(
    ("body", "text"),
    [
        # A byte now and then: none of them may restart the patience.
        (
            "for (;;) { " + says("[") + " thrd_sleep(&(struct timespec){.tv_nsec = 50000000}, 0); }",
            "took more than 1 s of wall time",
        ),
        ("for (;;) { " + says("[" * 1000) + " }", "sent more than 65632 bytes"),
        (says("[]\n7\n"), "sent data without a request"),
        (says("[]\n") + " exit(0);", "sent a line that is no answer"),
        (says("{\n") + " exit(0);", "sent a line that is no answer"),
        (says("[" * 60000 + "\n") + " exit(0);", "sent a line that is no answer"),
        (says('{"answer": [1.0]}\n') + " exit(0);", "sent a line without the values of 3 outputs"),
        (says('{"answer": [1.0, "2", 3.0]}\n') + " exit(0);", "sent a line without the values of 3 outputs"),
        (says('{"answer": ') + " exit(0);", "ended with code 0 in scan"),
    ],
    ids=["slow", "endless", "two", "list", "no JSON", "deep", "few", "no number", "half"],
)
def test_patience_and_length_bound_the_whole_answer(tmp_path: Path, body: str, text: str) -> None:
    program = broken(tmp_path, body, patience=1.0)
    plant = Scenario(TABLE)
    plant.attach(program)
    with pytest.raises(ControlError, match=text):
        plant.run_for(0.2)
    assert program._process.poll() is not None


def test_a_program_that_does_not_read_is_ended_too(tmp_path: Path) -> None:
    """Its state exceeds the buffer of a pipe, and it is stopped before it reads."""
    program = CompiledProgram(built(tmp_path), TAGS, patience=1.0)
    os.kill(program._process.pid, signal.SIGSTOP)
    with pytest.raises(ControlError, match="watchdog: restore took more than 1 s of wall time"):
        program.restore({"state": "A" * 1_000_000})
    assert program._process.poll() is not None


def test_what_is_no_library_is_refused(tmp_path: Path) -> None:
    text = tmp_path / "text.so"
    text.write_text("no library")
    with pytest.raises(ControlError, match=r"text\.so: .*invalid ELF header|file too short"):
        CompiledProgram(text, TAGS)
    old = built(tmp_path, "old", SHIM.read_text().replace("return PLC_VERSION;", "return 99;"))
    with pytest.raises(ControlError, match="found version 99 of the interface, expected 1"):
        CompiledProgram(old, TAGS)
    plant = Scenario(TABLE)
    with pytest.raises(ControlError, match="found no output nothing, expected one of the program's"):
        plant.attach(CompiledProgram(built(tmp_path), {"nothing": "belts/feeder/cmd_speed"}))
    with pytest.raises(ControlError, match="eye: found belts/feeder/sped, expected a tag of this line"):
        plant.attach(CompiledProgram(built(tmp_path), {"eye": "belts/feeder/sped"}))
