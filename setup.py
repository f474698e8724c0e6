# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Package metadata; colcon reads it here, so pyproject.toml holds tool settings only."""

from glob import glob
from pathlib import Path

from setuptools import find_packages, setup

PACKAGE = 'valve_sim_ros'


def ros_wheels(rclpy, common, interfaces):
    """Return the wheels that stand for one ROS 2 distribution where none is installed."""
    return [
        f'ros-rclpy[fastrtps]=={rclpy}',
        f'ros-std-msgs=={common}',
        f'ros-std-srvs=={common}',
        f'ros-diagnostic-msgs=={common}',
        f'ros-rcl-interfaces=={interfaces}',
        f'ros-rosgraph-msgs=={interfaces}',
    ]


setup(
    name=PACKAGE,
    version='0.1.0',
    description=(
        'A pneumatic control valve for ROS 2: model, plant node and identification from bags'
    ),
    long_description=Path(__file__).with_name('CHANGELOG.rst').read_text(encoding='utf-8'),
    long_description_content_type='text/x-rst',
    author='The valve_sim_ros authors',
    author_email='maintainers@valve-sim-ros.example',
    maintainer='The valve_sim_ros authors',
    maintainer_email='maintainers@valve-sim-ros.example',
    license='Apache-2.0',
    keywords=['ROS', 'control valve', 'stiction', 'identification', 'simulation'],
    packages=find_packages(include=[PACKAGE, f'{PACKAGE}.*']),
    package_data={PACKAGE: ['py.typed', '**/*.j2', '**/*.html', '**/*.css', '**/*.yaml']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml', 'CHANGELOG.rst', 'LICENSE']),
        (f'share/{PACKAGE}/launch', sorted(glob('launch/*.launch.py'))),
        (f'share/{PACKAGE}/config', sorted(glob('config/*.*'))),
    ],
    zip_safe=False,
    python_requires='>=3.10',
    # Where Ubuntu 24.04 carries a library, its version is the bound; `make lower-bounds` runs
    # the tests on these.
    install_requires=[
        'numpy>=1.26',  # arrays
        'scipy>=1.11',  # global search and least squares
        'numba>=0.58',  # the compiled step
        'rosbags>=0.11.9',  # bags without a ROS installation
        'PyYAML>=6.0.1',  # ROS parameter files
        'click>=8.1',  # command line
        'tqdm>=4.66',  # progress
        'matplotlib>=3.6.3',  # pictures of a fit
        'jinja2>=3.1.2',  # reports
    ],
    extras_require={
        # Inside a ROS installation the distribution brings these; elsewhere choose one extra.
        'jazzy': ros_wheels(rclpy='7.1.6', common='5.3.6', interfaces='2.0.3'),
        'kilted': ros_wheels(rclpy='9.1.2', common='5.5.1', interfaces='2.3.0'),
        'test': [
            'pytest>=7.4',
            'pytest-timeout>=2.2',
            'hypothesis>=6.98',
        ],
    },
    entry_points={
        'console_scripts': [
            'valve_plant = valve_sim_ros.nodes.start:valve_plant',
            'valve_rack = valve_sim_ros.nodes.start:valve_rack',
            'valve_twin = valve_sim_ros.nodes.start:valve_twin',
            'pi_controller = valve_sim_ros.nodes.start:pi_controller',
            'valve_identifier = valve_sim_ros.nodes.start:valve_identifier',
            'signal_player = valve_sim_ros.nodes.start:signal_player',
            'valve_sim = valve_sim_ros.cli:main',
        ],
    },
)
