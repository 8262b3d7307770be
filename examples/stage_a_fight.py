"""Stage a fight: a user asks one fighter for a kick, and both bodies are simulated against each other.

    python examples/stage_a_fight.py

`simprep fight` writes the same to files, with pictures. The model is learned from 45 s of the built-in taekwondo stream; `fight_model()` gives the
one of 16 minutes of kickboxing.
"""

from dataclasses import replace

import simprep
from simprep.duel.fight.default_model import default_fight_model
from simprep.duel.fight.hits import judge
from simprep.duel.fight.posture import optimise_fight_posture
from simprep.duel.synthetic.presets import preset

SECONDS = 1.2  # a simulated second of two bodies costs about two of computing

model = default_fight_model(settings=replace(preset("taekwondo"), clips=1, clip_s=45.0))
made = simprep.begin_fight(model, "interactive", seed=2)
made.avatar.request("kick")
made.run(SECONDS)
fight = made.fight(SECONDS)
for answer in made.avatar.answers:
    print(f"asked: {answer.request}; answered at {answer.begins:.2f} s, by choice {answer.choices}")

better, _ = optimise_fight_posture(fight)
live = simprep.SimulationSettings(mpc=simprep.MPC_PRESETS["live"])
run = simprep.simulate(better.stream.players, "mpc", seed=0, settings=live)
print(f"simulated: {run.end} after {run.end_s:.2f} s, largest external force {run.assist.force_n:.0f} N")
for contact in judge(run.contacts, better):
    print(
        f"{contact.start_s:.2f} s  {' against '.join(contact.parts)}: {contact.verdict}, {contact.impulse_ns:.1f} N s"
    )
