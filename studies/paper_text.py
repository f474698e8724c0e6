# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the study of the paper says, as blocks for the page and for Markdown."""

import numpy as np

from valve_sim_ros.experiments.inputs import EXPERIMENTS
from valve_sim_ros.identification.comparison import percent
from valve_sim_ros.identification.fitness import fitness

TITLE = "The paper's comparison again"
PRINTED = {
    'step': (87.7564, 58.1071, (14.5920, 14.5920), 58.1071, (29.1840, 0.0)),
    'impulse': (95.1610, 64.8389, (39.5280, 8.7841), 64.8389, (48.3120, 30.7440)),
    'cosine': (76.2387, 49.9765, (24.3200, 21.2797), 52.6920, (45.6000, 1.8240)),
    'closed-loop': (79.6304, 56.9552, (25.9259, 17.7389), -22.6468, (25.0, 2.0)),
}
"""Sect. 3.4: eta of the proposed model at eq. (12); eta, f_s, f_d of He (f_d from K_1 = 1.99);
eta, S and J of Kano."""
DIFFERENCES = (
    "The paper's records are not public. Here the valve is the model itself, so at eq. (12) it is "
    'nearly exact, where the paper reaches 76 to 95 %. With the hidden chamber volume '
    '(ratio 1, the same for all experiments) it is not.',
    'Lengths, base of the impulse, frequencies, set points and start are reconstructed; '
    '`valve_sim experiment NAME` prints every assumption.',
    "He and Kano are fitted to each experiment anew, the paper's own model never: the values of "
    'eq. (12) hold throughout. The table has both: eq. (12) fixed, and base fitted.',
    'Physical rivals take over backlash and lags of the base fit here; the paper gives its '
    'Karnopp the measured p2, which the table on it repeats.',
)


def sections(results, karnopp, jumps, clean, steps):
    """Return blocks (heading, text lines, table head, rows)."""
    truths = list(dict.fromkeys(truth for truth, _ in results))
    blocks = [('What must differ', DIFFERENCES, (), ())]
    for truth in truths:
        rows = [_row(name, *found) for (valve, name), found in results.items() if valve == truth]
        blocks.append(
            (f'η [%], valve: {truth}; in brackets what the paper prints', (), HEAD, rows)
        )
    for truth in truths:
        done = [name for valve, name in results if valve == truth]
        names = [entry.name for entry in results[truth, 'step'][0].entries]
        rows = [
            (name, *(percent(results[truth, each][0][name].eta) for each in done))
            for name in names
        ]
        head = ('model, fitted', *done)
        blocks.append((f'All models fitted, η [%], valve: {truth}', (), head, rows))
    blocks.append(
        (
            'Karnopp driven by p2 (Fig. 7)',
            (),
            ('parameters', 'jumps of more than 5 % in a sample', 'last x [%]', 'η [%]'),
            [
                (name, str(jumps[name]), f'{x[-1]:.2f}', percent(fitness(clean.x, x)))
                for name, x in karnopp.items()
            ],
        )
    )
    checks = _checks(results, jumps, clean, steps)
    blocks.append(('What is reproduced', (), ('statement', 'here', 'reproduced'), checks))
    return blocks


HEAD = ('experiment', 'eq. (12) fixed', 'base fitted', 'He', 'f_s, f_d', 'Kano', 'S, J')


def _row(name, found, fixed):
    """Return one experiment: ours with the paper's in brackets."""
    proposed, he_eta, he, kano_eta, kano = PRINTED[name]
    ours_he, ours_kano = found['he'].parameters, found['kano'].parameters
    return (
        name,
        f'{fixed:.2f} ({proposed:.2f})',
        percent(found['base'].eta),
        f'{found["he"].eta:.2f} ({he_eta:.2f})',
        f'{ours_he["f_s"]:.2f}, {ours_he["f_d"]:.2f} ({he[0]:.2f}, {he[1]:.2f})',
        f'{found["kano"].eta:.2f} ({kano_eta:.2f})',
        f'{ours_kano["S"]:.2f}, {ours_kano["J"]:.2f} ({kano[0]:.2f}, {kano[1]:.2f})',
    )


def _checks(results, jumps, clean, steps):
    """Return statements of the paper, what was found, and whether that agrees."""
    rows = []
    for truth in dict.fromkeys(truth for truth, _ in results):
        step, impulse = results[truth, 'step'][0], results[truth, 'impulse'][0]
        f_s, eta = step['he'].parameters['f_s'], step['he'].eta
        rows += [
            _check(
                f'{truth}: He on the step, f_s within 3 % of 14.592',
                f'{f_s:.3f}',
                abs(f_s / 14.592 - 1.0) < 0.03,
            ),
            _check(
                f'{truth}: He on the step, η within 2 points of 58.1',
                f'{eta:.2f}',
                abs(eta - 58.1) < 2.0,
            ),
        ]
        for name, found in (('step', step), ('impulse', impulse)):
            apart = abs(found['he'].eta - found['kano'].eta)
            rows.append(
                _check(f'{truth}: Kano = He on the {name}', f'{apart:.2g} apart', apart < 1e-3)
            )
        rows += [_order(truth, n, *found) for (v, n), found in results.items() if v == truth]
    stem = int(np.sum(np.diff(clean.x) > 5.0))
    words = 'Karnopp with Table 1 jumps (more than 5 % in a sample), the stem moves smoothly'
    found = f'{jumps["table_1"]} jumps of Karnopp, {stem} of the stem'
    rows.append(_check(words, found, jumps['table_1'] >= 2 and stem == 0))
    ends = np.arange(2999, steps.t.size, 3000)
    half = ends.size // 2
    up, down = steps.p2[ends][1:half], steps.p2[ends][half + 1 : -1][::-1]
    width = float(np.median(down - up))
    rows.append(
        _check(
            'Steady p2 against u is a loop of width 2 f_d1 = 3.53 %',
            f'{width:.2f} %',
            abs(width - 3.5294) < 0.2,
        )
    )
    return rows


def _order(truth, name, found, fixed):
    """Compare the order of the paper's model, He and Kano."""
    proposed, he, _, kano, _ = PRINTED[name]
    ours = {'eq. (12)': fixed, 'He': found['he'].eta, 'Kano': found['kano'].eta}
    theirs = {'eq. (12)': proposed, 'He': he, 'Kano': kano}
    tied = abs(he - kano) < 1e-3
    orders = [
        [
            n if not (tied and n != 'eq. (12)') else 'He = Kano'
            for n in sorted(v, key=lambda k: -v[k])
        ]
        for v in (ours, theirs)
    ]
    return _check(
        f'{truth}: order on the {name}: {" > ".join(dict.fromkeys(orders[1]))}',
        ', '.join(f'{key} {value:.1f}' for key, value in ours.items()),
        orders[0] == orders[1],
    )


def _check(statement, found, agrees):
    return statement, found, 'yes' if agrees else 'no'


def markdown(blocks):
    """Return the blocks as Markdown."""
    lines = [
        f'# {TITLE}',
        '',
        f'Written by `make paper`; nothing is tuned. {NAMES}',
        '',
    ]
    for heading, text, head, rows in blocks:
        lines += [f'## {heading}', '', *(f'- {line}' for line in text)]
        if head:
            lines += ['| ' + ' | '.join(head) + ' |', '|' + '---|' * len(head)]
            lines += ['| ' + ' | '.join(row) + ' |' for row in rows]
        lines.append('')
    return '\n'.join(lines)


NAMES = 'Experiments: ' + ', '.join(EXPERIMENTS) + '.'
