# SPDX-License-Identifier: Apache-2.0
"""ros2 launch conveyor_sim line.launch.py scene:=... : the simulation as a ROS node; controller and RViz on request."""

from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, OpaqueFunction, RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

SIMULATION_ARGUMENTS = (
    ("scene", "paper_plant", str, "Scene file, or the name of a shipped scene."),
    ("set", "", str, "Parameters of the scene: NAME=VALUE, several with semicolons between them."),
    ("variant", "", str, "Variant of the scene; empty text: as its file says."),
    ("format", "", str, "Format of the scene; empty text: as its file says."),
    ("duration", "0.0", float, "Simulated seconds after which the run ends; 0: as the scene says."),
    ("real_time_factor", "1.0", float, "Simulated seconds per wall second; 0: as fast as possible."),
    ("start_paused", "false", bool, "Wait at tick 0 for a service call; with controller:=true it waits anyway."),
    ("record", "", str, "Folder of the recording, new or empty; empty text: none."),
    ("threads", "0", int, "Threads to step with; 0: as many as prove fastest."),
    ("frame_id", "world", str, "Frame of all positions."),
)
"""Name, default of the node, type and description of the parameters that are arguments."""

LAUNCH_ARGUMENTS = (
    ("namespace", "", None, "Namespace of all nodes."),
    ("params_file", "", None, "Parameter file of all nodes; arguments that are given take precedence over it."),
    ("controller", "false", ["true", "false"], "Also start the controller of the paper's plant, in lockstep."),
    ("rviz", "false", ["true", "false"], "Also start RViz2 on the line."),
)
"""Name, default, choices and description of the other arguments."""

DRAWN = ("plant", "markers", "poses")
"""Topics of config/viewers/line.rviz."""


def generate_launch_description() -> LaunchDescription:
    arguments = [
        DeclareLaunchArgument(name, default_value=default, choices=choices, description=description)
        for name, default, choices, description in LAUNCH_ARGUMENTS
    ]
    # Empty by default: only arguments that are given take precedence over the parameter file.
    arguments += [
        DeclareLaunchArgument(
            name,
            default_value="",
            description=f"{description} Not given: as params_file says, or {default or 'empty'}.",
        )
        for name, default, _, description in SIMULATION_ARGUMENTS
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=nodes)])


def nodes(context: LaunchContext) -> list:
    """Return the nodes, which depend on the arguments. Raise FileNotFoundError without the parameter file."""
    given = {
        name: text for name, _, _, _ in SIMULATION_ARGUMENTS if (text := LaunchConfiguration(name).perform(context))
    }
    kinds = {name: kind for name, _, kind, _ in SIMULATION_ARGUMENTS}
    parameters = {name: ParameterValue(LaunchConfiguration(name), value_type=kinds[name]) for name in given}
    namespace, file, controller, rviz = (
        LaunchConfiguration(name).perform(context) for name, _, _, _ in LAUNCH_ARGUMENTS
    )
    if file and not Path(file).is_file():
        raise FileNotFoundError(f"params_file: {file!r} given, expected a parameter file")
    files = [file] if file else []
    if controller == "true":
        parameters["start_paused"] = True  # the controller begins at tick 0, so the simulation waits for it there
    common = {"namespace": namespace, "output": "screen"}
    simulation = Node(
        package="conveyor_sim",
        executable="sim_node",
        name="conveyor_sim",
        parameters=[*files, parameters],
        **common,
    )
    started = [simulation]
    if controller == "true":
        paper_plant = {"controller": "conveyor_sim.control.level:table_level", "scan_ticks": 10}
        started.append(
            Node(
                package="conveyor_sim",
                executable="controller_node",
                name="controller",
                parameters=[paper_plant, *files],
                **common,
            )
        )
    if rviz == "true":
        config = Path(FindPackageShare("conveyor_sim").perform(context), "config", "viewers", "line.rviz")
        started.append(
            Node(
                package="rviz2",
                executable="rviz2",
                name="rviz2",
                arguments=["-d", str(config), "-f", given.get("frame_id", "world")],
                parameters=[{"use_sim_time": True}],
                remappings=[(f"/{topic}", topic) for topic in DRAWN],  # into the namespace
                **common,
            )
        )
    # Without the simulation there is nothing left to launch for.
    end = RegisterEventHandler(
        OnProcessExit(target_action=simulation, on_exit=[EmitEvent(event=Shutdown(reason="the simulation ended"))])
    )
    return [*started, end]
