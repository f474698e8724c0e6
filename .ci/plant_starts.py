# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Check that an installed valve_plant starts, publishes x, and leaves with code 0 on Ctrl-C."""

from pathlib import Path
import signal
import subprocess
import sys

import rclpy
from std_msgs.msg import Float64

PATIENCE = 60.0  # [s], with the first compilation on a busy machine


def main(executable: Path) -> int:
    """Return 0 if the plant at `executable` behaves, 1 with a sentence if not."""
    if not executable.is_file():
        print(f'{executable} was not installed')
        return 1
    plant = subprocess.Popen([str(executable)])
    rclpy.init()
    node = rclpy.create_node('plant_starts')
    try:
        heard = rclpy.task.Future()
        node.create_subscription(Float64, 'x', lambda _: heard.set_result(True), 10)
        rclpy.spin_until_future_complete(node, heard, timeout_sec=PATIENCE)
        plant.send_signal(signal.SIGINT)
        code = plant.wait(PATIENCE)
    finally:
        plant.kill()
        plant.wait()
        node.destroy_node()
        rclpy.try_shutdown()
    if not heard.done():
        print(f'{executable} published no x within {PATIENCE:g} s')
        return 1
    print(f'{executable.name}: started, published x, ended with code {code} on SIGINT')
    return 0 if code == 0 else 1


if __name__ == '__main__':
    sys.exit(main(Path(sys.argv[1])))
