"""How fast simprep is on this machine. Run it alone: other work on the cores changes the numbers several times over.

Example: python scripts/bench.py --json

Prints `import_fps` (a BVH file to a cleaned motion), `fk_fps` (forward kinematics), `preparation_fps` (blending,
inverse kinematics and posture optimisation, one core), `runtime_fps` and `runtime_plain_fps` (the run-time controller, policy
included, with and without posture optimisation, one core; 60 per character), `sim_steps_per_s_1` and `_2` (simulation steps of the standing
humanoid on one and two threads), `fight_fps` (two fighters' kinematic synthesis: choice, placement, stitching, inverse
kinematics; frames of the fight per second of processor time of one core), `analysis_s` (processor time to analyse the built-in
kickboxing stream, 16 minutes, as `simprep duel analyse` does by default, without its figures), `mpc_s_per_s`,
`live_s_per_s` and `pair_s_per_s` (computing time per second of motion: presets `default` and `live`, and two bodies planned jointly),
`feedback_s_per_s` (the same of a fight that is simulated while it is drawn, drawing and posture optimisation included),
`mpc_overhead_share` and `planner_overhead_share` (share of it spent outside MuJoCo, of all and of the planner) and `peak_rss_mb`.

`--import-bvh-minutes 10` measures one thing only: a synthetic BVH file of so many minutes at 120 Hz is written and imported in a process
of its own with one thread. It prints `frames`, `import_fps` (by the processor time of the first and only call) and `peak_rss_mb`.

Seconds say little of another machine. So all of it is also stated in yardsticks: the time that 100 000 steps of
`simprep/physics/yardstick.xml` take here and now, in a batch of 28 on 2 threads (`yardstick_s`). Costs are multiples of it,
`analysis_yardsticks`, `mpc_yardsticks`, `live_yardsticks`, `pair_yardsticks` and `feedback_yardsticks` (per second of motion). Rates are amounts in that time: `fight_fps` becomes
`fight_frames_per_yardstick`, `sim_steps_per_s_1` becomes `sim_steps_per_yardstick_1`, and so on.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before numpy: small matrices only lose by more

import argparse
import json
import resource
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from time import process_time

import mujoco
import numpy as np
from mujoco.batch import Batch

from simprep.controller.influence import Influence
from simprep.controller.runtime.approach import approach
from simprep.controller.runtime.performer import RuntimeSettings
from simprep.controller.runtime.task import Task
from simprep.controller.runtime.world import library_world
from simprep.duel.analysis import analyse
from simprep.duel.fight.default_model import default_fight_model
from simprep.duel.fight.example_motions import ExampleMotions
from simprep.duel.fight.live import LiveFight
from simprep.duel.fight.modes import begin_fight
from simprep.duel.synthetic.make import make_synthetic
from simprep.duel.synthetic.presets import preset
from simprep.humanoid_model import humanoid
from simprep.library import library_motion
from simprep.motion.edit import move
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.load import load_motion
from simprep.physics.controller import ControlTask
from simprep.physics.mpc import MpcController
from simprep.physics.mpc_settings import MPC_PRESETS
from simprep.physics.settings import SimulationSettings
from simprep.physics.simulate import simulate, track
from simprep.physics.yardstick import Yardstick, best_rate
from simprep.preparation import prepare
from simprep.scene import build_scene

MPC_SECONDS = 3.0
PREPARED_SECONDS = 6.0
FIGHT_SECONDS = 60.0
FEEDBACK_SECONDS = 5.0
SIMULATIONS, SIMULATION_STEPS = 64, 240

# name, parent, offset [cm] (y up, x left, z forward), swing amplitude [deg] about x
SKELETON = (
    ("Hips", "", (0, 0, 0), 0), ("Spine", "Hips", (0, 12, 0), 2), ("Spine1", "Spine", (0, 20, 0), 2),
    ("Neck", "Spine1", (0, 22, 0), 0), ("Head", "Neck", (0, 10, 0), 0),
    ("LeftArm", "Spine1", (18, 16, 0), 25), ("LeftForeArm", "LeftArm", (0, -28, 0), 10),
    ("LeftHand", "LeftForeArm", (0, -26, 0), 0),
    ("RightArm", "Spine1", (-18, 16, 0), -25), ("RightForeArm", "RightArm", (0, -28, 0), -10),
    ("RightHand", "RightForeArm", (0, -26, 0), 0),
    ("LeftUpLeg", "Hips", (9, -4, 0), -25), ("LeftLeg", "LeftUpLeg", (0, -42, 0), 15),
    ("LeftFoot", "LeftLeg", (0, -42, 0), 5), ("LeftToeBase", "LeftFoot", (0, -6, 14), 0),
    ("RightUpLeg", "Hips", (-9, -4, 0), 25), ("RightLeg", "RightUpLeg", (0, -42, 0), 15),
    ("RightFoot", "RightLeg", (0, -42, 0), 5), ("RightToeBase", "RightFoot", (0, -6, 14), 0),
)  # fmt: skip


def synthetic_bvh(frames: int = 600, fps: float = 60.0) -> str:
    """A BVH file of a stiff walk in place, y up, centimetres: enough structure to cost what a real file costs."""
    lines = ["HIERARCHY"]

    def joint(name: str, depth: int) -> None:
        indent = "  " * depth
        x, y, z = next(offset for own, _, offset, _ in SKELETON if own == name)
        children = [own for own, parent, _, _ in SKELETON if parent == name]
        channels = "6 Xposition Yposition Zposition" if depth == 0 else "3"
        lines.extend([
            f"{indent}{'ROOT' if depth == 0 else 'JOINT'} {name}", indent + "{", f"{indent}  OFFSET {x} {y} {z}",
            f"{indent}  CHANNELS {channels} Zrotation Xrotation Yrotation",
        ])  # fmt: skip
        for child in children:
            joint(child, depth + 1)
        if not children:
            lines.extend([f"{indent}  End Site", indent + "  {", f"{indent}    OFFSET 0 -4 4", indent + "  }"])
        lines.append(indent + "}")

    joint("Hips", 0)
    phase = 2 * np.pi * np.arange(frames) / fps
    columns = [np.zeros(frames), np.full(frames, 94.0), np.zeros(frames)]
    for name, _, _, amplitude in SKELETON:
        one_sided = name.endswith(("Leg", "ForeArm")) and "Up" not in name
        swing = abs(amplitude) * (1 - np.cos(phase)) / 2 if one_sided else amplitude * np.sin(phase)
        columns += [np.zeros(frames), swing, np.zeros(frames)]
    rows = [" ".join(f"{value:.4f}" for value in row) for row in np.stack(columns, axis=1)]
    return "\n".join([*lines, "MOTION", f"Frames: {frames}", f"Frame Time: {1 / fps:.6f}", *rows, ""])


def simulation_rate(threads: int) -> float:
    """Simulation steps per second of the standing humanoid."""
    model = build_scene()
    batch = Batch(model, SIMULATIONS, nthread=threads)
    qpos = batch.bind("qpos")
    control = np.zeros((SIMULATIONS, SIMULATION_STEPS, model.nu))

    def work() -> float:
        qpos[:] = humanoid().standing_qpos
        batch.bind("qvel")[:] = 0.0
        batch.rollout(SIMULATION_STEPS, control=control, control_spec=mujoco.mjtState.mjSTATE_CTRL, record=("qpos",))
        return float(SIMULATIONS * SIMULATION_STEPS)

    return best_rate(work)


def in_yardsticks(numbers: dict[str, float], yardstick_s: float) -> dict[str, float]:
    """Costs [s] as multiples of the yardstick, rates [1/s] as amounts in its time."""
    out = {}
    for name, value in numbers.items():
        if name.endswith("_fps"):
            out[name.removesuffix("_fps") + "_frames_per_yardstick"] = value * yardstick_s
        elif "_per_s_" in name:
            out[name.replace("_per_s_", "_per_yardstick_")] = value * yardstick_s
        elif name.endswith("_s_per_s"):
            out[name.removesuffix("_s_per_s") + "_yardsticks"] = value / yardstick_s
        elif name.endswith("_s"):
            out[name.removesuffix("_s") + "_yardsticks"] = value / yardstick_s
    return out


def import_rate(file: Path | None) -> float:
    """Frames per second of importing a file, or the synthetic one."""
    with tempfile.TemporaryDirectory() as folder:
        path = file or Path(folder) / "synthetic.bvh"
        if file is None:
            path.write_text(synthetic_bvh(), encoding="utf-8")
        load_motion(path)  # imports and model compilation are paid once
        return best_rate(lambda: float(len(load_motion(path))), repeats=2)


def long_import(minutes: float, fps: float = 120.0) -> dict[str, float]:
    """Speed and peak memory of importing a synthetic BVH file of so many minutes, alone in a process."""
    frames = round(60 * minutes * fps)
    with tempfile.TemporaryDirectory() as folder, ProcessPoolExecutor(1, get_context("spawn")) as pool:
        path = Path(folder) / "long.bvh"
        path.write_text(synthetic_bvh(frames, fps), encoding="utf-8")
        seconds, peak_mb = pool.submit(_imported, path).result()
    return {"frames": frames, "import_fps": frames / seconds, "peak_rss_mb": peak_mb}


def _imported(path: Path) -> tuple[float, float]:
    """Processor time [s] of importing a file, and this process's peak memory [MB]."""
    begin = process_time()
    load_motion(path)
    return process_time() - begin, peak_rss_mb()


