"""Learn from a recording of two fighters, and draw a new fight from the model.

    python examples/fight_without_physics.py

The recording is 45 s of the built-in taekwondo stream, which is synthetic. `fight_model()` without arguments
gives the model of 16 minutes of kickboxing, which takes a minute to make the first time.
"""

from dataclasses import replace

import numpy as np

from simprep.duel.fight.default_model import default_fight_model
from simprep.duel.fight.modes import begin_fight
from simprep.duel.labels.labels import Label
from simprep.duel.synthetic.presets import preset
from simprep.report.duel.label_text import full_text

SECONDS = 6.0

model = default_fight_model(settings=replace(preset("taekwondo"), clips=1, clip_s=45.0))
made = begin_fight(model, "automatic", seed=3)
made.run(SECONDS)
fight = made.fight(SECONDS)

for action in sorted(fight.actions, key=lambda action: action.start):
    text = full_text(Label.from_code(action.label))
    print(f"{action.start / fight.stream.fps:5.2f} s  {'AB'[action.player]}  {text}")

a, b = (motion.qpos[:, :2] for motion in fight.stream.players)
distance = np.linalg.norm(a - b, axis=1)
print(f"{len(fight.actions)} actions in {SECONDS:g} s; roots {distance.min():.2f} to {distance.max():.2f} m apart")
