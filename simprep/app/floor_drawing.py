"""Balance, goal, hits and pushes, drawn into one tab's scene. Needs the extra `app`."""

from typing import Any

import numpy as np
import viser

from simprep.app.moments import FloorMarks, Moment
from simprep.arrays import FloatArray

_UP_M = 0.012
"""Above the floor, so that nothing is hidden by it [m]."""
_COLOURS = {"com": (40, 40, 40), "xcom": (230, 120, 0), "pressure": (200, 0, 120), "support": (20, 140, 80)}
FLASH_S = 0.5
MOST_HITS = 6
_ARROW_M_PER_N = 1 / 300


class FloorDrawing:
    """What is drawn of a moment besides the bodies.

    Args:
        client: the tab.
        bodies: how many there are.
    """

    def __init__(self, client: viser.ClientHandle, bodies: int) -> None:
        scene = client.scene
        self._points: list[dict[str, Any]] = []
        self._edges: list[Any] = []
        for number in range(bodies):
            self._points.append(
                {
                    name: scene.add_icosphere(
                        f"/marks/{number}/{name}", radius=0.03, subdivisions=1, color=_COLOURS[name], visible=False
                    )
                    for name in ("com", "xcom", "pressure")
                }
            )
            self._edges.append(
                scene.add_line_segments(
                    f"/marks/{number}/support", np.zeros((1, 2, 3)), _COLOURS["support"], thickness=0.015, visible=False
                )
            )
        self._goal = scene.add_cylinder("/marks/goal", radius=0.12, height=0.01, color=(60, 110, 230), visible=False)
        self._push = scene.add_line_segments(
            "/marks/push", np.zeros((1, 2, 3)), (220, 0, 0), thickness=0.04, visible=False
        )
        self._push_text = scene.add_label("/marks/push_text", "", visible=False)
        self._hits = [
            scene.add_icosphere(f"/hits/{k}", radius=0.05, subdivisions=1, color=(255, 60, 0), visible=False)
            for k in range(MOST_HITS)
        ]
        self._texts = [scene.add_label(f"/hit_texts/{k}", "", visible=False) for k in range(MOST_HITS)]

    def show(self, moment: Moment, marks: bool) -> None:
        """Draw a moment, with or without the marks of balance."""
        for one, points, edges in zip(moment.marks, self._points, self._edges):
            _show_marks(one, points, edges, marks)
        goal = moment.caption.goal
        self._goal.visible = goal is not None
        if goal is not None:
            self._goal.position = (*goal, 0.005)
        self._show_push(moment)
        for number, (ball, text) in enumerate(zip(self._hits, self._texts)):
            shown = number < len(moment.hits)
            ball.visible = text.visible = shown
            if shown:
                parts, impulse, position = moment.hits[len(moment.hits) - 1 - number]
                ball.position = text.position = position
                words = f"{parts[0]} on {parts[1]}: {impulse:.1f} N s"
                if text.text != words:
                    text.text = words

    def _show_push(self, moment: Moment) -> None:
        size = float(np.linalg.norm(moment.push))
        self._push.visible = self._push_text.visible = size > 0
        if size > 0:
            tips = [moment.bodies[one][:3] for one in moment.pushed]
            arrow = _ARROW_M_PER_N * np.array(moment.push)
            self._push.points = np.array([[tip - arrow, tip] for tip in tips])
            self._push_text.position = tips[0] - arrow
            self._push_text.text = f"outside force {size:.0f} N"


def _show_marks(one: FloorMarks, points: dict[str, Any], edges: Any, shown: bool) -> None:
    for name, handle in points.items():
        place: FloatArray = getattr(one, name)
        visible = shown and bool(np.isfinite(place).all())
        handle.visible = visible
        if visible:
            handle.position = (float(place[0]), float(place[1]), _UP_M)
    count = len(one.polygon)
    edges.visible = shown and count >= 2
    if edges.visible:
        corners = np.column_stack([one.polygon, np.full(count, _UP_M)])
        edges.points = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