def peak_rss_mb() -> float:
    """Peak memory of this process [MB]."""
    status = Path("/proc/self/status")
    if status.exists():  # where getrusage also counts what the parent held when it forked
        lines = (line.split() for line in status.read_text(encoding="utf-8").splitlines())
        return next(float(words[1]) / 1024 for words in lines if words and words[0] == "VmHWM:")
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1024**2 if sys.platform == "darwin" else 1024)


def runtime_rate(optimise: bool) -> float:
    """Frames per second of approaches under the policy, planning included, on one core."""
    goals = [(2.0, 0.3), (2.5, -0.6), (1.6, 0.0)]
    world = replace(library_world(["punch_right"]), settings=RuntimeSettings(optimise=optimise))
    tasks = [Task(goal, "punch_right", (Influence(goal, {"punch_right": 1.0}),)) for goal in goals]
    approach(world, tasks[:1])  # what is worked out once is not part of the rate

    def rate() -> float:
        results = [approach(world, [task]) for task in tasks]
        return sum(r.frames for r in results) / sum(r.synthesis_s + r.policy_s for r in results)

    return max(rate() for _ in range(3))


def fight_rate() -> float:
    """Frames per second of automatic fights of 60 s, on one core; the model and its examples are there already."""
    model = default_fight_model()
    examples = ExampleMotions.of(model.stream, model.model)
    rates = []
    for seed in range(3):
        begin = process_time()
        made = begin_fight(model, seed=seed, examples=examples)
        made.run(FIGHT_SECONDS)
        frames = len(made.fight(FIGHT_SECONDS).stream)
        rates.append(frames / (process_time() - begin))
    return max(rates)


