# SPDX-License-Identifier: Apache-2.0
"""Build the environment of `make run`, `make test` and others: set_up.py DISTRO [test] [bench] [docs].

The result is a virtual environment with the ROS 2 wheels of that distribution, this package (editable) and
conveyor_msgs, built from msg_defs/, beside the interface packages that the wheels lack, built from
tools/message_build/definitions/. `set-up.json` in the environment holds a key of each stage's inputs; a stage whose key
is current is skipped. The file is removed while pip works, so an interrupted environment is rebuilt.
"""

import configparser
import fcntl
import hashlib
import json
import os
import re
import shutil
import string
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
EXTRAS = ("ads", "ethernet_ip", "foxglove", "mqtt", "s7", "scada", "st", "test-servers")
"""Whose lists in requirements/ those of the tools include."""
DISTROS = {"jazzy": ".venv", "kilted": ".venv-kilted"}
TOOLS = {"test": "the test tools", "bench": "what is compared with", "docs": "what the docs site is built with"}
SHARED = ("package.xml", "config", "launch", "msg_defs")  # of the checkout, where ROS looks for a package's share
MESSAGE_BUILD = ROOT / "tools" / "message_build"
STRIP = "strip_missing_includes.cmake"
DEFINITIONS = MESSAGE_BUILD / "definitions"
MISSING_PACKAGES = json.loads((MESSAGE_BUILD / "packages.json").read_text())
"""By name: interface packages of ROS that exist as no wheel, with the version that each distribution has."""
REFUSED = ":;\"'`$\\#%"
"""Characters that no path of the environment may contain. PATH and similar variables are split at colons, CMake's lists
at semicolons. The others have a meaning for shells, first lines of scripts, or file URLs.
"""
LONGEST = 1000
"""Bytes of the checkout's path: files in the environment have up to 300 more, and Linux takes 4096."""


class SetUpError(Exception):
    """One sentence for the user."""


