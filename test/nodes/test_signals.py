# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A signal at any moment ends every command with code 0 and without a traceback."""

import os
from pathlib import Path
import random
import signal
import subprocess
import sys
import time

import pytest

pytestmark = [pytest.mark.ros, pytest.mark.skipif(sys.platform != 'linux', reason='reads /proc')]


def start(command, *arguments):
    program = f'from valve_sim_ros.nodes.start import {command}; {command}()'
    return subprocess.Popen(
        [sys.executable, '-c', program, *arguments],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env={k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'},
    )


def catches_sigterm(process):
    """Tell whether the command, not just the interpreter, is in charge of signals."""
    status = Path(f'/proc/{process.pid}/status').read_text(encoding='ascii')
    caught = int(status.split('SigCgt:')[1].split()[0], 16)
    return bool(caught >> (signal.SIGTERM - 1) & 1)


@pytest.mark.parametrize(
    ('command', 'arguments'),
    [
        ('valve_plant', ['--ros-args', '-p', 'sample_time:=0.001']),
        ('valve_rack', ['3', '--ros-args', '-p', 'sample_time:=0.01']),
        ('pi_controller', ['--ros-args', '-p', 'lockstep:=true']),
        ('valve_twin', []),
        ('valve_identifier', []),
    ],
)
def test_signal_at_any_moment(command, arguments):
    random.seed(command)
    for number in (signal.SIGINT, signal.SIGTERM) * 2:
        process = start(command, *arguments)
        try:
            while not catches_sigterm(process):
                assert process.poll() is None
                time.sleep(0.002)
            time.sleep(random.uniform(0.0, 1.5))
            process.send_signal(number)
            _, errors = process.communicate(timeout=20)
        finally:
            process.kill()
        assert process.returncode == 0, errors
        # a busy machine may have made it say that periods were missed
        assert not any(word in errors for word in ('Traceback', 'FATAL', 'ERROR', 'terminate'))
