# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
A closed loop: valve, PI controller with a programme of set points, and the valve's live twin.

The valve's watchdog guards the loop: without commands for `command_timeout` it is vented. A
process that dies is started again. Watch it with config/plotjuggler.xml or config/foxglove.json::

    ros2 launch valve_sim_ros loop.launch.py setpoints:='[40.0, 60.0, 30.0]'
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution, PythonExpression
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

ARGUMENTS = [
    DeclareLaunchArgument(
        'namespace',
        default_value='',
        description='Namespace of the loop and of its topics; empty for none.',
    ),
    DeclareLaunchArgument(
        'params_file',
        default_value=PathJoinSubstitution(
            [FindPackageShare('valve_sim_ros'), 'config', 'valve_plant.yaml']
        ),
        description='ROS parameter file of the valve, such as fitted.yaml from an identification.',
    ),
    DeclareLaunchArgument(
        'model_file',
        default_value=LaunchConfiguration('params_file'),
        description='ROS parameter file of the twin; by default that of the valve.',
    ),
    DeclareLaunchArgument(
        'setpoints',
        default_value='[40.0, 60.0, 30.0]',
        description='Set points [% of span] of x, one after the other; the last one stays.',
    ),
    DeclareLaunchArgument(
        'setpoint_hold',
        default_value='120.0',
        description='Time for which each set point holds [s].',
    ),
    DeclareLaunchArgument(
        'gain',
        default_value='0.2083',
        description='Gain of the controller [% of command per % of error].',
    ),
    DeclareLaunchArgument(
        'integral_time',
        default_value='15.0',
        description='Integral time of the controller [s].',
    ),
    DeclareLaunchArgument(
        'sample_time',
        default_value='0.2',
        description='Sampling period of valve, controller and twin [s].',
    ),
    DeclareLaunchArgument(
        'command_timeout',
        default_value='2.0',
        description='Age of the command at which the valve is vented [s]; 0: never.',
    ),
    DeclareLaunchArgument(
        'speed_factor',
        default_value='1.0',
        description='Valve seconds per wall second; other than 1.0, the valve publishes /clock.',
    ),
    DeclareLaunchArgument(
        'log_level',
        default_value='info',
        choices=['debug', 'info', 'warn', 'error', 'fatal'],
        description='Least severe message the nodes log.',
    ),
]


def number(name):
    return ParameterValue(LaunchConfiguration(name), value_type=float)


def node(executable, *parameters, **options):
    return Node(
        package='valve_sim_ros',
        executable=executable,
        namespace=LaunchConfiguration('namespace'),
        parameters=[*parameters, {'sample_time': number('sample_time')}],
        arguments=['--ros-args', '--log-level', LaunchConfiguration('log_level')],
        output='screen',
        respawn=True,
        respawn_delay=1.0,
        **options,
    )


def generate_launch_description():
    valve = {
        'pacing': PythonExpression(
            [
                "'wall' if float('",
                LaunchConfiguration('speed_factor'),
                "') == 1.0 else 'own_clock'",
            ]
        ),
        'speed_factor': number('speed_factor'),
        'publish_sample': True,
        'command_timeout': number('command_timeout'),
        'fail_action': 'vent',
    }
    controller = {
        'setpoints': ParameterValue(LaunchConfiguration('setpoints')),
        'setpoint_hold': number('setpoint_hold'),
        'gain': number('gain'),
        'integral_time': number('integral_time'),
    }
    return LaunchDescription(
        [
            *ARGUMENTS,
            node('valve_plant', LaunchConfiguration('params_file'), valve),
            node('pi_controller', controller),
            node(
                'valve_twin',
                LaunchConfiguration('model_file'),
                remappings=[('sample', 'valve_plant/sample')],
            ),
        ]
    )
