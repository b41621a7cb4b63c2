# SPDX-License-Identifier: Apache-2.0
"""Claims: if several processes need a kernel at the same time, one compiles it."""

import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numba
import pytest

from conveyor_sim.engine.compiler import claims
from conveyor_sim.engine.compiler.claims import Claims
from conveyor_sim.engine.compiler.kernel_folder import KernelFolder
from conveyor_sim.engine.compiler.numba_internals.dispatcher import kernel_dispatcher
from conveyor_sim.engine.compiler.numba_internals.kernel_cache import KernelCache

# Prints "waits" before the second look, because the first look comes before it reads.
WANTING = """
import sys
from pathlib import Path
from conveyor_sim.engine.compiler.kernel_folder import KernelFolder
from conveyor_sim.engine.compiler.numba_internals.dispatcher import kernel_dispatcher

def twice(x):
    return 2.0 * x

looks = 0

def look():
    global looks
    looks += 1
    if looks == 2:
        print("waits", flush=True)
    if looks > 2 and len(sys.argv) > 2:
        raise SystemExit("ended while it waited")

folder = KernelFolder(Path(sys.argv[1]), "")
folder.before_read = look
function = kernel_dispatcher(twice, folder)
assert function(1.5) == 3.0
loaded, missed = (sum(counts.values()) for counts in (function.stats.cache_hits, function.stats.cache_misses))
print(loaded, "loaded,", missed, "compiled", flush=True)
sys.stdin.read()
"""

HOLDING = """
import sys
from pathlib import Path
from conveyor_sim.engine.compiler.claims import Claims
claims = Claims(Path(sys.argv[1]))
waited = claims.take(sys.argv[2], lambda: None)
print("waited for it" if waited else "has it", flush=True)
sys.stdin.read()
"""


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., "subprocess.Popen[str]"]]:
    """Yield a function that starts one of the programs above."""
    processes = []

    def started(program: str, *arguments: str) -> "subprocess.Popen[str]":
        file = tmp_path / f"{'wanting' if program == WANTING else 'holding'}.py"
        file.write_text(program)
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        processes.append(subprocess.Popen([sys.executable, str(file), *arguments], text=True, **pipes))
        return processes[-1]

    yield started
    for process in processes:
        process.kill()
        process.communicate()


@pytest.fixture
def kernel(tmp_path: Path, start: Callable[..., "subprocess.Popen[str]"]) -> Path:
    """Return the file that the program makes."""
    (tmp_path / "kernels").mkdir()
    assert start(WANTING, str(tmp_path / "kernels")).communicate()[0] == "0 loaded, 1 compiled\n"
    (path,) = (tmp_path / "kernels").glob("*.kernel")
    return path


@pytest.mark.parametrize("outcome", ["compiled", "given up", "killed"])
def test_one_compiles_and_the_other_waits(
    kernel: Path, outcome: str, start: Callable[..., "subprocess.Popen[str]"]
) -> None:
    folder, made = str(kernel.parent), kernel.read_bytes()
    kernel.unlink()
    holds = start(HOLDING, folder, kernel.name)
    assert holds.stdout.readline() == "has it\n"
    wants = start(WANTING, folder)
    assert wants.stdout.readline() == "waits\n"
    if outcome == "compiled":
        kernel.write_bytes(made)
        kernel.chmod(0o600)
    if outcome == "killed":
        holds.send_signal(signal.SIGKILL)
    holds.communicate()
    said, errors = wants.communicate()
    assert said == ("1 loaded, 0 compiled\n" if outcome == "compiled" else "0 loaded, 1 compiled\n"), errors
    assert kernel.exists()


def test_of_two_that_wait_only_one_compiles(kernel: Path, start: Callable[..., "subprocess.Popen[str]"]) -> None:
    kernel.unlink()
    holds = start(HOLDING, str(kernel.parent), kernel.name)
    assert holds.stdout.readline() == "has it\n"
    both = [start(WANTING, str(kernel.parent)) for _ in range(2)]
    assert [wants.stdout.readline() for wants in both] == ["waits\n"] * 2
    holds.communicate()
    assert sorted(wants.stdout.readline() for wants in both) == ["0 loaded, 1 compiled\n", "1 loaded, 0 compiled\n"]


def test_who_waits_can_be_ended(kernel: Path, start: Callable[..., "subprocess.Popen[str]"]) -> None:
    kernel.unlink()
    holds = start(HOLDING, str(kernel.parent), kernel.name)
    assert holds.stdout.readline() == "has it\n"
    wants = start(WANTING, str(kernel.parent), "end")
    assert wants.communicate() == ("waits\n", "ended while it waited\n")


def test_a_process_that_stands_still_is_not_waited_for_long(
    kernel: Path, start: Callable[..., "subprocess.Popen[str]"], monkeypatch: pytest.MonkeyPatch
) -> None:
    holds = start(HOLDING, str(kernel.parent), "one")
    assert holds.stdout.readline() == "has it\n"
    holds.send_signal(signal.SIGSTOP)
    monkeypatch.setattr(claims, "LONGEST", 0.1)
    looks: list[None] = []
    assert Claims(kernel.parent).take("one", lambda: looks.append(None))
    assert 1 <= len(looks) <= 5
    assert not Claims(kernel.parent).take("another", lambda: looks.append(None))


def test_where_files_can_not_be_locked_everybody_compiles(tmp_path: Path) -> None:
    assert not Claims(Path("/proc/nowhere")).take("one", lambda: None)
    (tmp_path / claims.NAME).symlink_to("elsewhere")
    assert not Claims(tmp_path).take("one", lambda: None)
    assert not (tmp_path / "elsewhere").exists()


def test_a_kernel_that_can_not_be_compiled_is_given_back(
    tmp_path: Path, start: Callable[..., "subprocess.Popen[str]"]
) -> None:
    def wrong(x: float) -> float:
        return x.no_such_thing  # type: ignore[attr-defined]

    class Named(KernelCache):
        def _name(self, key: object) -> str:
            return "one"

    folder = KernelFolder(tmp_path, "")
    function = kernel_dispatcher(wrong, folder)
    function._cache = Named(wrong, {}, folder)
    with pytest.raises(numba.TypingError, match="no_such_thing"):
        function(1.5)
    assert (tmp_path / claims.NAME).exists()
    holds = start(HOLDING, str(tmp_path), "one")
    assert holds.stdout.readline() == "has it\n"
    holds.communicate()
    assert not Claims(tmp_path).take("one", lambda: None)
