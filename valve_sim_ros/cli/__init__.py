# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The command `valve_sim`: everything that needs no ROS."""

import click

from .. import __version__
from .compare import compare_command
from .diagnose import diagnose_command
from .doctor import doctor_command
from .experiment import experiment_command
from .identify import identify_command
from .simulate import simulate_command


class Sentences(click.Group):
    """Shows an error of the package as one sentence and exit code 1, never as a traceback."""

    def invoke(self, context: click.Context) -> object:
        """Run a verb; every error type of the package is a ValueError."""
        try:
            return super().invoke(context)
        except (ValueError, OSError) as error:
            raise click.ClickException(str(error)) from None


@click.group(cls=Sentences)
@click.version_option(__version__, prog_name='valve_sim')
def main() -> None:
    """Simulate a pneumatic control valve, or fit one to a recording."""


main.add_command(compare_command)
main.add_command(diagnose_command)
main.add_command(doctor_command)
main.add_command(experiment_command)
main.add_command(identify_command)
main.add_command(simulate_command)
