# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The layouts and launch files speak of topics, commands and parameters that exist."""

import ast
import json
from pathlib import Path
import re
import xml.etree.ElementTree as ElementTree

import pytest

from valve_sim_ros.model.parameters import BASE
from valve_sim_ros.nodes import parameters, pi_controller, start
from valve_sim_ros.nodes.pi_controller import PiControllerNode
from valve_sim_ros.nodes.valve_twin import ValveTwin

ROOT = Path(__file__).parents[2]


def plotted(file):
    """Return the topics and fields that a layout plots, as /topic.data[1]."""
    text = (ROOT / 'config' / file).read_text(encoding='utf-8')
    if file.endswith('.xml'):
        curves = [curve.get('name') for curve in ElementTree.fromstring(text).iter('curve')]
        return {curve.replace('/data', '.data') for curve in curves}
    panels = json.loads(text)['configById'].values()
    return {path['value'] for panel in panels for path in panel.get('paths', ())}


@pytest.mark.ros
def test_layouts_show_what_is_published(bench):
    plant = bench.plant()
    published = {'/u': 1, '/pi_controller/setpoint': 1}
    for node in (plant, bench.add(PiControllerNode()), bench.add(ValveTwin())):
        for topic in node.publishers:
            published[topic.topic_name] = 1
    for name, message in bench.nodes[-1]._messages.items():
        published[f'/valve_twin/{name}'] = len(message.data)
    for file in ('plotjuggler.xml', 'foxglove.json'):
        shown = plotted(file)
        assert len(shown) == 14
        for path in shown:
            topic, index = re.fullmatch(r'(/[\w/]+)\.data(?:\[(\d)\])?', path).groups()
            assert int(index or 0) < published[topic], path


@pytest.mark.parametrize('path', sorted((ROOT / 'launch').glob('*.py')), ids=lambda p: p.name)
def test_launch_files_name_commands_and_parameters_that_exist(path):
    tree = ast.parse(path.read_text(encoding='utf-8'))
    words = [n.value for n in ast.walk(tree) if isinstance(n, ast.Constant)]
    declared = {
        call.args[0].value
        for call in ast.walk(tree)
        if isinstance(call, ast.Call) and getattr(call.func, 'id', '') == 'DeclareLaunchArgument'
    }
    used = {
        call.args[0].value
        for call in ast.walk(tree)
        if isinstance(call, ast.Call)
        and getattr(call.func, 'id', '') in ('LaunchConfiguration', 'number')
        and isinstance(call.args[0], ast.Constant)
    }
    assert used == declared
    commands = {word for word in words if word in vars(start)}
    assert commands or 'bag' in words
    known = {one.name for one in (*BASE, *parameters.FIXED, *parameters.LIVE)} | {
        one.name for one in (*pi_controller.FIXED, *pi_controller.LIVE)
    }
    known |= {'setpoints', 'use_sim_time', 'output_directory', 'seed'}
    given = {
        key.value for table in ast.walk(tree) if isinstance(table, ast.Dict) for key in table.keys
    }
    assert given <= known
