# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The package agrees with itself: versions, dependencies, entry points, rules."""

import ast
from importlib import import_module
from importlib.util import find_spec
import os
from pathlib import Path
import re
import runpy
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

import pytest
import setuptools

import valve_sim_ros

ROOT = Path(__file__).resolve().parents[1]
HEADER = (
    '# Copyright 2026 The valve_sim_ros authors',
    '# SPDX-License-Identifier: Apache-2.0',
)
ROSDEP_KEYS = {
    'PyYAML': 'python3-yaml',
    'rosbags': 'python3-rosbags-pip',
    'ros-rclpy': 'rclpy',
    'ros-std-msgs': 'std_msgs',
    'ros-std-srvs': 'std_srvs',
    'ros-rcl-interfaces': 'rcl_interfaces',
    'ros-diagnostic-msgs': 'diagnostic_msgs',
    # only the tests and the demo publish /clock
    'ros-rosgraph-msgs': None,
    # come with rosbags
    'lz4': None,
    'backports.zstd': None,
}


def sources():
    skipped = re.compile(r'/(\.[^/]+|build|install|log|.*\.egg-info)/')
    return [p for p in sorted(ROOT.rglob('*.py')) if not skipped.search(f'/{p.relative_to(ROOT)}')]


@pytest.fixture(scope='module')
def metadata():
    """Return the keyword arguments setup.py hands to setuptools."""
    captured = {}
    original, folder = setuptools.setup, Path.cwd()
    try:
        setuptools.setup = lambda **arguments: captured.update(arguments)
        os.chdir(ROOT)
        runpy.run_path(str(ROOT / 'setup.py'))
    finally:
        setuptools.setup = original
        os.chdir(folder)
    return captured


@pytest.fixture(scope='module')
def manifest():
    return ElementTree.parse(ROOT / 'package.xml').getroot()


def test_one_version_everywhere(metadata, manifest):
    assert metadata['version'] == manifest.findtext('version') == valve_sim_ros.__version__
    changelog = (ROOT / 'CHANGELOG.rst').read_text(encoding='utf-8')
    assert re.search(r'^(\d+\.\d+\.\d+) \(', changelog, re.M).group(1) == metadata['version']


def test_one_name_maintainer_and_licence(metadata, manifest):
    maintainer = manifest.find('maintainer')
    assert metadata['name'] == manifest.findtext('name') == valve_sim_ros.__name__
    assert metadata['license'] == manifest.findtext('license') == 'Apache-2.0'
    assert metadata['maintainer'] == maintainer.text
    assert metadata['maintainer_email'] == maintainer.get('email')
    assert 'Apache License' in (ROOT / 'LICENSE').read_text(encoding='utf-8')
    assert manifest.get('format') == '3'
    assert manifest.findtext('export/build_type') == 'ament_python'


def test_entry_points_resolve(metadata):
    for line in metadata['entry_points']['console_scripts']:
        module, function = line.split('=')[1].strip().split(':')
        assert callable(getattr(import_module(module), function)), line


def test_data_files_exist_and_mark_the_package(metadata):
    files = dict(metadata['data_files'])
    assert files['share/ament_index/resource_index/packages'] == ['resource/valve_sim_ros']
    assert 'package.xml' in files['share/valve_sim_ros']
    for names in files.values():
        for name in names:
            assert (ROOT / name).is_file(), name


def test_every_package_of_the_tree_is_installed(metadata):
    folders = {p.parent for p in (ROOT / 'valve_sim_ros').rglob('*.py')}
    expected = {'.'.join(folder.relative_to(ROOT).parts) for folder in folders}
    assert expected == set(metadata['packages'])


def test_runtime_dependencies_have_a_lower_bound_and_a_rosdep_key(metadata, manifest):
    depends = {entry.text for entry in manifest.findall('exec_depend')}
    extras = metadata['extras_require']
    for line in [*metadata['install_requires'], *extras['jazzy'], *extras['kilted']]:
        name, operator = re.match(r'([\w.-]+)(?:\[\w+\])?(>=|==)\d', line).groups()
        assert operator == ('==' if name.startswith('ros-') else '>='), line
        key = ROSDEP_KEYS.get(name, f'python3-{name}')
        assert key is None or key in depends, line


def test_pins_are_complete_and_name_no_registry(metadata):
    for distro in ('jazzy', 'kilted'):
        text = (ROOT / 'requirements' / f'{distro}.txt').read_text(encoding='utf-8')
        assert '://' not in text
        pins = {re.split('[=[]', line)[0].lower() for line in text.splitlines() if '==' in line}
        for line in [*metadata['install_requires'], *metadata['extras_require'][distro]]:
            assert re.split(r'[=>[]', line)[0].lower().replace('.', '-') in pins, line


def test_lower_bounds_are_the_ones_tested(metadata):
    tested = (ROOT / 'requirements' / 'lower-bounds.in').read_text(encoding='utf-8')
    for line in metadata['install_requires']:
        name, bound = line.split(';')[0].split('>=')
        assert re.search(rf'^{name}=={re.escape(bound)}(\.\d+)*( |$)', tested, re.M), line


@pytest.mark.parametrize('path', sources(), ids=lambda p: str(p.relative_to(ROOT)))
def test_licence_header(path):
    assert tuple(path.read_text(encoding='utf-8').splitlines()[:2]) == HEADER


@pytest.mark.parametrize('path', sorted((ROOT / 'launch').glob('*.py')), ids=lambda p: p.name)
def test_launch_arguments_are_described(path):
    """Read the file as text: launch itself exists only inside a ROS installation."""
    calls = [
        node
        for node in ast.walk(ast.parse(path.read_text(encoding='utf-8')))
        if isinstance(node, ast.Call) and getattr(node.func, 'id', '') == 'DeclareLaunchArgument'
    ]
    assert calls
    for call in calls:
        assert {'default_value', 'description'} <= {word.arg for word in call.keywords}


def run(*command):
    """Run a rule checker of this environment over the repository."""
    done = subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


needs_ruff = pytest.mark.skipif(not find_spec('ruff'), reason='ruff is not installed')


@needs_ruff
@pytest.mark.parametrize('rule', [['check'], ['format', '--check']], ids=' '.join)
def test_style(rule):
    run(sys.executable, '-m', 'ruff', *rule, '--no-cache', '.')


def test_imports_go_one_way():
    pytest.importorskip('importlinter', reason='import-linter is not installed')
    program = 'from importlinter.cli import lint_imports_command as check; check()'
    run(sys.executable, '-c', program, '--no-cache')
