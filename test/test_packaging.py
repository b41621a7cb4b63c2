# SPDX-License-Identifier: Apache-2.0
"""Packaging: resources, versions and dependencies, both ways of installing, the set-up."""

import ast
import importlib.metadata
import importlib.util
import os
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import pytest
from facts import missing, stating

import conveyor_sim
from conveyor_sim.control.scan import ControlError
from conveyor_sim.control.st import StructuredText
from conveyor_sim.control.st.load import load
from conveyor_sim.errors import SceneError
from conveyor_sim.support.resources import config_dir, msg_defs_dir, scene_path

ROOT = Path(__file__).parent.parent
COLCON = Path(sys.executable).parent / "colcon"
SHIPPED = {"accumulation_table", "brewery", "paper_plant", "turntable", "two_bottles"}


def run(*command: object, cwd: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(part) for part in command], cwd=cwd, env={**os.environ, **environment}, capture_output=True, text=True
    )


def copy_project(to: Path, *names: str) -> None:
    for name in names:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, to / name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(ROOT / name, to / name)


def test_resources_of_a_checkout() -> None:
    assert {scene.stem for scene in config_dir().glob("*.yaml")} >= SHIPPED
    assert (msg_defs_dir() / "msg" / "Bottles.msg").is_file()


@pytest.mark.parametrize("name", ["two_bottles", "two_bottles.yaml", "config/two_bottles.yaml"])
def test_a_shipped_scene_is_found_by_name_from_anywhere(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert scene_path(name) == config_dir() / "two_bottles.yaml"


def test_a_file_where_the_user_stands_wins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("two_bottles.yaml").write_text("name: mine\n")
    assert scene_path("two_bottles.yaml") == Path("two_bottles.yaml")


def test_a_shipped_folder_of_programs_is_found_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("brewery/plc", "config/brewery/plc"):
        assert isinstance(load(name), StructuredText)
    Path("brewery/plc").mkdir(parents=True)  # where the user stands
    with pytest.raises(ControlError, match=stating("brewery/plc", "folder without a program")):
        load("brewery/plc")


@pytest.mark.parametrize("name", ["no_such_scene", "elsewhere/two_bottles.yaml"])
def test_an_unknown_scene_is_refused_with_the_names_there_are(name: str) -> None:
    with pytest.raises(
        SceneError, match=stating(name, "no such scene file", "accumulation_table", "brewery/hall", "two_bottles")
    ):
        scene_path(name)


def test_importing_the_package_is_cheap(tmp_path: Path) -> None:
    code = "import conveyor_sim, sys; print({'numpy', 'numba', 'pydantic'} & set(sys.modules))"
    assert run(sys.executable, "-c", code, cwd=tmp_path).stdout == "set()\n"


def test_the_package_exports_its_two_entry_points() -> None:
    from conveyor_sim.scene import load_scene
    from conveyor_sim.simulation import Simulation

    assert conveyor_sim.Simulation is Simulation
    assert conveyor_sim.load_scene is load_scene
    with pytest.raises(AttributeError, match="nothing_of_the_sort"):
        _ = conveyor_sim.nothing_of_the_sort


def test_versions_agree() -> None:
    stated = {ElementTree.parse(ROOT / file).findtext("version") for file in ("package.xml", "msg_defs/package.xml")}
    assert stated == {conveyor_sim.__version__} == {importlib.metadata.version("conveyor_sim")}
    assert f"## [{conveyor_sim.__version__}]" in (ROOT / "CHANGELOG.md").read_text()


def test_package_xml_names_every_ros_package_that_is_imported() -> None:
    declared = {element.text for element in ElementTree.parse(ROOT / "package.xml").iter("exec_depend")}
    imported = set()
    for source in [*(ROOT / "conveyor_sim").rglob("*.py"), *(ROOT / "launch").glob("*.py")]:
        for node in ast.walk(ast.parse(source.read_text())):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            imported |= {name.partition(".")[0] for name in names}
    ros = {name for name in imported if name.endswith(("_msgs", "_srvs", "_interfaces")) or name.startswith("launch")}
    assert ros | {"rclpy"} <= declared


def set_up_module() -> Any:
    spec = importlib.util.spec_from_file_location("set_up", ROOT / "tools" / "set_up.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_ros_finds_the_package_in_the_environment_of_make(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It uses the look-up of `ros2 pkg prefix`, `ros2 run` and `ros2 launch`, after a second set-up as well."""
    index = pytest.importorskip("ament_index_python", reason="needs ROS 2")
    module = set_up_module()
    distribution = importlib.metadata.distribution("conveyor_sim")
    installed = tmp_path / "lib" / "python3.11" / "site-packages" / "conveyor_sim-0.dist-info"
    installed.mkdir(parents=True)
    (installed / "entry_points.txt").write_text(distribution.read_text("entry_points.txt") or "")
    (tmp_path / "bin").symlink_to(Path(sys.executable).parent)
    environment = module.Environment("jazzy")
    environment.path = tmp_path
    for _ in range(2):
        environment.register()

    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    assert index.get_package_prefix("conveyor_sim") == str(tmp_path)
    share = Path(index.get_package_share_directory("conveyor_sim"))
    assert (share / "launch" / "line.launch.py").is_file()
    assert ElementTree.parse(share / "package.xml").findtext("name") == "conveyor_sim"
    executables = list((tmp_path / "lib" / "conveyor_sim").iterdir())
    assert {file.name for file in executables} == {"controller_node", "conveyor-sim", "sim_node"}
    assert all(os.access(file, os.X_OK) for file in executables)


def test_an_extra_brings_what_scenarios_run_with(tmp_path: Path) -> None:
    described = run(sys.executable, "setup.py", "-q", "egg_info", "--egg-base", tmp_path, cwd=ROOT)
    assert described.returncode == 0, described.stderr
    extras = (tmp_path / "conveyor_sim.egg-info" / "requires.txt").read_text().partition("[test]\n")[2]
    assert extras.startswith("pytest")


def test_colcon_lists_both_packages() -> None:
    listed = run(COLCON, "--log-base", "/dev/null", "list", "--base-paths", ".", "msg_defs", "--names-only", cwd=ROOT)
    assert sorted(listed.stdout.split()) == ["conveyor_msgs", "conveyor_sim"]


def test_a_workspace_has_both_packages_side_by_side(tmp_path: Path) -> None:
    folder = tmp_path / "my workspace"
    for _ in range(2):
        linked = run("tools/workspace.sh", folder, cwd=ROOT)
        assert linked.returncode == 0, linked.stderr
    listed = run(COLCON, "--log-base", "/dev/null", "list", cwd=folder).stdout.splitlines()
    assert {tuple(line.split("\t")) for line in listed} == {
        ("conveyor_msgs", "src/conveyor_msgs", "(ros.ament_cmake)"),
        ("conveyor_sim", "src/conveyor_sim", "(ros.ament_python)"),
    }
    assert (folder / "src" / "conveyor_msgs").resolve() == ROOT / "msg_defs"


@pytest.mark.parametrize(
    ("arguments", "facts"),
    [
        ((), ["0 arguments given", "expected one"]),
        (("",), ["expected one"]),
        (("build/workspace",), ["build/workspace", "lies in the checkout", "outside"]),
        (("{tmp}/taken",), ["conveyor_msgs exists already"]),
        (("{tmp}/file",), ["can't be made"]),
    ],
)
def test_a_workspace_that_cannot_be_is_refused(arguments: tuple[str, ...], facts: list[str], tmp_path: Path) -> None:
    (tmp_path / "taken" / "src" / "conveyor_msgs").mkdir(parents=True)
    (tmp_path / "file").touch()
    refused = run("tools/workspace.sh", *(one.replace("{tmp}", str(tmp_path)) for one in arguments), cwd=ROOT)
    assert refused.returncode == 1
    assert missing(refused.stderr.splitlines()[-1], ["workspace.sh", *facts]) == []
    assert not (ROOT / "build" / "workspace").exists()


def test_packages_name_their_authors_and_addresses() -> None:
    for file in ("package.xml", "msg_defs/package.xml"):
        package = ElementTree.parse(ROOT / file)
        assert {url.get("type") for url in package.iter("url")} == {"website", "repository"}
        assert package.findtext("author") == package.findtext("maintainer")


def test_colcon_install_has_what_ros_looks_for(tmp_path: Path) -> None:
    project = (
        "conveyor_sim",
        "config",
        "include",
        "launch",
        "msg_defs",
        "requirements",
        "resource",
        "README.md",
        "package.xml",
    )
    copy_project(tmp_path, *project, "setup.py", "setup.cfg", "pyproject.toml", "LICENSE")
    built = run(COLCON, "build", "--base-paths", ".", "--packages-select", "conveyor_sim", cwd=tmp_path)
    assert built.returncode == 0, built.stdout + built.stderr
    prefix = tmp_path / "install" / "conveyor_sim"
    assert {file.name for file in (prefix / "lib" / "conveyor_sim").iterdir()} == {
        "controller_node",
        "conveyor-sim",
        "sim_node",
    }
    assert (prefix / "share" / "conveyor_sim" / "launch" / "line.launch.py").is_file()
    assert (prefix / "share" / "ament_index" / "resource_index" / "packages" / "conveyor_sim").is_file()

    (packages,) = prefix.glob("lib/python3*/site-packages")
    page, files = Path("conveyor_sim", "page", "page"), {"index.html", "style.css", "main.js", "lib/uplot.js"}
    assert all((packages / page / file).is_file() for file in files | {"lib/uplot.LICENSE"})
    code = (
        "from conveyor_sim.support.resources import config_dir, msg_defs_dir;"
        "import conveyor_sim.scene, conveyor_sim.engine;"
        "print(config_dir(), msg_defs_dir())"
    )
    found = run(sys.executable, "-c", code, cwd=tmp_path / "install", PYTHONPATH=str(packages))
    share = prefix / "share" / "conveyor_sim"
    assert found.stdout.split() == [str(share / "config"), str(share / "msg_defs")], found.stderr
    assert {scene.stem for scene in (share / "config").glob("*.yaml")} >= SHIPPED
    code = (
        "from conveyor_sim.support.resources import scene_path; from conveyor_sim.scene import load_scene;"
        "from conveyor_sim.control.st.load import load;"
        "print(*(len(load_scene(scene_path(name), {'bottles': []}).machines) for name in ('brewery', 'brewery/hall')));"
        "load('brewery/plc')"
    )
    loaded = run(sys.executable, "-c", code, cwd=tmp_path / "install", PYTHONPATH=str(packages))
    assert loaded.stdout.split() == ["7", "70"], loaded.stderr


def test_launch_file_hands_the_node_parameters_that_it_has() -> None:
    launch = pytest.importorskip("launch.actions", reason="the launch packages come with an installed ROS 2 only")
    from conveyor_sim.ros.parameters import TABLE

    spec = importlib.util.spec_from_file_location("line_launch", ROOT / "launch" / "line.launch.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    *entities, opaque = module.generate_launch_description().entities
    arguments = {entity.name: entity for entity in entities if isinstance(entity, launch.DeclareLaunchArgument)}
    assert set(arguments) - {entry.name for entry in TABLE} == {"namespace", "params_file", "controller", "rviz"}
    assert all(argument.description for argument in arguments.values())
    node = {entry.name: (type(entry.default), str(entry.default).lower()) for entry in TABLE}
    for name, default, kind, _ in module.SIMULATION_ARGUMENTS:
        assert (kind, default) == node[name]

    def names(**given: str) -> list[str]:
        """Full names of the nodes that are started."""
        context = importlib.import_module("launch").LaunchContext()
        values = {name: "" for name, _, _, _ in module.SIMULATION_ARGUMENTS}
        values |= {name: default for name, default, _, _ in module.LAUNCH_ARGUMENTS}
        context.launch_configurations.update(values | given)
        nodes = [one for one in opaque.execute(context) if isinstance(one, launch.ExecuteProcess)]
        for one in nodes:
            one._perform_substitutions(context)  # launch does this when it starts a node
        return [one.node_name for one in nodes]

    assert names() == ["/conveyor_sim"]
    assert names(namespace="cell_1", controller="true") == ["/cell_1/conveyor_sim", "/cell_1/controller"]
    with pytest.raises(FileNotFoundError, match=stating("params_file", "'nowhere.yaml' given")):
        names(params_file="nowhere.yaml")


@pytest.fixture
def empty_machine(tmp_path: Path) -> Path:
    """A copy of the set-up, and a folder `bin` with the few commands it needs before it looks for Python."""
    copy_project(tmp_path, "tools", "requirements", "msg_defs", "setup.py", "setup.cfg")
    (tmp_path / "conveyor_sim").mkdir()
    copy_project(tmp_path, "conveyor_sim/__init__.py")
    (tmp_path / "bin").mkdir()
    for command in ("sh", "dirname"):
        (tmp_path / "bin" / command).symlink_to(shutil.which(command) or "")
    return tmp_path


def set_up(machine: Path, distro: str = "jazzy") -> subprocess.CompletedProcess[str]:
    return run("sh", "tools/set_up.sh", distro, cwd=machine, PATH=str(machine / "bin"), CC="", CXX="")


def base_python() -> str:
    return os.path.realpath(sys.executable)


def test_set_up_without_python_says_what_to_install(empty_machine: Path) -> None:
    result = set_up(empty_machine)
    assert result.returncode == 1
    assert result.stderr.startswith("conveyor_sim needs CPython 3.10, 3.11 or 3.12")
    assert result.stderr.count("\n") == 1


def test_set_up_without_compiler_says_what_to_install(empty_machine: Path) -> None:
    (empty_machine / "bin" / "python3").symlink_to(base_python())
    result = set_up(empty_machine)
    assert result.returncode == 1
    assert result.stderr.startswith("There is no C compiler (cc or gcc or clang) on PATH")
    assert result.stderr.count("\n") == 1
    assert not (empty_machine / ".venv").exists()


@pytest.mark.parametrize(
    "folder", ["a:b", "what's", 'a"b', "$HOME", "a`b", "a\\b", "a#1", "50%", "a;b", "a\tb", "a\nb"]
)
def test_set_up_in_a_folder_that_cannot_work_says_so_first(empty_machine: Path, folder: str) -> None:
    (empty_machine / "bin" / "python3").symlink_to(base_python())
    checkout = empty_machine / folder / "conveyor_sim"
    checkout.mkdir(parents=True)
    for name in ("tools", "requirements", "msg_defs", "conveyor_sim", "setup.py", "setup.cfg"):
        shutil.move(empty_machine / name, checkout / name)
    result = run("sh", "tools/set_up.sh", "jazzy", cwd=checkout, PATH=str(empty_machine / "bin"), CC="", CXX="")
    assert (result.returncode, result.stdout, result.stderr.count("\n")) == (1, "", 1)
    assert missing(result.stderr, ["path of the checkout", "expected", "without"]) == []
    assert not (checkout / ".venv").exists()


@pytest.mark.parametrize(
    "path", ["/tmp/x y/conveyor_sim", "/home/jörg/Fließband (neu)/sim", "/a/b+c=d@e,f&g!", "/" + "a" * 999]
)
def test_paths_that_work_are_not_refused(path: str) -> None:
    assert set_up_module().path_complaint(path) == ""


def test_paths_that_are_too_long_are_refused() -> None:
    assert "found a path of 1002 bytes" in set_up_module().path_complaint("/" + "ö" * 500 + "x")


@pytest.mark.parametrize("name", ["x y", "plain"])
def test_messages_are_built_where_no_path_has_a_space(name: str, tmp_path: Path) -> None:
    (tmp_path / name).mkdir()
    code = "import sys; sys.path.insert(0, 'tools'); import set_up; print(set_up.scratch_folder())"
    chosen = run(sys.executable, "-c", code, cwd=ROOT, TMPDIR=str(tmp_path / name)).stdout.strip()
    assert chosen == str(tmp_path / name) if name == "plain" else chosen in ("/tmp", "/var/tmp")


def test_set_up_for_an_unknown_distribution_names_the_known_ones(empty_machine: Path) -> None:
    (empty_machine / "bin" / "python3").symlink_to(base_python())
    (error,) = set_up(empty_machine, "humble").stderr.splitlines()
    assert missing(error, ["DISTRO=humble", "jazzy", "kilted"]) == []
