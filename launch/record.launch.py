# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Record the four signals of a valve, simulated or real, in a bag that the identifier reads.

Then, after Ctrl-C::

    valve_sim identify recording --out fit
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution

SIGNALS = ('u', 'p1', 'p2', 'x')

ARGUMENTS = [
    DeclareLaunchArgument(
        'namespace',
        default_value='',
        description='Namespace of the topics u, p1, p2 and x; empty for none.',
    ),
    DeclareLaunchArgument(
        'bag',
        default_value='recording',
        description='Folder of the new bag; it must not exist yet.',
    ),
    DeclareLaunchArgument(
        'storage',
        default_value='mcap',
        choices=['mcap', 'sqlite3'],
        description='Storage of the bag.',
    ),
]


def generate_launch_description():
    topics = [PathJoinSubstitution(['/', LaunchConfiguration('namespace'), s]) for s in SIGNALS]
    command = ['ros2', 'bag', 'record']
    command += ['--storage', LaunchConfiguration('storage')]
    command += ['--output', LaunchConfiguration('bag')]
    # Jazzy takes topics by place as well as by option; Kilted by option only.
    command += ['--topics', *topics]
    return LaunchDescription([*ARGUMENTS, ExecuteProcess(cmd=command, output='screen')])
