"""How two bodies bounce off each other: depth, force and duration of the contacts of `simprep.scene`.

Example: python scripts/contact_study.py

Two balls of 2.8 and 5.8 kg, as heavy as a fist and a head behind a straight punch, meet without gravity at 5 m/s, the first
touch at 25 instants of a step. The contact is linear, so all but its duration and bounce is given per m/s, and forces per
kg of effective mass. Prints a table in Markdown.
"""

import argparse
import sys

import mujoco
import numpy as np

from simprep.scene import BONY_S, CONTACT_S, DAMPING_RATIO, DEFAULT_TIMESTEP_S, GLOVE_S

MASSES_KG, SPEED, PHASES = (2.8, 5.8), 5.0, 25
SOLIMP = "0.95 0.99 0.001"
"""That of the humanoid's geoms."""


def bounce(time_constant: float, damping_ratio: float, phase: float) -> tuple[float, float, float, float]:
    """Depth per speed [mm s/m], peak force per speed and effective mass [1/s], duration [ms], share of the speed returned."""
    ball = '<body pos="{x} 0 0"><freejoint/><geom type="sphere" size="0.1" mass="{m}"/></body>'
    apart = 0.2 + 1e-9 + phase * SPEED * DEFAULT_TIMESTEP_S
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{DEFAULT_TIMESTEP_S}" gravity="0 0 0" integrator="implicitfast"/><default>'
        f'<geom solref="{time_constant} {damping_ratio}" solimp="{SOLIMP}"/></default><worldbody>'
        f"{ball.format(x=0, m=MASSES_KG[0])}{ball.format(x=apart, m=MASSES_KG[1])}</worldbody></mujoco>"
    )
    data, wrench = mujoco.MjData(model), np.zeros(6)
    data.qvel[0] = SPEED
    depth, force, steps = 0.0, 0.0, 0
    for _ in range(100):
        mujoco.mj_step(model, data)
        if data.ncon:
            mujoco.mj_contactForce(model, data, 0, wrench)
            depth, force, steps = max(depth, -float(data.contact.dist[0])), max(force, float(wrench[0])), steps + 1
    mass = MASSES_KG[0] * MASSES_KG[1] / sum(MASSES_KG)
    returned = float(data.qvel[6] - data.qvel[0]) / SPEED
    return 1e3 * depth / SPEED, force / SPEED / mass, 1e3 * steps * DEFAULT_TIMESTEP_S, returned


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.parse_args()
    hand, head = BONY_S["hand"], BONY_S["head"]
    cases = {
        "as hard as the floor": (0.01, 1.0),
        "hand, forearm or foot on its like": (hand, DAMPING_RATIO),
        "... on head or shank": (0.5 * (hand + head), DAMPING_RATIO),
        "head or shank on its like": (head, DAMPING_RATIO),
        "hand, forearm or foot on trunk, thigh or upper arm": (0.5 * (hand + CONTACT_S), DAMPING_RATIO),
        "head or shank on these": (0.5 * (head + CONTACT_S), DAMPING_RATIO),
        "these on their like": (CONTACT_S, DAMPING_RATIO),
        "gloved hand on a forearm": (0.5 * (GLOVE_S + hand), DAMPING_RATIO),
        "gloved hand on head or shank": (0.5 * (GLOVE_S + head), DAMPING_RATIO),
        "gloved hand on trunk, thigh or upper arm": (0.5 * (GLOVE_S + CONTACT_S), DAMPING_RATIO),
    }
    print(
        "| contact | time constant ms, damping ratio | depth per m/s: mean, worst mm | peak force per m/s and kg N | lasts ms | returns |"
    )
    print("| --- | --- | --- | --- | --- | --- |")
    for name, (constant, ratio) in cases.items():
        found = np.array([bounce(constant, ratio, phase) for phase in (np.arange(PHASES) + 0.5) / PHASES])
        mean, worst = found.mean(axis=0), found.max(axis=0)
        print(
            f"| {name} | {1e3 * constant:.3g}, {ratio:g} | {mean[0]:.2f}, {worst[0]:.2f} | {mean[1]:.0f} | {mean[2]:.0f} |"
            f" {mean[3]:.2f} |"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
