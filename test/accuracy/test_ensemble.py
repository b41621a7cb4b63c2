# SPDX-License-Identifier: Apache-2.0
"""Long runs over processes: equal results from any process, and no run lost or repeated after a kill."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from facts import missing, stating
from scenes import RADIUS, base, belt, bottle, contact, scene, segment

import conveyor_sim
from conveyor_sim.accuracy.measure.ensemble import Ensemble
from conveyor_sim.accuracy.measure.equivalence import LOOKS, run_until_decided
from conveyor_sim.accuracy.measure.jitter import disturb, jittered
from conveyor_sim.accuracy.measure.observables import measuring, observe
from conveyor_sim.accuracy.measure.sample_file import SAMPLES
from conveyor_sim.accuracy.results import Sample
from conveyor_sim.accuracy.setting import Setting, with_setting
from conveyor_sim.errors import ConveyorError
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.worker_pool import DIED

FINE = Setting("semi_implicit_euler", 100)
COARSE = Setting("semi_implicit_euler", 40, stiffness=0.5)
IMPOSSIBLE = Setting("semi_implicit_euler", 10_000_001)
"""One step a tick more than a scene may ask for."""
ROOT = Path(conveyor_sim.__file__).parents[1]
WORKERS = min(2, len(os.sched_getaffinity(0)))
PATIENCE = 60.0
"""s until a test gives up waiting for another process: it stands in for `for ever`."""

STUDY = """
import sys
from pathlib import Path
from conveyor_sim.accuracy.measure.equivalence import run_until_decided
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.scene import load_scene