def feedback_cost() -> float:
    """Computing time per second of an automatic fight with feedback; the model and its examples are there already."""
    made = begin_fight(default_fight_model(), seed=0)
    live = LiveFight(made, seed=0, optimise=True)
    live.run(FEEDBACK_SECONDS)
    return live.wall_s / live.time


def analysis_time() -> float:
    """Processor time of analysing the built-in kickboxing stream [s]."""
    made = make_synthetic(preset("kickboxing"), 0)
    begin = process_time()
    analyse(made.stream, np.random.default_rng(0), truth=made.truth)
    return process_time() - begin


def measure(file: Path | None) -> dict[str, float]:
    """Every number of the benchmark."""
    walk, punch = library_motion("walk"), library_motion("punch_right")
    alpha = np.linspace(0.0, 1.0, round(PREPARED_SECONDS * walk.fps))
    prepare(walk, punch, alpha[:10])
    poses = np.resize(walk.qpos, (5000, walk.qpos.shape[1]))
    numbers = {
        "import_fps": import_rate(file),
        "fk_fps": best_rate(lambda: float(len(forward_kinematics(poses, walk.character).com))),
        "preparation_fps": best_rate(lambda: float(len(prepare(walk, punch, alpha).motion))),
        "runtime_fps": runtime_rate(True),
        "runtime_plain_fps": runtime_rate(False),
        "fight_fps": fight_rate(),
        "sim_steps_per_s_1": simulation_rate(1),
        "sim_steps_per_s_2": simulation_rate(2),
        "analysis_s": analysis_time(),
    }
    prepared = prepare(walk, punch, 0.0, duration=MPC_SECONDS).motion
    planners: list[MpcController] = []

    def mpc(task: ControlTask) -> MpcController:
        planners.append(MpcController(task))
        return planners[-1]

    run = track(prepared, mpc, seed=0)
    jab = library_motion("jab_left_head")
    pair = simulate([jab, move(jab, (0.9, 0.0), np.pi)], "mpc", seed=0)
    live = track(prepared, "mpc", 0, SimulationSettings(mpc=MPC_PRESETS["live"]))
    timed = {"mpc": run, "live": live, "pair": pair}
    numbers |= {f"{name}_s_per_s": one.wall_s / one.end_s for name, one in timed.items()}
    numbers["feedback_s_per_s"] = feedback_cost()
    yardstick_s = Yardstick().seconds()  # beside mpc, which it is compared with most
    numbers |= {"yardstick_s": yardstick_s, **in_yardsticks(numbers, yardstick_s)}
    numbers["mpc_overhead_share"] = run.overhead_share
    numbers["planner_overhead_share"] = 1 - planners[0].simulation_s / planners[0].total_s
    numbers["peak_rss_mb"] = peak_rss_mb()
    return numbers


def _minutes(text: str) -> float:
    minutes = float(text)
    if not 0 < minutes <= 60:
        raise argparse.ArgumentTypeError(f"{text} minutes; valid: above 0, at most 60")
    return minutes


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    parser.add_argument("--file", type=Path, help="motion file for import_fps; default: a synthetic BVH file")
    parser.add_argument(
        "--import-bvh-minutes",
        type=_minutes,
        metavar="MINUTES",
        help="import a synthetic BVH file that long at 120 Hz; only that",
    )
    arguments = parser.parse_args()
    minutes = arguments.import_bvh_minutes
    found = measure(arguments.file) if minutes is None else long_import(minutes)
    numbers = {name: float(f"{value:.4g}") for name, value in found.items()}
    if arguments.json:
        print(json.dumps(numbers))
    else:
        for name, value in numbers.items():
            print(f"{name:32} {value:g}")


if __name__ == "__main__":
    main()
