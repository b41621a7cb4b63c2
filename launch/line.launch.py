"""ros2 launch conveyor_sim line.launch.py scene:=... : the simulation, and on request the controller, as ROS nodes."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, RegisterEventHandler
from launch.conditions import IfCondition
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration, OrSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

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


def generate_launch_description() -> LaunchDescription:
    given = {
        name: ParameterValue(LaunchConfiguration(name), value_type=kind) for name, _, kind, _ in SIMULATION_ARGUMENTS
    }
    # A controller in lockstep begins at tick 0, so the simulation waits for it there.
    given["start_paused"] = ParameterValue(
        OrSubstitution(LaunchConfiguration("start_paused"), LaunchConfiguration("controller")), value_type=bool
    )
    simulation = Node(
        package="conveyor_sim",
        executable="sim_node",
        name="conveyor_sim",
        output="screen",
        parameters=[given],
    )
    controller = Node(
        package="conveyor_sim",
        executable="controller_node",
        name="controller",
        output="screen",
        parameters=[{"controller": "conveyor_sim.control.level:table_level", "scan_ticks": 10}],
        condition=IfCondition(LaunchConfiguration("controller")),
    )
    # Without the simulation there is nothing left to launch for.
    end = RegisterEventHandler(
        OnProcessExit(target_action=simulation, on_exit=[EmitEvent(event=Shutdown(reason="the simulation ended"))])
    )
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=description)
        for name, default, _, description in SIMULATION_ARGUMENTS
    ]
    arguments.append(
        DeclareLaunchArgument(
            "controller",
            default_value="false",
            choices=["true", "false"],
            description="Also start the controller of the paper's plant, in lockstep.",
        )
    )
    return LaunchDescription([*arguments, simulation, controller, end])
