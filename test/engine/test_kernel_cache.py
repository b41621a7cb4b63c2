# SPDX-License-Identifier: Apache-2.0
"""Files of compiled kernels: a faulty file is compiled again."""

import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import pytest
from facts import missing
from numba_source import relies_on

from conveyor_sim.engine.compiler.kernel_folder import CHECKSUM, MAGIC, KernelFolder, NotCached, cached_only, checksum
from conveyor_sim.engine.compiler.numba_internals.kernel_cache import KernelCache


def twice(x: float) -> float:
    """Return twice the number; this function is compiled."""
    return 2.0 * x


def compiled(folder: Path | None) -> Any:
    """Return the function as in a process that has not used it yet."""
    function = numba.njit(twice)
    function._cache = KernelCache(twice, {}, KernelFolder(folder, ""))
    return function


def counts(function: Any) -> tuple[int, int]:
    """Call it, and return how many kernels were loaded and how many compiled."""
    assert function(1.5) == 3.0
    return sum(function.stats.cache_hits.values()), sum(function.stats.cache_misses.values())


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Return the kernel's file."""
    assert counts(compiled(tmp_path)) == (0, 1)
    (path,) = tmp_path.glob("*.kernel")
    assert counts(compiled(tmp_path)) == (1, 0)
    return path


def flipped(content: bytes, place: float) -> bytes:
    changed = bytearray(content)
    changed[int(place * (len(content) - 1))] ^= 1
    return bytes(changed)


def withchecksum(payload: bytes) -> bytes:
    return MAGIC + checksum(payload) + payload


LOADING = """
import sys
from pathlib import Path
import numba
import numpy
from conveyor_sim.engine.compiler.kernel_folder import KernelFolder
from conveyor_sim.engine.compiler.numba_internals.kernel_cache import KernelCache

def total(values):
    summed = 0.0
    for value in values:
        summed += value
    return summed

sum_of = numba.njit(total)
sum_of._cache = KernelCache(total, {}, KernelFolder(Path(sys.argv[1]), ""))
total_of = sum_of(numpy.array([1.0, 2.0]))
print(total_of, "numba.np.arraymath" in sys.modules, numba.njit(lambda values: values.max())(numpy.array([1.0, 2.0])))
"""

HEADER = len(MAGIC) + CHECKSUM

DAMAGE: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda content: b"",
    "cut in the header": lambda content: content[: HEADER - 5],
    "only a header": lambda content: content[:HEADER],
    "cut by half": lambda content: content[: len(content) // 2],
    "a byte more": lambda content: content + b"\0",
    **{f"flipped at {place}": lambda content, place=place: flipped(content, place) for place in (0.0, 0.01, 0.5, 1.0)},
    "a text": lambda content: "Zuführung\n".encode("latin-1") * 100,
    "zeros": lambda content: bytes(len(content)),
    "no pickle": lambda content: withchecksum(b"\x80\x04 not a pickle"),
    "another pickle": lambda content: withchecksum(pickle.dumps({"one": 1})),
    "other types": lambda content: withchecksum(pickle.dumps((("another", "key"), ()))),
    "of a module that is gone": lambda content: withchecksum(b"cno_such_module\nThing\n."),
    "no machine code": lambda content: withchecksum(
        pickle.dumps((pickle.loads(content[HEADER:])[0], ("not", "a", "kernel")))
    ),
}


@pytest.mark.parametrize("damage", DAMAGE.values(), ids=DAMAGE.keys())
def test_a_damaged_file_is_compiled_again(
    file: Path, damage: Callable[[bytes], bytes], caplog: pytest.LogCaptureFixture
) -> None:
    file.write_bytes(damage(file.read_bytes()))
    assert counts(compiled(file.parent)) == (0, 1)
    (line,) = caplog.messages
    assert line.startswith(f"{file}: cached kernel not used because it ")
    assert counts(compiled(file.parent)) == (1, 0)
    assert len(caplog.messages) == 1


@pytest.mark.parametrize("kind", ["link", "pipe", "folder", "open to others"])
def test_a_file_that_another_could_have_put_is_compiled_again(
    file: Path, kind: str, caplog: pytest.LogCaptureFixture, tmp_path_factory: pytest.TempPathFactory
) -> None:
    if kind == "open to others":
        file.chmod(0o666)
    else:
        elsewhere = file.rename(tmp_path_factory.mktemp("elsewhere") / file.name)
        {
            "link": lambda: file.symlink_to(elsewhere),
            "pipe": lambda: os.mkfifo(file),
            "folder": lambda: file.mkdir(),
        }[kind]()
    assert counts(compiled(file.parent)) == (0, 1)
    assert caplog.messages[0].startswith(f"{file}: cached kernel not used because ")
    assert counts(compiled(file.parent)) == ((0, 1) if kind == "folder" else (1, 0))


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can make files of another user")
def test_a_file_of_another_user_is_compiled_again(file: Path) -> None:
    os.chown(file, 65534, 65534)
    assert counts(compiled(file.parent)) == (0, 1)
    assert file.stat().st_uid == 0
    assert counts(compiled(file.parent)) == (1, 0)


def test_files_are_of_this_user_only(file: Path) -> None:
    assert file.stat().st_mode & 0o777 == 0o600


def test_a_folder_that_takes_nothing_is_told_once(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    folder = KernelFolder(tmp_path / "gone", "")
    folder.write("one", b"1")
    folder.write("two", b"2")
    assert missing("\n".join(caplog.messages), f"{tmp_path}/gone", "No such file or directory") == []
    assert counts(compiled(tmp_path / "gone")) == (0, 1)


def test_without_a_folder_everything_is_compiled(caplog: pytest.LogCaptureFixture) -> None:
    assert counts(compiled(None)) == (0, 1)
    assert counts(compiled(None)) == (0, 1)
    assert not caplog.messages


def test_what_is_not_cached_is_not_compiled_where_that_is_not_wanted(file: Path) -> None:
    with cached_only():
        assert counts(compiled(file.parent)) == (1, 0)
        file.unlink()
        with pytest.raises(NotCached, match="twice"):
            compiled(file.parent)(1.5)
    assert counts(compiled(file.parent)) == (0, 1)


@relies_on("core/runtime/nrt.py: _Runtime.initialize", "core/caching.py: _Cache")
def test_a_process_that_loads_a_kernel_needs_no_compiler_and_can_compile_another(tmp_path: Path) -> None:
    """A start that loads all kernels does not need numba's tables of compilable functions."""
    program = tmp_path / "loading.py"
    program.write_text(LOADING)
    command = [sys.executable, str(program), str(tmp_path / "kernels")]
    (tmp_path / "kernels").mkdir()
    said = [subprocess.run(command, stdout=subprocess.PIPE, check=True, text=True).stdout for _ in range(2)]
    assert said == ["3.0 True 2.0\n", "3.0 False 2.0\n"]
