# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One layout for all pages: a template and values in, one HTML file without links out."""

import base64
from functools import lru_cache
import io
import math
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from matplotlib.figure import Figure

RESOLUTION = 110
"""Dots per inch of embedded pictures."""


def render(template_name: str, **values: Any) -> str:
    """Return a page as HTML that needs nothing else: style and pictures are inside.

    Parameters
    ----------
    template_name : str
        File in `templates/`. It extends `base.html` (blocks `title`, `lead`, `content`) and may
        import the macros of `parts.html`.
    values
        What the template uses; figures are embedded first, see `embed`. Text is escaped.

    Raises
    ------
    jinja2.UndefinedError
        If the template uses a value that was not given.
    """
    return _environment().get_template(template_name).render(**values)


def embed(figure: Figure, resolution: float = RESOLUTION) -> str:
    """Return a figure as a data URI (PNG) for the `src` of an image."""
    stream = io.BytesIO()
    figure.savefig(stream, format='png', dpi=resolution)
    return 'data:image/png;base64,' + base64.b64encode(stream.getvalue()).decode('ascii')


def number(value: float | None, digits: int = 4) -> str:
    """Return a number with so many significant digits; a dash if there is none."""
    if value is None or not math.isfinite(value):
        return '–'
    text = f'{value:.{digits}g}'
    return text.replace('-', '\N{MINUS SIGN}')


@lru_cache(maxsize=1)
def _environment() -> Environment:
    """Return the templates of this package; a value that is missing is an error."""
    environment = Environment(
        loader=PackageLoader('valve_sim_ros.report'),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters['number'] = number
    environment.globals['style'] = Markup(
        Path(__file__).with_name('templates').joinpath('style.css').read_text(encoding='utf-8')
    )
    return environment
