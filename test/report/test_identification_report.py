# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page about an identification holds what the console says, and its pictures."""

import re

import numpy as np
import pytest

from valve_sim_ros import identify, Recording, simulate
from valve_sim_ros.report.identification import write_report


@pytest.fixture(scope='module')
def result():
    u = np.repeat([20.0, 70.0, 40.0, 90.0, 10.0], 60)
    clean = simulate(u)
    noise = 0.1 * np.random.default_rng(0).standard_normal(u.size)
    return identify(Recording(clean.t, u, x=clean.x + noise))


def test_page_stands_alone_and_says_what_the_console_says(result, tmp_path):
    write_report(result, tmp_path / 'report.html')
    html = (tmp_path / 'report.html').read_text(encoding='utf-8')
    assert len(re.findall('<img', html)) == 5
    sources = re.findall(r'(?:src|href)="([^"]+)"', html)
    assert all(source.startswith('data:image/png;base64,') for source in sources)
    shown = re.search('<pre>(.*)</pre>', html, re.S).group(1)
    for line in result.lines():
        assert line.replace('<', '&lt;').replace('>', '&gt;') in shown
    for name, estimate in result.estimates.items():
        assert f'<td class="key">{name}</td>' in html
        assert estimate.verdict in html
