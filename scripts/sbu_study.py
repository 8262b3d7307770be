"""Real pairs (SBU Kinect): who acts, what the acting person does, and the distances, facing and delays of attacks.

Run: python scripts/sbu_study.py ../shared/data/pairs/sbu_pairs.npz [-o results/sbu.json]

The measures are those of `sbu.strikes`, so the built-in streams can be put beside them.
"""

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np

from sbu.interactions import ATTACKS, SbuPairs, acting_found, classify_acting, read_sbu, strikes
from sbu.strikes import reach
from simprep.report.results import provenance, save_json

# Who attacks, told by eye from stick figures of six moments of each clip before any rule was tried.
# ?: the arms were not tracked.
ACTING_A = (
    "15 25 37 48 61 64 88 105 106 117 139 146 153 167 179 192 195 199 "  # kick
    "14 16 46 50 58 66 69 99 114 125 130 150 187 206 209 "  # push
    "6 24 32 33 67 71 101 120 140 147 155 175 196 200 208"  # punch
)
ACTING_B = (
    "8 22 39 49 57 62 83 111 124 159 162 163 170 211 "
    "3 17 20 34 54 56 60 74 98 107 128 129 160 165 216 "
    "10 11 31 45 76 80 94 103 112 133 143 144 151 173 184"
)
UNDECIDED = "203 178"
ACTING = {int(clip): who for text, who in ((ACTING_A, "A"), (ACTING_B, "B"), (UNDECIDED, "?")) for clip in text.split()}


def rules(pairs: SbuPairs, clip: int) -> dict[str, int]:
    """Who acts by several rules; `reach` is that of `sbu.strikes`."""
    track = pairs.track(clip)
    gap = track.root[:, ::-1] - track.root
    gap[..., 2] = 0.0
    towards = gap / np.linalg.norm(gap, axis=-1, keepdims=True)
    limbs = track.joints[:, :, list(track.ends)] - track.root[:, :, None]
    ahead = (limbs * towards[:, :, None]).sum(axis=-1)  # (T, 2, 4) in front of one's own root
    steps = (np.diff(track.root, axis=0) * towards[1:]).sum(axis=-1).cumsum(axis=0)
    values = {
        "reach": reach(track).max(axis=(0, 2)),
        "stretch": ahead.max(axis=(0, 2)),
        "speed": np.diff(ahead, axis=0).max(axis=(0, 2)),
        "energy": (np.diff(limbs, axis=0) ** 2).sum(axis=(0, 2, 3)),
        "advance": steps.max(axis=0),
        "drives the other back": (-steps).max(axis=0)[::-1],
    }
    return {name: int(np.argmax(value)) for name, value in values.items()}


def compare_rules(pairs: SbuPairs) -> dict[str, Any]:
    """Share of clips in which each rule finds who acts; and of the rule that is best on the other folds, held out."""
    clips = sorted(ACTING)
    found = [rules(pairs, clip) for clip in clips]
    right = {
        name: np.array([row[name] == "AB?".index(ACTING[clip]) for row, clip in zip(found, clips)]) for name in found[0]
    }
    fold = pairs.folds[clips]
    chosen = {
        int(number): max(right, key=lambda name: right[name][fold != number].mean()) for number in np.unique(fold)
    }
    held_out = np.concatenate([right[name][fold == number] for number, name in chosen.items()])
    return {
        "share": {name: float(value.mean()) for name, value in right.items()},
        "chosen_on_other_folds": chosen,
        "held_out_share": float(held_out.mean()),
    }


def attack_statistics(pairs: SbuPairs) -> dict[str, dict[str, Any]]:
    """Quartiles of distance, facing and reaction delay at the strike, for each kind of attack."""
    found = strikes(pairs)
    out: dict[str, dict[str, Any]] = {}
    for kind in ATTACKS:
        chosen = [strike for strike, label in zip(found, pairs.labels) if label == kind]
        values = {
            "distance_m": [strike.distance_m for strike in chosen],
            "actor_facing_deg": [strike.facing_deg[0] for strike in chosen],
            "other_facing_deg": [strike.facing_deg[1] for strike in chosen],
            "answer_s": [strike.answer_s for strike in chosen if np.isfinite(strike.answer_s)],
            "reaction_delay_s": [strike.delay_s for strike in chosen if np.isfinite(strike.delay_s)],
        }
        out[kind] = {
            key: [float(q) for q in np.percentile(value, [10, 25, 50, 75, 90])] for key, value in values.items()
        }
        out[kind]["clips"] = len(chosen)
        out[kind]["reactions"] = len(values["reaction_delay_s"])
        out[kind]["by_foot"] = sum(strike.end.endswith("foot") for strike in chosen)
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pairs", type=Path)
    parser.add_argument("-o", "--out", type=Path)
    arguments = parser.parse_args()
    pairs = read_sbu(arguments.pairs)
    found = acting_found(pairs, ACTING)
    total = [sum(counts) for counts in zip(*found.values())]
    print(f"who acts: {total[0]} of {total[1]} found ({total[0] / total[1]:.1%})", found)
    compared = compare_rules(pairs)
    print("other rules:", compared)
    result: dict[str, Any] = {
        "acting_rules": compared,
        "acting_found": found,
        "acting_found_share": total[0] / total[1],
        "classification": {},
    }
    for name, window in (("whole_clip", None), ("half_second_around_strike", 0.5)):
        score, folds = classify_acting(pairs, window)
        print(f"{name}: accuracy {score.accuracy:.3f}, macro F1 {score.macro_f1:.3f}, folds {np.round(folds, 3)}")
        print(f"  rows {score.qualifiers}: {score.confusion.tolist()}")
        result["classification"][name] = {
            "accuracy": score.accuracy,
            "macro_f1": score.macro_f1,
            "fold_accuracy": folds.tolist(),
            "classes": score.qualifiers,
            "confusion": score.confusion.tolist(),
        }
    result["attacks_percentiles_10_25_50_75_90"] = attack_statistics(pairs)
    for kind, values in result["attacks_percentiles_10_25_50_75_90"].items():
        for key, value in values.items():
            print(f"{kind:6s} {key:18s}", np.round(value, 2))
    if arguments.out:
        command = f"python scripts/sbu_study.py {' '.join(sys.argv[1:])}"
        save_json(
            arguments.out, {"schema": "simprep.sbu-study/1", **provenance(sys.argv[1:]), "command": command, **result}
        )


if __name__ == "__main__":
    main()
