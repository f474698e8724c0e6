# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Text files that are whole or not there."""

import os
from pathlib import Path


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a file, aside first and then renamed into place; an existing one is replaced."""
    path = Path(path)
    aside = path.with_name(f'.{path.name}.part')
    aside.write_text(text, encoding='utf-8')
    os.replace(aside, path)
