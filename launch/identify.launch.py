# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
The identifier: fits the valve to recordings at the start, then waits for ~/identify, ~/diagnose.

For example::

    ros2 launch valve_sim_ros identify.launch.py bag:=recording output_directory:=fit
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

ARGUMENTS = [
    DeclareLaunchArgument(
        'namespace',
        default_value='',
        description='Namespace of the node; empty for none.',
    ),
    DeclareLaunchArgument(
        'bag',
        default_value='recording',
        description='Bag or CSV file with u and at least one of p1, p2 and x.',
    ),
    DeclareLaunchArgument(
        'output_directory',
        default_value='fit',
        description='Folder for fitted.yaml and identify.json.',
    ),
    DeclareLaunchArgument(
        'seed',
        default_value='0',
        description='Seed of the global search: the same seed gives the same result.',
    ),
    DeclareLaunchArgument(
        'log_level',
        default_value='info',
        choices=['debug', 'info', 'warn', 'error', 'fatal'],
        description='Least severe message the node logs.',
    ),
]


def generate_launch_description():
    identifier = Node(
        package='valve_sim_ros',
        executable='valve_identifier',
        namespace=LaunchConfiguration('namespace'),
        parameters=[
            {
                'output_directory': LaunchConfiguration('output_directory'),
                'seed': ParameterValue(LaunchConfiguration('seed'), value_type=int),
            }
        ],
        arguments=[
            LaunchConfiguration('bag'),
            '--ros-args',
            '--log-level',
            LaunchConfiguration('log_level'),
        ],
        output='screen',
    )
    return LaunchDescription([*ARGUMENTS, identifier])
