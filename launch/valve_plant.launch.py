# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
One valve: topic u (command) in; p1, p2 (pressures) and x (stem) out, per cent of span.

Start it under two namespaces for two valves::

    ros2 launch valve_sim_ros valve_plant.launch.py namespace:=valve_7
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

ARGUMENTS = [
    DeclareLaunchArgument(
        'namespace',
        default_value='',
        description='Namespace of the node and of its topics u, p1, p2 and x; empty for none.',
    ),
    DeclareLaunchArgument(
        'name',
        default_value='valve_plant',
        description='Name of the node.',
    ),
    DeclareLaunchArgument(
        'params_file',
        default_value=PathJoinSubstitution(
            [FindPackageShare('valve_sim_ros'), 'config', 'valve_plant.yaml']
        ),
        description='ROS parameter file of the valve, such as fitted.yaml from an identification.',
    ),
    DeclareLaunchArgument(
        'use_sim_time',
        default_value='false',
        choices=['true', 'false'],
        description='Step with the time on /clock instead of the wall clock.',
    ),
    DeclareLaunchArgument(
        'pacing',
        default_value='auto',
        choices=['auto', 'wall', 'sim_time', 'own_clock', 'lockstep'],
        description='What drives the samples, see doc/time.md; auto: /clock or the wall clock.',
    ),
    DeclareLaunchArgument(
        'command_timeout',
        default_value='0.0',
        description='Age of the command at which fail_action takes over [s]; 0: never.',
    ),
    DeclareLaunchArgument(
        'log_level',
        default_value='info',
        choices=['debug', 'info', 'warn', 'error', 'fatal'],
        description='Least severe message the node logs.',
    ),
]


def generate_launch_description():
    plant = Node(
        package='valve_sim_ros',
        executable='valve_plant',
        name=LaunchConfiguration('name'),
        namespace=LaunchConfiguration('namespace'),
        parameters=[
            LaunchConfiguration('params_file'),
            {
                'use_sim_time': ParameterValue(
                    LaunchConfiguration('use_sim_time'), value_type=bool
                ),
                'pacing': LaunchConfiguration('pacing'),
                'command_timeout': ParameterValue(
                    LaunchConfiguration('command_timeout'), value_type=float
                ),
            },
        ],
        arguments=['--ros-args', '--log-level', LaunchConfiguration('log_level')],
        output='screen',
    )
    return LaunchDescription([*ARGUMENTS, plant])
