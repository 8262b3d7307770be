"""One drawing for each metric that docs/metrics.md explains, from built-in motions.

The poses, soles and curves are those of the humanoid. The simulated pose is that of servos alone (`pd`), just before they fall. Two
drawings are schematic: how far the sole slips and how deep it is in the floor is exaggerated.

Example: python scripts/draw_metrics.py -o docs/metrics
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle

import simprep
from simprep.files import atomic_path
from simprep.metrics.balance import balance
from simprep.metrics.smoothing import gaussian_derivatives
from simprep.metrics.transition import WINDOW_S
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.support import polygons
from simprep.preparation.scenario import AlphaProfile

GREY, GOLD, BLUE, RED, GREEN = "#5b616b", "#b8860b", "#2f6fb3", "#c2452d", "#3a8a4d"
STYLE = {"svg.hashsalt": "simprep", "svg.fonttype": "path", "font.size": 9}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--out", type=Path, default=Path("docs/metrics"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    for name, draw in DRAWINGS.items():
        save(draw(), options.out / f"{name}.svg")
        print(f"written: {options.out / name}.svg")
    return 0


def save(figure: Figure, path: Path) -> None:
    import matplotlib

    with matplotlib.rc_context(STYLE), atomic_path(path) as temporary:
        figure.savefig(temporary, format="svg", bbox_inches="tight", metadata={"Date": None})


def plane(width: float = 4.6, height: float = 3.4) -> tuple[Figure, Axes]:
    """An empty picture in which a metre is as long in both directions."""
    figure = Figure(figsize=(width, height))
    axes = figure.add_subplot()
    axes.set_aspect("equal")
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    return figure, axes


def draw_support(axes: Axes, floor: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Soles that stand and the support polygon, from above; gives the polygon's corners (k, 2)."""
    (corners,) = polygons(floor[None], mask[None])
    axes.add_patch(Polygon(corners, closed=True, facecolor="#dfe6ef", edgecolor=BLUE, label="support polygon"))
    for foot, stands in zip(np.split(floor, 2), np.split(mask, 2)):
        if not stands.any():
            continue
        (outline,) = polygons(foot[None], np.ones((1, len(foot)), dtype=bool))
        axes.add_patch(Polygon(outline, closed=True, facecolor="#c7ccd3", edgecolor=GREY))
    axes.set_xlabel("x [m], the way it walks")
    axes.set_ylabel("y [m]")
    return corners


def com_to_centre() -> Figure:
    series = balance(simprep.library_motion("walk"))
    both_feet = series.support.reshape(len(series.time), 2, -1).any(axis=2).all(axis=1)
    frame = int(np.argmax(np.where(both_feet, series.com_cos, -1.0)))
    figure, axes = plane()
    draw_support(axes, series.foot_points[frame], series.support[frame])
    com, centre = series.com[frame, :2], series.support_centre[frame]
    axes.plot(*np.stack([com, centre]).T, color=RED, lw=2, label=f"distance: {1e3 * series.com_cos[frame]:.0f} mm")
    axes.plot(*centre, "s", color=BLUE, label="centre of support")
    axes.plot(*com, "o", color="black", label="COM on the floor")
    axes.margins(0.08)
    axes.autoscale_view()
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return figure


def margin_of_stability() -> Figure:
    series = balance(simprep.library_motion("walk"))
    frame = int(np.nanargmin(series.margin))  # one foot stands, and the body falls forward onto the next
    figure, axes = plane()
    corners = draw_support(axes, series.foot_points[frame], series.support[frame])
    com, xcom = series.com[frame, :2], series.xcom[frame]
    edge = nearest_on_outline(corners, xcom)
    axes.annotate("", xcom, com, arrowprops={"arrowstyle": "->", "color": "black", "lw": 1.5})
    axes.plot([], [], color="black", label="v / ω₀")
    axes.plot(
        *np.stack([xcom, edge]).T,
        color=RED,
        lw=2,
        label=f"margin: {1e3 * series.margin[frame]:.0f} mm".replace("-", "−"),
    )
    axes.plot(*com, "o", color="black", label="COM on the floor")
    axes.plot(*xcom, "D", color=GOLD, label="extrapolated COM (XcoM)")
    axes.margins(0.08)
    axes.autoscale_view()
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return figure


def nearest_on_outline(corners: np.ndarray, point: np.ndarray) -> np.ndarray:
    """The point (2,) of a polygon's outline that is nearest to another point."""
    begin, way = corners, np.roll(corners, -1, axis=0) - corners
    share = np.clip(((point - begin) * way).sum(axis=1) / (way**2).sum(axis=1), 0, 1)
    feet = begin + share[:, None] * way
    return feet[np.argmin(np.linalg.norm(feet - point, axis=1))]


def mpjpe() -> Figure:
    kick = simprep.library_motion("kick_front")
    run = simprep.track(kick, controller="pd")
    frame = int(0.9 * len(run.torque))
    poses = forward_kinematics(np.stack([run.reference_qpos[frame], run.qpos[frame]]), kick.character)
    reference, simulated = poses.xpos
    drift = simulated[0] - reference[0]
    figure = Figure(figsize=(6.6, 3.8))
    for number, (title, shift) in enumerate((("global (in the world)", np.zeros(3)), ("root-relative", drift))):
        axes = figure.add_subplot(1, 2, number + 1)
        axes.set_aspect("equal")
        axes.axhline(0, color="#c7ccd3", lw=1)
        draw_body(axes, kick, reference, poses.foot_points[0], GREY, "reference")
        draw_body(axes, kick, simulated - shift, poses.foot_points[1] - shift, BLUE, "simulated")
        for one, two in zip(reference, simulated - shift):
            axes.plot([one[0], two[0]], [one[2], two[2]], color=RED, lw=1.2)
        mean = 1e3 * np.linalg.norm(simulated - shift - reference, axis=1).mean()
        axes.set_title(f"{title}: {mean:.0f} mm", fontsize=9)
        axes.axis("off")
    axes.plot([], [], color=RED, label="distance of a segment")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return figure


