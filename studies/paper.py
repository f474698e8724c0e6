# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The paper's experiments and comparison again, on simulated valves: `make paper`.

Its data are not public, so the valve is the model itself with the values of eq. (12), and the same
with a chamber volume that grows with the travel, which the paper names as a likely deficiency.
Nothing is tuned: the inputs are those of `valve_sim experiment`, the noise is 0.2 %, seed 0.
"""

import argparse
from pathlib import Path

import numpy as np
from paper_figures import karnopp_figure, loop_figure, measured_figure
from paper_text import markdown, sections, TITLE
from tqdm import tqdm

from valve_sim_ros import Recording, simulate, ValveSpec
from valve_sim_ros.experiments.inputs import EXPERIMENTS
from valve_sim_ros.experiments.perform import perform
from valve_sim_ros.identification.compare import compare
from valve_sim_ros.identification.fitness import fitness
from valve_sim_ros.model.files import write_text
from valve_sim_ros.model.rivals import RIVALS
from valve_sim_ros.report.compare import overlay, signatures
from valve_sim_ros.report.page import embed, render
from valve_sim_ros.report.plots import save

NOISE = 0.2
COMPARED = ('step', 'impulse', 'cosine', 'closed-loop')
VOLUME = {'effects': ['chamber_volume'], 'chamber_volume.ratio': 1.0}
TRUTHS = {'eq. (12)': ValveSpec(), 'chamber volume': ValveSpec().changed(VOLUME)}


def recording_of(name, spec):
    """Return an experiment as recorded: u, p2 and x."""
    s = perform(EXPERIMENTS[name], spec, NOISE)
    return Recording(s.t, s.u, p2=s.p2, x=s.x)


def fixed_eta(recording):
    """Return eta of the model with the values of eq. (12), as the paper gives it."""
    return fitness(recording.x, simulate(recording.u, time=recording.time).x)


def karnopp_runs(recording):
    """Return x of Karnopp's model driven by p2, Table 1 as printed and corrected, as Fig. 7."""
    model = RIVALS['karnopp']
    return {
        name: model.drive(recording.p2, model.preset(name)) for name in ('table_1', 'corrected')
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--doc', type=Path, help='Markdown file to write too.')
    parser.add_argument('--out', type=Path, default=Path('out/paper'), help='Folder for the page.')
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    results, figures = {}, {}
    work = [(truth, name) for truth in TRUTHS for name in COMPARED]
    for truth, name in tqdm(work, disable=None):
        recording = recording_of(name, TRUTHS[truth])
        found = compare([recording], hold_out=False)
        results[truth, name] = (found, fixed_eta(recording))
        figures[f'{truth}: {EXPERIMENTS[name].title}'] = overlay(found)
        found.write(arguments.out / f'{truth} {name}')
        print(truth, name, *found.lines(), sep='\n', flush=True)
    clean = perform(EXPERIMENTS['step'])
    karnopp = karnopp_runs(clean)
    jumps = {name: int(np.sum(np.diff(x) > 5.0)) for name, x in karnopp.items()}
    steps = perform(EXPERIMENTS['multi-step'])
    slow = perform(EXPERIMENTS['signature'])
    figures |= {
        'Karnopp driven by p2, Fig. 7': karnopp_figure(clean, karnopp),
        'Steady p2 against u, Fig. 10': loop_figure(steps),
        'Slow signature of the valve': measured_figure(slow),
        'Signatures of the models fitted to the cosine, Fig. 8': signatures(
            results['eq. (12)', 'cosine'][0]
        ),
    }
    blocks = sections(results, karnopp, jumps, clean, steps)
    for number, figure in enumerate(figures.values()):
        save(figure, arguments.out / f'figure_{number + 1}.png')
    pictures = [(title, embed(figure)) for title, figure in figures.items()]
    html = render('paper.html', title=TITLE, blocks=blocks, pictures=pictures)
    write_text(arguments.out / 'paper.html', html)
    if arguments.doc:
        write_text(arguments.doc, markdown(blocks))
    print(markdown(blocks))


if __name__ == '__main__':
    main()
