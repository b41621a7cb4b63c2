"""The folder of compiled kernels: no other user can have put anything there."""

import os
import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from conveyor_sim.engine.compiler.cache_folder import Unfit, own_folder

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
    """Unpickled, it leaves a trace."""

    def __init__(self, trace: Path) -> None:
        self._trace = trace

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, (str(self._trace),)


def mode(folder: Path) -> int:
    return folder.stat().st_mode & 0o7777


def test_a_new_folder_is_for_this_user_only(tmp_path: Path) -> None:
    folder = own_folder(tmp_path / "some" / "cache", "here")
    assert folder == tmp_path / "some" / "cache" / "here"
    assert [mode(path) for path in (folder, folder.parent, folder.parent.parent)] == [0o700] * 3
    assert own_folder(tmp_path / "some" / "cache", "here") == folder


def test_a_folder_that_others_could_read_is_closed(tmp_path: Path) -> None:
    (tmp_path / "cache").mkdir(mode=0o755)
    assert mode(own_folder(tmp_path / "cache", "here").parent) == 0o700


def test_a_sticky_folder_like_tmp_is_fine(tmp_path: Path) -> None:
    (tmp_path / "tmp").mkdir()
    (tmp_path / "tmp").chmod(0o1777)
    assert own_folder(tmp_path / "tmp" / "cache", "here").is_dir()


def test_a_link_of_ours_is_followed(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to("elsewhere")
    folder = own_folder(tmp_path / "link" / "cache", "here")
    assert folder.resolve() == tmp_path.resolve() / "elsewhere" / "cache" / "here"


@pytest.mark.parametrize("depth", range(3))
def test_a_folder_that_others_can_write_to_is_not_used(tmp_path: Path, depth: int) -> None:
    folder = tmp_path / "above" / "cache" / "here"
    folder.mkdir(parents=True)
    wide_open = [folder, *folder.parents][depth]
    wide_open.chmod(0o777)
    with pytest.raises(Unfit, match=f"^others can write to {wide_open} \\(mode 0777\\)$"):
        own_folder(folder.parent, "here")
    assert mode(wide_open) == 0o777


@pytest.mark.parametrize("depth", range(2))
def test_our_own_folders_are_no_links(tmp_path: Path, depth: int) -> None:
    elsewhere = tmp_path / "elsewhere"
    (elsewhere / "here").mkdir(parents=True)
    (tmp_path / "cache").mkdir()
    link = (tmp_path / "link", tmp_path / "cache" / "here")[depth]
    link.symlink_to(elsewhere)
    with pytest.raises(Unfit, match=f"^{link} is a link, expected a folder$"):
        own_folder((tmp_path / "link", tmp_path / "cache")[depth], "here")


def test_a_path_that_leads_nowhere_is_not_used(tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(Unfit, match="leads through more than 40 links"):
        own_folder(tmp_path / "loop" / "cache", "here")
    (tmp_path / "file").touch()
    with pytest.raises(Unfit, match="file is not a folder"):
        own_folder(tmp_path / "file" / "cache", "here")


@needs_root
@pytest.mark.parametrize("depth", range(3))
def test_a_folder_of_another_user_is_not_used(tmp_path: Path, depth: int) -> None:
    folder = tmp_path / "above" / "cache" / "here"
    folder.mkdir(parents=True, mode=0o700)
    theirs = [folder, *folder.parents][depth]
    os.chown(theirs, NOBODY, NOBODY)
    with pytest.raises(Unfit, match=f"^{theirs} belongs to user "):
        own_folder(folder.parent, "here")


@needs_root
def test_a_link_of_another_user_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "link").symlink_to("elsewhere")
    os.lchown(tmp_path / "link", NOBODY, NOBODY)
    with pytest.raises(Unfit, match=f"^{tmp_path}/link belongs to user "):
        own_folder(tmp_path / "link" / "cache", "here")
    assert not list((tmp_path / "elsewhere").iterdir())


def force(**environment: str) -> subprocess.CompletedProcess[str]:
    """What a process prints that needs one kernel, with no folder for it but the given ones."""
    nowhere = {"NUMBA_CACHE_DIR": "/proc/nowhere", "XDG_CACHE_HOME": "", "TMPDIR": "/proc/nowhere"}
    return subprocess.run(
        [sys.executable, "-c", FORCE],
        env={**os.environ, **nowhere, **environment},
        capture_output=True,
        text=True,
        check=True,
    )


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder as the process leaves it where it has its cache in the temporary folder."""
    folder = tmp_path_factory.mktemp("filled")
    force(TMPDIR=str(folder))
    assert [path for path in folder.rglob("*") if path.is_file()]
    return folder


@needs_root
@pytest.mark.parametrize("variable", ["NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "TMPDIR"])
def test_files_that_another_user_has_put_are_not_run(filled: Path, tmp_path: Path, variable: str) -> None:
    """He knows our files' names, for they are the same for every user."""
    shared = tmp_path / "shared"
    shared.mkdir()
    shared.chmod(0o1777)
    theirs = shared / ("conveyor_sim-0" if variable == "TMPDIR" else "conveyor_sim")
    shutil.copytree(next(filled.iterdir()), theirs)
    trace = tmp_path / "trace"
    for path in [theirs, *theirs.rglob("*")]:
        if path.is_file():
            path.write_bytes(pickle.dumps(Intrusion(trace)))
        os.chown(path, NOBODY, NOBODY)
    given = {"NUMBA_CACHE_DIR": "/proc/nowhere"} if variable == "TMPDIR" else {"NUMBA_CACHE_DIR": ""}
    done = force(**{"TMPDIR": str(tmp_path), **given, variable: str(shared)})
    assert done.stdout == "-3.0\n"
    assert not trace.exists()
    assert f"{theirs} belongs to user " in done.stderr
    told = "kernels are not cached, so every start" if variable == "TMPDIR" else f"kernels are cached in {tmp_path}/"
    assert done.stderr.startswith(told)
    assert done.stderr.count("\n") == 1
    assert all(path.stat().st_uid == NOBODY for path in theirs.rglob("*"))


def test_a_folder_instead_of_the_one_asked_for_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    done = force(NUMBA_CACHE_DIR=str(tmp_path / "file"), TMPDIR=str(tmp_path))
    (folder,) = (path for path in (tmp_path / f"conveyor_sim-{os.geteuid()}").iterdir() if path.name != "sources")
    assert done.stderr == f"kernels are cached in {folder}, for {tmp_path}/file is not a folder\n"


def test_damage_in_every_file_is_compiled_away(filled: Path) -> None:
    files = list(filled.rglob("*.kernel"))
    for path in files:
        content = bytearray(path.read_bytes())
        content[len(content) // 2] ^= 1
        path.write_bytes(content)
    damaged = force(TMPDIR=str(filled))
    assert damaged.stdout == "-3.0\n"
    assert damaged.stderr.count(" cached kernel not used, for it is damaged; compiling it again\n") == len(files)
    again = force(TMPDIR=str(filled))
    assert again.stdout == "-3.0\n"
    assert "not used" not in again.stderr