def draw_body(
    axes: Axes, motion: simprep.Motion, origins: np.ndarray, soles: np.ndarray, colour: str, label: str
) -> None:
    """A stick figure from the side: segments (segments, 3) and the line of each sole (2, soles, 3)."""
    parents = motion.character.model.body_parentid[1:] - 1
    for segment, parent in enumerate(parents):
        if parent >= 0:
            axes.plot(*origins[[parent, segment]][:, [0, 2]].T, color=colour, lw=2)
    for side, foot in enumerate(motion.character.feet):
        outline = np.stack([origins[foot], soles[side, 0], soles[side, -1], origins[foot]])
        axes.plot(*outline[:, [0, 2]].T, color=colour, lw=2)
    axes.plot([], [], color=colour, lw=2, label=label)


def foot_slip() -> Figure:
    stand = simprep.library_motion("stand")
    sole = forward_kinematics(stand.qpos[:1], stand.character).foot_points[0, 0, :, :2]
    (outline,) = polygons(sole[None], np.ones((1, len(sole)), dtype=bool))
    turn = np.deg2rad(8)
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    middle = sole.mean(axis=0)

    def moved(points: np.ndarray) -> np.ndarray:
        return (points - middle) @ rotation.T + middle + [0.05, 0.02]

    figure, axes = plane()
    axes.add_patch(
        Polygon(outline, closed=True, facecolor="#c7ccd3", edgecolor=GREY, label="sole where the stance begins")
    )
    axes.add_patch(
        Polygon(moved(outline), closed=True, facecolor="none", edgecolor=BLUE, lw=1.5, label="where it ends")
    )
    for point in sole:
        axes.annotate("", moved(point), point, arrowprops={"arrowstyle": "->", "color": RED, "lw": 1.5})
    axes.plot([], [], color=RED, label="slip of each point that carries")
    axes.margins(0.08)
    axes.autoscale_view()
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return figure


def penetration() -> Figure:
    figure, axes = plane(4.6, 2.4)
    depth, radius = 0.012, 0.025
    axes.add_patch(Rectangle((-0.06, -0.06), 0.36, 0.06, facecolor="#efe9df", edgecolor="none"))
    axes.axhline(0, color=GREY, lw=1)
    axes.text(0.02, -0.012, "floor, z = 0", va="top", ha="center", color=GREY)
    for x, z in ((0.02, radius + 0.004), (0.2, radius - depth)):
        axes.add_patch(Circle((x, z), radius, facecolor="#c7ccd3", edgecolor=GREY))
    axes.plot([0.02, 0.2], [2 * radius + 0.004, 2 * radius - depth], color=GREY, lw=1)
    axes.annotate(
        "",
        (0.2, -depth),
        (0.2, 0),
        arrowprops={"arrowstyle": "<->", "color": RED, "lw": 1.5, "shrinkA": 0, "shrinkB": 0},
    )
    axes.text(0.232, -0.008, "depth", color=RED, va="center")
    axes.text(0.02, 0.065, "heel", ha="center")
    axes.text(0.2, 0.065, "ball", ha="center")
    axes.set_xlim(-0.06, 0.3)
    axes.set_ylim(-0.05, 0.09)
    axes.axis("off")
    return figure


def peak_acceleration() -> Figure:
    walk, kick = simprep.library_motion("walk"), simprep.library_motion("kick_front")
    profile = AlphaProfile(level=1.0, lead=0.2, rise=1.0, hold=0.6)
    figure = Figure(figsize=(6.2, 2.8))
    axes = figure.add_subplot()
    for arm, label, colour in (("none", "no preparation", GREY), ("optimised", "with preparation", BLUE)):
        motion = simprep.scenario(walk, kick, profile, arm=arm)
        launch = motion.events["launch"] / motion.fps
        times, (acceleration,) = gaussian_derivatives(motion.qpos[:, 7:], motion.fps, (2,), 240.0)
        largest = np.abs(acceleration).max(axis=1)
        near = np.abs(times - launch) <= WINDOW_S
        peak = int(np.argmax(np.where(near, largest, 0)))
        shown = np.abs(times - launch) <= 0.7
        axes.plot(times[shown] - launch, largest[shown], color=colour, label=label)
        axes.plot(times[peak] - launch, largest[peak], "o", color=RED)
        axes.annotate(
            f"{largest[peak]:.0f}", (times[peak] - launch, largest[peak]), (6, 2), textcoords="offset points", color=RED
        )
    axes.axvspan(-WINDOW_S, WINDOW_S, color="#dfe6ef", zorder=0)
    axes.axvline(0, color=GREY, lw=0.8, ls="--")
    axes.set_xlabel("time from the launch [s]")
    axes.set_ylabel("fastest hinge [rad/s²]")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    return figure


DRAWINGS = {
    "com_to_centre": com_to_centre,
    "margin_of_stability": margin_of_stability,
    "mpjpe": mpjpe,
    "foot_slip": foot_slip,
    "penetration": penetration,
    "peak_acceleration": peak_acceleration,
}

if __name__ == "__main__":
    sys.exit(main())
