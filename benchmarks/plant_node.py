# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Share of a core that one valve costs at 1 kHz, and seconds from start to first sample."""

import os
import subprocess
import sys
import time

import rclpy
from std_msgs.msg import Float64

SECONDS = 8.0


def main():
    rclpy.init()
    node = rclpy.create_node('watcher')
    heard = []
    node.create_subscription(Float64, 'x', lambda message: heard.append(message.data), 1000)
    environment = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    start = time.monotonic()
    command = [sys.executable, '-m', 'valve_sim_ros.nodes.valve_plant', '--ros-args', '-p']
    plant = subprocess.Popen([*command, 'sample_time:=0.001'], env=environment)
    try:
        while not heard and time.monotonic() < start + 30.0:
            rclpy.spin_once(node, timeout_sec=0.05)
        print(f'first sample heard {time.monotonic() - start:.2f} s after the start')
        node.destroy_node()
        time.sleep(10.0)  # machine code is there, discovery is over
        before = cpu_seconds(plant.pid)
        time.sleep(SECONDS)
        share = (cpu_seconds(plant.pid) - before) / SECONDS
        print(f'one valve at sample_time 0.001 s: {100.0 * share:.1f} % of a core')
    finally:
        plant.terminate()
        plant.wait(10.0)
        rclpy.try_shutdown()


def cpu_seconds(pid):
    with open(f'/proc/{pid}/stat') as file:
        fields = file.read().rsplit(')', 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


if __name__ == '__main__':
    main()