scene, folder, *per_tick = sys.argv[1:]
reference, candidate = (Setting("semi_implicit_euler", int(steps)) for steps in per_tick)
run_until_decided(load_scene(scene), [candidate], reference, 0.5, 1e9, Path(folder), lambda *_: None, processes=2)
"""


def silent(done: int, total: int, spent: float) -> None:
    """Ignore the progress."""


def filling(**fields: object) -> Scene:
    """A belt that fills from an infeed up to a stop, before which two bottles stand already."""
    damped = [contact(5e3, other, damping=("normal", 2.0)) for other in ("glass", "steel")]
    feed = {"bottle": "bottle", "position": [0.0, 0.0], "direction": 0.0, "speed": 0.5, "gap": 0.002, "count": 3}
    parts: dict[str, object] = {
        "tick": 0.01,
        "duration": 0.6,
        "base": base(0.4),
        "contacts": damped,
        "belts": {"belt": belt(0.5)},
        "rails": {"stop": segment((0.6, -1.0), (0.6, 1.0))},
        "infeeds": {"in": feed},
        "bottles": [bottle(0.6 - RADIUS, 0.0), bottle(0.6 - 3.0 * RADIUS - 0.001, 0.003)],
    }
    return scene(**{**parts, **fields})


def runs_of(*settings: Setting, seeds: int) -> list[tuple[Setting, int]]:
    return [(setting, seed) for seed in range(seeds) for setting in settings]


def timeless(samples: list[Sample]) -> list[Sample]:
    """All but what a run took."""
    return [replace(sample, cpu=0.0) for sample in samples]


def alone(it: Scene, setting: Setting, seed: int) -> dict[str, float]:
    """Observables of a run that is made here."""
    run = Simulation(with_setting(it, setting, **measuring(it), **jittered(it, seed)), threads=1)
    disturb(run, seed)
    return observe(run)


def rows(folder: Path) -> list[str]:
    """Lines of finished runs, without the last if it is not whole."""
    file = folder / SAMPLES
    return file.read_text().split("\n")[1:-1] if file.exists() else []


def children_of(pid: int) -> set[int]:
    """Processes of a process, and theirs."""
    try:
        tasks = list(Path(f"/proc/{pid}/task").iterdir())
        own = {int(child) for task in tasks for child in (task / "children").read_text().split()}
    except FileNotFoundError:
        return set()
    return own.union(*(children_of(child) for child in own))


def workers_of(pid: int) -> set[int]:
    """Return the child processes that a pool started."""
    found = set()
    for child in children_of(pid):
        try:
            command = Path(f"/proc/{child}/cmdline").read_bytes()
        except FileNotFoundError:
            continue
        if b"spawn_main" in command:
            found.add(child)
    return found


def wait_until(condition: Callable[[], object]) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.005)


@contextmanager
def study(it: Scene, folder: Path, per_tick: tuple[int, int]) -> Iterator[subprocess.Popen[bytes]]:
    """A process that studies a scene; killed in the end if it still runs."""
    file = folder.with_suffix(".yaml")
    file.write_text(it.source_text)
    command = [sys.executable, "-c", STUDY, str(file), str(folder), *map(str, per_tick)]
    with subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE) as process:
        try:
            yield process
        finally:
            process.kill()


def test_samples_are_those_of_runs_made_one_by_one(tmp_path: Path) -> None:
    """The samples do not depend on the number of processes, and come in the requested order."""
    it, wanted = filling(), runs_of(FINE, COARSE, seeds=3)
    told: list[tuple[int, int, float]] = []
    made = []
    for processes in (1, 2):
        with Ensemble(it, tmp_path / str(processes), processes) as ensemble:
            made.append(ensemble.run(wanted, lambda *state: told.append(state)))
    assert timeless(made[0]) == timeless(made[1])
    assert [(sample.setting, sample.seed) for sample in made[0]] == wanted
    for sample in made[0]:
        assert sample.values == alone(it, sample.setting, sample.seed)
        assert (sample.failure, sample.cpu > 0.0) == ("", True)
    forces = [sample.values["mean queue force"] for sample in made[0]]
    assert len(set(forces)) == len(forces)
    assert told[0] == (0, 6, 0.0)
    assert told[:7] == sorted(told[:7])
    assert told[6] == (6, 6, pytest.approx(sum(sample.cpu for sample in made[0])))


def test_kill_9_and_resume_give_the_table_of_an_uninterrupted_study(tmp_path: Path) -> None:
    """Killed in the middle of its runs: what was finished stays, line by line, and no process is left over."""
    it, per_tick = filling(), (2000, 1000)
    settings = [Setting("semi_implicit_euler", steps) for steps in per_tick]
    killed = tmp_path / "killed"
    with study(it, killed, per_tick) as process:
        wait_until(lambda: len(rows(killed)) >= 5)
        workers = workers_of(process.pid)
        process.kill()
    wait_until(lambda: not any(Path(f"/proc/{worker}").exists() for worker in workers))
    assert len(workers) == WORKERS
    kept = rows(killed)
    assert 5 <= len(kept) < 2 * LOOKS[0], "killed too late to tell anything"
    resumed, straight = (
        run_until_decided(it, settings[1:], settings[0], 0.5, 1e9, folder, silent, processes=1)
        for folder in (killed, tmp_path / "straight")
    )
    assert rows(killed)[: len(kept)] == kept
    assert len(rows(killed)) == len(set(rows(killed))) == 2 * LOOKS[0]
    assert timeless(resumed[0]) == timeless(straight[0])
    assert resumed[1] == straight[1]
    assert {row.verdict for row in resumed[1]} == {"equivalent"}


def test_ctrl_c_ends_a_study_and_its_processes_at_once(tmp_path: Path) -> None:
    """Runs that take minutes are not waited for; the interrupt passes on."""
    with study(filling(), tmp_path / "long", (1_000_000, 999_999)) as process:
        wait_until(lambda: len(workers_of(process.pid)) == WORKERS)
        wait_until(lambda: (tmp_path / "long" / SAMPLES).exists())
        time.sleep(1.0)  # for the interrupt to find it in a run rather than in an import
        workers = workers_of(process.pid)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=PATIENCE)
        assert process.returncode == -signal.SIGINT
        assert b"KeyboardInterrupt" in errors
        wait_until(lambda: not any(Path(f"/proc/{worker}").exists() for worker in workers))
        assert rows(tmp_path / "long") == []


def test_a_process_that_dies_takes_no_run_with_it(tmp_path: Path) -> None:
    it, wanted = filling(), runs_of(Setting("semi_implicit_euler", 2000), seeds=6)
    victims: list[int] = []

    def kill_one(done: int, total: int, spent: float) -> None:
        if done == 2 and not victims:
            victims.append(min(workers_of(os.getpid())))
            os.kill(victims[0], signal.SIGKILL)

    with Ensemble(it, tmp_path, 2) as ensemble:
        samples = ensemble.run(wanted, kill_one)
    assert len(victims) == 1
    assert [sample.values for sample in samples] == [alone(it, *run) for run in wanted]
    assert len(rows(tmp_path)) == 6


def test_a_run_whose_process_dies_again_has_failed(tmp_path: Path) -> None:
    over = threading.Event()

    def kill_all() -> None:
        while not over.wait(0.01):
            for worker in workers_of(os.getpid()):
                os.kill(worker, signal.SIGKILL)

    killer = threading.Thread(target=kill_all)
    killer.start()
    try:
        with Ensemble(filling(), tmp_path, 1) as ensemble:
            samples = ensemble.run(runs_of(FINE, seeds=1), silent)
    finally:
        over.set()
        killer.join()
    assert [(sample.values, sample.failure) for sample in samples] == [({}, DIED)]
    with Ensemble(filling(), tmp_path, 1) as ensemble:
        assert ensemble.run(runs_of(FINE, seeds=1), silent) == samples


def test_a_run_that_can_not_go_on_is_a_sample_too(tmp_path: Path) -> None:
    """A speed beyond all reason; and a setting that the scene refuses."""
    it = filling(bottles=[bottle(0.2, 1.0, 1e20)])
    with Ensemble(it, tmp_path, 1) as ensemble:
        blown, refused = ensemble.run([(FINE, 0), (IMPOSSIBLE, 0)], silent)
        assert ensemble.run([(FINE, 0)], silent) == [blown]
    assert (blown.values, refused.values) == ({}, {})
    assert not missing(blown.failure, "bottle 0", "1e+20 m/s", "13 mm")
    assert "accuracy.per_tick" in refused.failure


def test_a_study_ends_with_its_budget_and_goes_on_with_a_larger_one(tmp_path: Path) -> None:
    """One run tells what the others cost; then as many as fit; a study that is repeated comes to the same."""
    it = filling()

    def made(tolerance: float, budget: float) -> tuple[list[Sample], list[object]]:
        samples, comparisons = run_until_decided(it, [COARSE], FINE, tolerance, budget, tmp_path, silent, processes=1)
        return samples, list(comparisons)

    pilot, undecided = made(1e-6, 0.0)
    assert [(sample.setting, sample.seed) for sample in pilot] == runs_of(FINE, COARSE, seeds=1)
    assert {row.verdict for row in undecided} == {"undecided"}
    cost = sum(sample.cpu for sample in pilot)
    cut, _ = made(1e-6, 4.5 * cost)
    assert [(sample.setting, sample.seed) for sample in cut] == runs_of(FINE, COARSE, seeds=4)
    assert cut[:2] == pilot
    again = made(1e-6, 4.5 * cost)
    assert again[0] == cut
    assert {row.runs for row in again[1]} == {4}
    assert all(row.resolution < float("inf") for row in again[1])
    full, comparisons = made(0.9, 1e9)
    assert full[:8] == cut
    assert len(full) == 2 * LOOKS[0]
    assert {row.verdict for row in comparisons} == {"equivalent"}
    assert len(rows(tmp_path)) == 2 * LOOKS[0]


def test_only_what_is_open_is_run_again(tmp_path: Path) -> None:
    """A tenth of the stiffness is soon found to be different; to find the same setting, in another guise, is not."""
    it = filling()
    twin = Setting("semi_implicit_euler", 101)
    soft = Setting("semi_implicit_euler", 40, stiffness=0.1)
    samples, comparisons = run_until_decided(it, [twin, soft, FINE], FINE, 0.07, 1e9, tmp_path, silent, processes=1)
    runs = {setting: sum(sample.setting == setting for sample in samples) for setting in (FINE, twin, soft)}
    by_setting = {setting: max(row.runs for row in comparisons if row.setting == setting) for setting in (twin, soft)}
    assert runs[twin] == by_setting[twin]
    assert runs[soft] == by_setting[soft]
    assert runs[FINE] == runs[twin] > runs[soft]
    assert {row.setting for row in comparisons} == {twin, soft}
    assert {row.verdict for row in comparisons if row.setting == twin} == {"equivalent"}
    assert "different" in {row.verdict for row in comparisons if row.setting == soft}


def test_the_reference_must_run(tmp_path: Path) -> None:
    with pytest.raises(ConveyorError, match=stating("reference", "semi_implicit_euler 10000001", "failed", "seed 0")):
        run_until_decided(filling(), [FINE], IMPOSSIBLE, 0.1, 1.0, tmp_path, silent, 1)


def test_settings_that_fail_are_run_once(tmp_path: Path) -> None:
    samples, comparisons = run_until_decided(filling(), [IMPOSSIBLE, COARSE], FINE, 0.9, 1e9, tmp_path, silent, 1)
    assert sum(sample.setting == IMPOSSIBLE for sample in samples) == 1
    assert {row.setting for row in comparisons} == {COARSE}
