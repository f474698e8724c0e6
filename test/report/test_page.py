# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pages stand alone, escape what they are given, and miss nothing silently."""

import base64
import re

from jinja2 import ChoiceLoader, DictLoader, UndefinedError
from matplotlib.figure import Figure
import pytest

from valve_sim_ros.model.files import write_text
from valve_sim_ros.report import page

PAGE = """
{% extends 'base.html' %}
{% import 'parts.html' as parts %}
{% block title %}{{ name }}{% endblock %}
{% block content %}
{{ parts.table(('model', 'eta'), [(name, 1.5 | number), ('<b>', none | number)], figures=(1,)) }}
{{ parts.picture(picture, 'a line') }}
{% endblock %}
"""


@pytest.fixture
def toy(monkeypatch):
    """Return `page.render` for a template of this test beside those of the package."""
    environment = page._environment()
    loader = ChoiceLoader([DictLoader({'toy.html': PAGE}), environment.loader])
    monkeypatch.setattr(environment, 'loader', loader)
    return lambda **values: page.render('toy.html', **values)


def test_page_stands_alone_and_is_escaped(toy):
    figure = Figure(figsize=(1, 1))
    figure.subplots().plot([0, 1])
    html = toy(name='a < b', picture=page.embed(figure))
    assert '<title>a &lt; b</title>' in html
    assert '<td class="key">&lt;b&gt;</td>' in html
    assert '<td class="figure">1.5</td>' in html
    assert 'max-width' in html
    assert '&#' not in re.search('<style>.*</style>', html, re.S).group(0)
    sources = re.findall(r'(?:src|href)="([^"]+)"', html)
    assert sources
    assert all(source.startswith('data:image/png;base64,') for source in sources)
    assert base64.b64decode(sources[0].split(',')[1]).startswith(b'\x89PNG')


def test_missing_value_is_an_error(toy):
    with pytest.raises(UndefinedError, match='picture'):
        toy(name='x')


def test_file_is_written_aside_first(tmp_path):
    write_text(tmp_path / 'a.html', 'η')
    assert (tmp_path / 'a.html').read_text(encoding='utf-8') == 'η'
    assert [path.name for path in tmp_path.iterdir()] == ['a.html']
