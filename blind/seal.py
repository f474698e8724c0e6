# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Files written aside and renamed, and the digest that shows that no key was touched."""

import hashlib
import json
import os
from pathlib import Path
from typing import Any


def write_json(path: Path, content: Any) -> None:
    """Write a JSON file aside, then put it in place."""
    aside = path.with_name(f'.{path.name}.part')
    aside.write_text(json.dumps(content, indent=1) + '\n', encoding='utf-8')
    os.replace(aside, path)


def read_json(path: Path) -> Any:
    """Read a JSON file."""
    return json.loads(path.read_text(encoding='utf-8'))


def digest(folder: Path) -> str:
    """Return one digest of all files of a folder and their names."""
    found = hashlib.sha256()
    for path in sorted(folder.iterdir()):
        found.update(path.name.encode() + b'\0' + path.read_bytes())
    return found.hexdigest()
