# SPDX-License-Identifier: Apache-2.0
"""Folder of compiled kernels: no other user can add a file to it."""

import os
import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from facts import missing

from conveyor_sim.engine.compiler.cache_folder import choose_cache_folder

NOBODY = 65534
needs_root = pytest.mark.skipif(os.geteuid() != 0, reason="only root can make files of another user")

FORCE = """
import numpy as np
from conveyor_sim.engine.arrays.contacts import ContactLaw
from conveyor_sim.engine.compiler.compile import kernel
from conveyor_sim.engine.contact.contact import contact_force
contact_force = kernel(contact_force.py_func)
law = ContactLaw(stiffness=np.array([5000.0]), friction=np.array([0.3]))
print(contact_force(law, np.uint64(0), None, 0.01, None, 0.002, 1.0, 0.0, 1.0, None, None)[1])
"""


class Intrusion:
    """Leaves a trace when it is unpickled."""

    def __init__(self, trace: Path) -> None:
        self._trace = trace

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, (str(self._trace),)


def mode(folder: Path) -> int:
    return folder.stat().st_mode & 0o7777


@pytest.fixture
def base(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of the caches of all programs."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "caches"))
    return tmp_path / "caches"


def refused(folder: Path, fault: str) -> None:
    """Assert that there is no cache, and that one sentence names the folder and what is wrong with it."""
    before = folder.lstat()
    assert choose_cache_folder("here") == (
        None,
        f"kernels are not cached, so every start compiles them: "
        f"{folder} {fault}, expected a folder of user {os.geteuid()} with mode 0700",
    )
    assert folder.lstat() == before, "left alone"


def test_a_new_folder_is_for_this_user_only(base: Path) -> None:
    for _ in range(2):
        assert choose_cache_folder("here") == (base / "conveyor_sim" / "here", "")
    assert [mode(base / path) for path in ("conveyor_sim", "conveyor_sim/here")] == [0o700] * 2


def test_a_new_folder_in_a_folder_with_a_group_of_its_own_is_used(base: Path) -> None:
    """Subfolders of a folder with the set-group-ID bit get this bit, too."""
    base.mkdir()
    base.chmod(0o2775)
    assert choose_cache_folder("here") == (base / "conveyor_sim" / "here", "")


OWN = ["conveyor_sim", "conveyor_sim/here"]


@pytest.mark.parametrize("own", OWN)
@pytest.mark.parametrize("wrong", [0o777, 0o755, 0o770, 0o1777, 0o720, 0o701])
def test_a_folder_of_another_mode_is_not_used(base: Path, own: str, wrong: int) -> None:
    (base / "conveyor_sim" / "here").mkdir(parents=True)
    (base / "conveyor_sim").chmod(0o700)
    (base / own).chmod(wrong)
    refused(base / own, f"has mode {wrong & 0o777:04o}")


@pytest.mark.parametrize("own", OWN)
def test_a_link_is_not_used(base: Path, tmp_path: Path, own: str) -> None:
    (tmp_path / "elsewhere" / "here").mkdir(parents=True)
    for folder in (tmp_path / "elsewhere", tmp_path / "elsewhere" / "here"):
        folder.chmod(0o700)
    (base / own).parent.mkdir(parents=True)
    (base / own).parent.chmod(0o700)
    (base / own).symlink_to(tmp_path / "elsewhere")
    refused(base / own, "is a symbolic link")


@pytest.mark.parametrize("own", OWN)
def test_a_file_is_not_used(base: Path, own: str) -> None:
    (base / own).parent.mkdir(parents=True)
    (base / own).parent.chmod(0o700)
    (base / own).touch(mode=0o700)
    refused(base / own, "is not a folder")


@needs_root
@pytest.mark.parametrize("own", OWN)
def test_a_folder_of_another_user_is_not_used(base: Path, own: str) -> None:
    (base / "conveyor_sim" / "here").mkdir(parents=True)
    for folder in OWN:
        (base / folder).chmod(0o700)
    os.chown(base / own, NOBODY, NOBODY)
    refused(base / own, f"belongs to user {NOBODY}")


def test_a_folder_that_can_not_be_created_is_not_used(base: Path) -> None:
    base.touch()
    folder, remark = choose_cache_folder("here")
    assert folder is None
    assert missing(remark, str(base), "File exists") == []


def force(folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run a process that needs one kernel, with its cache in a folder."""
    return subprocess.run(
        [sys.executable, "-c", FORCE],
        env={**os.environ, "NUMBA_CACHE_DIR": str(folder), **environment},
        capture_output=True,
        text=True,
        check=True,
    )


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of caches with one kernel."""
    folder = tmp_path_factory.mktemp("filled")
    force(folder)
    assert list(folder.rglob("*.kernel"))
    return folder


@needs_root
@pytest.mark.parametrize("variable", ["NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "HOME"])
def test_files_that_another_user_has_put_are_not_run(filled: Path, tmp_path: Path, variable: str) -> None:
    """The names of the files are no secret, because they are the same for every user."""
    shared = tmp_path / "shared"
    base = shared / ".cache" if variable == "HOME" else shared
    base.mkdir(parents=True)
    base.chmod(0o1777)
    theirs = base / "conveyor_sim"
    shutil.copytree(filled / "conveyor_sim", theirs)
    trace = tmp_path / "trace"
    for path in [theirs, *theirs.rglob("*")]:
        if path.is_file():
            path.write_bytes(pickle.dumps(Intrusion(trace)))
        os.chown(path, NOBODY, NOBODY)
    before = sorted(theirs.rglob("*"))
    done = force(shared, **{"NUMBA_CACHE_DIR": "", "XDG_CACHE_HOME": "", variable: str(shared)})
    assert done.stdout == "-3.0\n"
    assert not trace.exists()
    assert missing(done.stderr, str(theirs), f"user {NOBODY}", "user 0", "0700") == []
    assert sorted(theirs.rglob("*")) == before
    assert all(path.stat().st_uid == NOBODY for path in theirs.rglob("*"))


def test_damage_in_every_file_is_compiled_away(filled: Path) -> None:
    files = list(filled.rglob("*.kernel"))
    for path in files:
        content = bytearray(path.read_bytes())
        content[len(content) // 2] ^= 1
        path.write_bytes(content)
    damaged = force(filled)
    assert damaged.stdout == "-3.0\n"
    assert damaged.stderr.count(" cached kernel not used because it is damaged; compiling it again\n") == len(files)
    again = force(filled)
    assert again.stdout == "-3.0\n"
    assert "not used" not in again.stderr