class Environment:
    """The virtual environment of one distribution, and what it was made from."""

    def __init__(self, distro: str) -> None:
        self.distro = distro
        self.path = ROOT / DISTROS[distro]
        self.python = self.path / "bin" / "python"
        self.state_file = self.path / "set-up.json"
        self.state = self._read_state()
        self._packages = threading.Lock()
        """Held while installed packages change: pip fails if one disappears while it lists them."""

    def _read_state(self) -> dict:
        """Return the completed stages; none if the checkout was moved, or the base Python is gone."""
        try:
            state = json.loads(self.state_file.read_text())
        except (OSError, ValueError):
            return {}
        runs = (
            subprocess.run([self.python, "-I", "-S", "-c", ""], capture_output=True) if self.python.exists() else None
        )
        return state if state.get("path") == str(self.path) and runs and runs.returncode == 0 else {}

    def write_state(self, **changes: str) -> None:
        self.state.update(path=str(self.path), **changes)
        draft = self.state_file.with_suffix(".draft")
        draft.write_text(json.dumps(self.state, indent=1) + "\n")
        draft.replace(self.state_file)

    def forget(self, stage: str) -> None:
        """Before a stage changes the environment: until it is through, it is not what it was either."""
        if self.state.pop(stage, None):
            self.write_state()

    def create(self) -> None:
        say(f"Python {sys.version.split()[0]} environment in {self.path.name}/")
        command([sys.executable, "-I", "-m", "venv", "--clear", self.path], "creating the environment")
        # The pip that comes with Python 3.11 takes twice as long. If no newer one can be had, it will do.
        pip = [self.python, "-m", "pip", "--disable-pip-version-check", "install", "--no-compile", "pip>=25,<27"]
        subprocess.run(pip, stdin=subprocess.DEVNULL, capture_output=True)
        self.state = {}

    def pip_install(self, what: list, why: str) -> None:
        log = self.path / "pip.log"
        self.state_file.unlink(missing_ok=True)
        try:
            # Bytecode is left to the first import: most of what comes is never imported.
            options = ["--disable-pip-version-check", "install", "--prefer-binary", "--no-compile"]
            with self._packages:
                command([self.python, "-m", "pip", *options, *what], why, log)
        except SetUpError:
            # pip itself gave up, and undid what it had begun.
            if self.state:
                self.write_state()
            raise

    def has_interfaces(self, name: str) -> bool:
        """Return True if an interface package is installed by other means than `build_interfaces`."""
        return (self.path / "share" / name / "package.xml").exists() and not self._manifest(name).exists()

    def build_interfaces(self, name: str) -> None:
        """Build an interface package and install it into the environment's prefix, so that no path has to be set."""
        log = self.path / f"{name}.log"
        log.unlink(missing_ok=True)
        # ROS's message generators can't handle spaces in paths, so all paths are links in a scratch folder.
        with tempfile.TemporaryDirectory(prefix=f"{name}_", dir=scratch_folder()) as folder:
            scratch = Path(folder)
            (scratch / "env").symlink_to(self.path)
            (scratch / "tools").symlink_to(MESSAGE_BUILD)
            if name in MISSING_PACKAGES:
                self._write_source(name, scratch / "source")
            else:
                (scratch / "source").symlink_to(ROOT / "msg_defs")
            self._build_in(scratch, name, log)
            with self._packages:
                self._install(scratch, name, log)

    def _install(self, scratch: Path, name: str, log: Path) -> None:
        """Install a built package in place of an earlier build of it."""
        installed = self._manifest(name)
        if installed.exists():
            for file in installed.read_text().splitlines():
                (self.path / file).unlink(missing_ok=True)
        cmake = scratch / "env" / "bin" / "cmake"
        command([cmake, "--install", scratch / "build"], f"installing {name}", log)
        manifest = (scratch / "build" / "install_manifest.txt").read_text().splitlines()
        installed.write_text("\n".join(file.removeprefix(f"{scratch}/env/") for file in manifest) + "\n")

    def _manifest(self, name: str) -> Path:
        """Path of the list of files that `build_interfaces` installed."""
        return self.path / f"{name}.txt"

    def _write_source(self, name: str, folder: Path) -> None:
        """Write the source of a package of `MISSING_PACKAGES`, which has only definitions in the checkout."""
        folder.mkdir()
        for kind in (DEFINITIONS / name).iterdir():
            (folder / kind.name).symlink_to(kind)
        (folder / "CMakeLists.txt").symlink_to(MESSAGE_BUILD / "CMakeLists.txt")
        package = MISSING_PACKAGES[name]
        values = {
            "name": name,
            "version": package["version"][self.distro],
            "license": package["license"],
            "source": package["source"],
            "depends": "\n".join(f"  <depend>{other}</depend>" for other in package["depends"]),
        }
        template = string.Template((MESSAGE_BUILD / "package.xml.in").read_text())
        (folder / "package.xml").write_text(template.substitute(values))

    def _build_in(self, scratch: Path, name: str, log: Path) -> None:
        env_path, build = scratch / "env", scratch / "build"
        # CMake looks for packages beside every bin/ on PATH: a sourced ROS must not be among them.
        path = [p for p in os.environ["PATH"].split(":") if not (Path(p).parent / "share" / "ament_index").is_dir()]
        parsed = build / "parsed"
        parsed.mkdir(parents=True)
        env = {**os.environ, "AMENT_PREFIX_PATH": str(env_path), "PATH": ":".join([f"{env_path}/bin", *path])}
        env |= {"PYTHONPATH": str(scratch / "tools"), "PARSED_INTERFACES": str(parsed)}
        options = {
            "CMAKE_BUILD_TYPE": "Release",
            "CMAKE_PREFIX_PATH": env_path,
            "CMAKE_INSTALL_PREFIX": env_path,
            "CMAKE_PROJECT_INCLUDE": scratch / "tools" / STRIP,
            "Python3_EXECUTABLE": env_path / "bin" / "python",
            "BUILD_TESTING": "OFF",
        }
        if name in MISSING_PACKAGES:
            options |= {"PACKAGE": name, "DEPENDS": ";".join(MISSING_PACKAGES[name]["depends"])}
        cmake = env_path / "bin" / "cmake"
        defines = [f"-D{option}={value}" for option, value in options.items()]
        what = f"building {name}"
        command([cmake, "-G", "Ninja", "-S", scratch / "source", "-B", build, *defines], what, log, env)
        command([cmake, "--build", build], what, log, env)

    def register(self) -> None:
        """Lets ROS find the package by name (`ros2 pkg prefix`, `ros2 run`, `ros2 launch`): pip, editable, leaves out
        share/, and puts executables into bin/ only.
        """
        index = self.path / "share" / "ament_index" / "resource_index" / "packages"
        share, executables = self.path / "share" / "conveyor_sim", self.path / "lib" / "conveyor_sim"
        for folder in (share, executables):
            shutil.rmtree(folder, ignore_errors=True)
        for folder in (index, share, executables):
            folder.mkdir(parents=True, exist_ok=True)
        for name in SHARED:
            (share / name).symlink_to(ROOT / name)
        scripts = configparser.ConfigParser()
        scripts.optionxform = str
        scripts.read(self.path.glob("lib/python3*/site-packages/conveyor_sim-*.dist-info/entry_points.txt"))
        for name in scripts["console_scripts"]:
            (executables / name).symlink_to(self.path / "bin" / name)
        (index / "conveyor_sim").touch()


