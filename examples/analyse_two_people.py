"""A recording of two people: cut into actions, labelled, and learned from.

    python examples/analyse_two_people.py                # 45 s of the built-in taekwondo stream
    python examples/analyse_two_people.py a.bvh b.bvh    # your recording, one file per person: cuts only

The built-in stream is synthetic, so the truth is known and stands in for a person who annotates a tenth of the actions. For a recording,
`simprep duel label` proposes what to annotate.
"""

import sys
from dataclasses import replace

import numpy as np

import simprep
from simprep.duel.analysis import AnalysisSettings
from simprep.duel.labels.labels import Label
from simprep.duel.model.evaluation import EvaluationSettings
from simprep.duel.synthetic.make import make_synthetic
from simprep.duel.synthetic.presets import preset

if len(sys.argv) > 2:
    stream = simprep.import_pair(sys.argv[1], sys.argv[2]).stream
    cuts = simprep.segment_stream(stream).cuts
    print(f"{stream.duration:.1f} s; A has {len(cuts.segments(0))} actions, B {len(cuts.segments(1))}")
    sys.exit()

made = make_synthetic(replace(preset("taekwondo"), clips=1, clip_s=45.0), seed=1)
quick = AnalysisSettings(annotated=0.2, evaluation=EvaluationSettings(splits=1, components=(1,), prior_counts=(10.0,)))
found = simprep.analyse(made.stream, np.random.default_rng(1), truth=made.truth, settings=quick)

actions = found.graph.actions
print(f"{made.stream.duration:.0f} s: {len(actions.of(0))} actions of A, {len(actions.of(1))} of B")
labels = found.tables["label_macro_f1"]
print(
    f"against the truth: cut F1 {found.tables['cut_f1']:.3f}; labels, macro F1: left punch {labels['left_punch']:.2f}, move {labels['move']:.2f}"
)

attacks = [number for number in actions.of(0) if Label.from_code(int(actions.label[number])).attacks]
print(f"A attacks {len(attacks)} times; the first: {Label.from_code(int(actions.label[attacks[0]]))}")