def say(text: str) -> None:
    print(f"[set-up] {text}", flush=True)


def command(arguments: list, what: str, log: Path | None = None, env: dict | None = None) -> None:
    """Run a command with its output in the log. Raise SetUpError, after the end of the output, if it fails."""
    done = subprocess.run(
        [str(argument) for argument in arguments],
        cwd=ROOT,
        env=env,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
    )
    if log:
        with log.open("a") as file:
            file.write(done.stdout)
    if done.returncode:
        print("\n".join(done.stdout.splitlines()[-25:]), file=sys.stderr)
        where = f" (all of its output: {log.relative_to(ROOT)})" if log else ""
        raise SetUpError(f"Set-up failed while {what}{where}.")


def key(*parts: Path | str) -> str:
    """Return a digest of files (by content) and strings."""
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part.encode() if isinstance(part, str) else part.name.encode() + b"\0" + part.read_bytes())
        digest.update(b"\0")
    return digest.hexdigest()


def path_complaint(path: str) -> str:
    """Return why an environment in a folder can't work, in one sentence; "" if it can."""
    odd = sorted({char for char in path if char in REFUSED or not char.isprintable()})
    if odd:
        shown = " and ".join("a character that can't be printed" if not c.isprintable() else repr(c) for c in odd)
        return f"{path!r}: found {shown} in the path of the checkout, expected a folder without: move it and try again."
    if (size := len(os.fsencode(path))) > LONGEST:
        return f"{path}: found a path of {size} bytes, expected a folder of at most {LONGEST}: move it and try again."
    return ""


def scratch_folder() -> str:
    """Return a temporary folder in whose path ROS's message generators find nothing odd. Raise SetUpError."""
    for folder in (tempfile.gettempdir(), "/tmp", "/var/tmp"):
        if re.fullmatch(r"[\w./+-]+", folder, re.ASCII) and os.access(folder, os.W_OK | os.X_OK):
            return folder
    raise SetUpError(
        f"{tempfile.gettempdir()!r}: found no temporary folder with only letters, digits and ./_+- in its path, needed "
        "to build the messages; expected TMPDIR to name one."
    )


def check_compiler() -> None:
    for language, variable, names in (("C", "CC", "cc gcc clang"), ("C++", "CXX", "c++ g++ clang++")):
        candidates = [os.environ[variable].split()[0]] if os.environ.get(variable, "").strip() else names.split()
        if not any(shutil.which(name) for name in candidates):
            raise SetUpError(
                f"There is no {language} compiler ({' or '.join(candidates)}) on PATH, which building the messages "
                "needs: install one (Debian, Ubuntu: apt install build-essential; Fedora: dnf install gcc-c++)."
            )


def set_up(distro: str, tools: list[str]) -> None:
    environment = Environment(distro)
    requirements = ROOT / "requirements"
    build = (requirements / f"ros-{distro}.txt", requirements / "build-messages.txt")
    lists = ("plot", "accuracy", "pytest")
    described = (*(f"requirements/{name}.txt" for name in lists), "setup.py", "setup.cfg", "conveyor_sim/__init__.py")
    ros = key(*build, requirements / "run.txt")
    packages = key(ros, *(ROOT / name for name in described))
    needed = {"ros": ros, "packages": packages, "index": key(packages, Path(__file__))}
    interfaces = {"conveyor_msgs": ROOT / "msg_defs", **{name: DEFINITIONS / name for name in MISSING_PACKAGES}}
    for name, folder in interfaces.items():
        files = (*MESSAGE_BUILD.glob("*.*"), *(path for path in folder.rglob("*") if path.is_file()))
        needed[name] = key(*build, *sorted(files))
    for tool in tools:
        needed[tool] = key(requirements / f"{tool}.txt", *(requirements / f"{name}.txt" for name in EXTRAS))
    if all(environment.state.get(stage) == wanted for stage, wanted in needed.items()):
        return

    start = time.monotonic()
    if complaint := path_complaint(str(ROOT)):
        raise SetUpError(complaint)
    scratch_folder()
    check_compiler()
    if not environment.state:
        environment.create()

    def missing(stage: str) -> bool:
        return environment.state.get(stage) != needed[stage]

    if missing("ros"):
        say(f"ROS 2 {distro.capitalize()} and what the simulation runs with: about 1 GB on disk, a minute or two ...")
        # Together: numba allows fewer versions of NumPy than ROS does.
        lists_of_both = ["-r", requirements / f"ros-{distro}.txt", "-r", requirements / "run.txt"]
        environment.pip_install(lists_of_both, "installing ROS 2 and Python packages")
        environment.write_state(ros=ros)
    # The compiler and pip wait for different things.
    with ThreadPoolExecutor(1) as beside:
        built = {}
        for name, folder in interfaces.items():
            if missing(name):
                environment.forget(name)
                if not environment.has_interfaces(name):
                    say(f"{name} from {folder.relative_to(ROOT)}/: about a minute ...")
                    built[name] = beside.submit(environment.build_interfaces, name)
        if missing("packages"):
            say("this package, and what it draws and tests with ...")
            environment.pip_install(["-e", ".[plot,accuracy,test]"], "installing this package")
            environment.write_state(packages=packages)
        if missing("index"):
            environment.forget("index")
            environment.register()
            environment.write_state(index=needed["index"])
        for tool in filter(missing, tools):
            say(f"{TOOLS[tool]} ...")
            environment.pip_install(["-r", requirements / f"{tool}.txt"], f"installing {TOOLS[tool]}")
            environment.write_state(**{tool: needed[tool]})
        for name in filter(missing, interfaces):
            if name in built:
                built[name].result()
            environment.write_state(**{name: needed[name]})
    say(f"done in {time.monotonic() - start:.0f} s")


def main() -> int:
    distro, tools = sys.argv[1], sys.argv[2:]
    if distro not in DISTROS:
        print(f"DISTRO={distro}: expected {' or '.join(DISTROS)}.", file=sys.stderr)
        return 1
    # One at a time: two makes started together would tread on each other.
    lock = os.open(ROOT, os.O_RDONLY)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX)
        set_up(distro, tools)
    except SetUpError as error:
        print(error, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("Set-up interrupted; it starts afresh the next time.", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
