"""Report pages: they hold what was simulated, ask the network for nothing, stay small, and play in a browser."""

import base64
import json
import re
import shutil
from dataclasses import replace
from html.parser import HTMLParser
from time import monotonic

import msgspec
import mujoco
import numpy as np
import pytest
import zstandard

from simprep import library_motion, track
from simprep.errors import MissingExtraError, SettingError
from simprep.humanoid_model import humanoid
from simprep.motion.edit import repeat
from simprep.motion.kinematics import forward_kinematics
from simprep.physics.run import Run
from simprep.report.page import Page, Picture, page_html, write_report
from simprep.report.replay import record as record_module
from simprep.report.replay.actor import Actor, Flash, Prop, Replay, run_replay, side_by_side
from simprep.report.replay.meshes import geom_mesh, segment_meshes
from simprep.report.replay.record import RECORDING_MARK, record, replay_times
from simprep.report.run_page import run_page
from simprep.scene import Obstacle

LOADING = ("src", "href", "srcset", "poster", "data", "action")


@pytest.fixture(scope="module")
def run() -> Run:
    return track(library_motion("stand")[:20], "pd", seed=0)


@pytest.fixture(scope="module")
def page(run: Run) -> str:
    return page_html(run_page(run, {"mpjpe_mm": 12.0}, {"command": "simprep track <stand>"}))


class Loads(HTMLParser):
    """What a page would load, and the text of its scripts by id."""

    def __init__(self) -> None:
        super().__init__()
        self.urls, self.scripts, self._id = [], {}, None

    def handle_starttag(self, tag, attrs):
        self.urls += [value for name, value in attrs if name in LOADING]
        self._id = dict(attrs).get("id", "") if tag == "script" else None

    def handle_data(self, data):
        if self._id is not None:
            self.scripts[self._id] = self.scripts.get(self._id, "") + data


def parsed(page: str) -> Loads:
    reader = Loads()
    reader.feed(page)
    return reader


def messages(data: str) -> list[tuple[float, dict]]:
    """A recording of viser: 8 bytes of length, zstd of (8 bytes of length, msgpack, arrays)."""
    packed = base64.b64decode(data)
    raw = zstandard.ZstdDecompressor().decompress(packed[8:], max_output_size=int.from_bytes(packed[:8], "little"))
    length = int.from_bytes(raw[:8], "little")
    return msgspec.msgpack.decode(raw[8 : 8 + length])["messages"]


def world_poses(data: str, tree: str, at_s: float) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Position and quaternion of every segment below `tree` in the tree's frame, at a time, as a viewer computes them."""
    position, rotation = {}, {}
    for time, message in messages(data):
        if time > at_s + 1e-6:
            break
        if message["type"] == "SetPositionMessage":
            position[message["name"]] = np.array(message["position"])
        if message["type"] == "SetOrientationMessage":
            rotation[message["name"]] = np.array(message["wxyz"])
    poses = {}
    for name in sorted(position.keys() | rotation.keys()):
        if not name.startswith(tree + "/") or name.endswith("/shape"):
            continue
        parent = poses.get(name.rpartition("/")[0], (np.zeros(3), np.array([1.0, 0, 0, 0])))
        place, turn = np.zeros(3), np.zeros(4)
        mujoco.mju_rotVecQuat(place, position.get(name, np.zeros(3)), parent[1])
        mujoco.mju_mulQuat(turn, parent[1], rotation.get(name, np.array([1.0, 0, 0, 0])))
        poses[name] = (parent[0] + place, turn)
    return {name.rpartition("/")[2]: pose for name, pose in poses.items()}


def test_the_page_holds_the_simulated_poses_and_those_of_the_reference(run, page):
    data = parsed(page).scripts["recording-0"]
    times, _ = replay_times(run_replay(run))
    assert len(times) > 5
    for tree, qpos in (("simulated", run.qpos), ("reference", run.reference.qpos)):
        for time in times[[0, 3, -1]]:
            frame = round(time / run.timestep)
            true = forward_kinematics(qpos[frame : frame + 1])
            shown = world_poses(data, f"/world/simulated, pd/{tree}", time)
            assert set(shown) == set(humanoid().segments)
            for number, segment in enumerate(humanoid().segments):
                assert shown[segment][0] == pytest.approx(true.xpos[0, number], abs=2e-3)
                turn = shown[segment][1] / np.linalg.norm(shown[segment][1])
                assert abs(turn @ true.xquat[0, number]) == pytest.approx(1, abs=1e-6)  # 0.2 degrees


def test_a_page_loads_nothing(page):
    reader = parsed(page)
    viewer = json.loads(reader.scripts["viewer"])
    assert viewer.count(RECORDING_MARK) == 1
    for part in (reader, parsed(viewer)):
        assert all(url.startswith(("data:", "#")) for url in part.urls)
    styles = " ".join(re.findall(r"<style>.*?</style>", page, re.DOTALL))
    assert "url(" not in styles
    assert "@import" not in styles


def test_what_people_write_is_text_and_not_markup():
    written = page_html(Page("<b>", "a & b", details={"source": "<script>"}, warnings=["</p>"]))
    assert "<b>" not in written
    assert "<script" not in written
    for text in ("&lt;b&gt;", "a &amp; b", "&lt;script&gt;", "&lt;/p&gt;"):
        assert text in written


def test_ten_seconds_of_two_arms_are_under_5_mb():
    walk = repeat(library_motion("walk"), 12).seconds(0, 10)
    arms = side_by_side([Actor("one", walk, walk), Actor("two", walk[5:], walk[5:])])
    assert np.subtract(arms[0].place, arms[1].place) == pytest.approx([0, 1.4], abs=0.1)  # left of who walks along x
    page = page_html(Page("walk", "10 s", [Replay("walk", arms)]))
    assert 0.9e6 < len(page.encode()) < 2e6  # most of it is the viewer: four arms and the plots fit in too


def test_a_long_replay_has_fewer_frames(run):
    hour = replace(library_motion("stand"), fps=1.0)
    motion = repeat(hour, 3600 // len(hour) + 1) if hour.loop else hour
    times, fps = replay_times(Replay("hour", (Actor("a", motion),)))
    assert len(times) <= record_module.FRAME_LIMIT
    assert fps < 30 or motion.duration < 30


def test_things_contacts_and_events_appear_in_time(run):
    ball = Obstacle("ball", (0, 0, 0), (0.1, 0.1, 0.1), ball=True)
    duration = run.end_s
    replay = Replay(
        "scene",
        (Actor("a/b", run.simulated_motion(), end_note="fell"),),
        obstacles=(Obstacle("gate", (1, 0, 1), (0.1, 1, 0.1)),),
        props=(Prop(ball, np.linspace([0, 0, 0], [1, 0, 0], 11), 10 / duration),),
        flashes=(Flash(duration / 2, 0.0, (0, 0, 1), 0.05, "3 N s"),),
        marks=(("launch", duration / 2),),
    )
    told = messages(record(replay).data)
    places = [
        (t, m["position"][0]) for t, m in told if m["type"] == "SetPositionMessage" and m["name"] == "/world/prop_0"
    ]
    assert places[-1][1] == pytest.approx(places[-1][0] / duration, abs=0.02)
    shown = {m["name"]: t for t, m in told if m["type"] == "SetSceneNodeVisibilityMessage" and m["visible"] and t > 0}
    for name in ("/world/contact_0", "/world/event_0"):
        assert shown[name] == pytest.approx(duration / 2, abs=0.04)
    texts = [
        (t, m["updates"]["text"]) for t, m in told if m["type"] == "SceneNodeUpdateMessage" and "text" in m["updates"]
    ]
    assert [text for _, text in texts] == ["a/b", "a/b: fell"]
    assert texts[0][0] == 0.0  # so that it is true again when the replay begins anew
    assert {m.get("name") for _, m in told} >= {"/world/gate_0", "/world/a b/simulated/pelvis"}


def test_every_segment_has_a_shape_of_its_size():
    for segment, (vertices, faces) in zip(humanoid().segments, segment_meshes(humanoid())):
        assert len(faces) > 0, segment
        assert faces.max() < len(vertices)
    head = segment_meshes(humanoid())[humanoid().segments.index("head")][0]
    assert 0.15 < np.ptp(head[:, 2]) < 0.5


def test_a_mesh_file_is_shown_where_it_is_and_with_fewer_triangles():
    side = 41  # a plate of 1 m with 2 mm waves: finer than what is kept
    x, y = (grid.ravel() for grid in np.meshgrid(np.linspace(0, 1, side), np.linspace(0, 1, side)))
    spec = mujoco.MjSpec()
    vertices = np.stack([x, y, 0.1 + 0.001 * np.sin(40 * x)], axis=1)
    corner = np.arange(side * (side - 1)).reshape(side - 1, side)[:, :-1].ravel()
    faces = np.concatenate(
        [np.stack([corner, corner + 1, corner + side], 1), np.stack([corner + 1, corner + side + 1, corner + side], 1)]
    )
    spec.add_mesh(
        name="plate",
        uservert=vertices.ravel(),
        userface=faces.ravel(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )
    body = spec.worldbody.add_body()
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="plate", pos=[0, 0, 2])
    model = spec.compile()
    mesh = geom_mesh(model, 0)
    assert np.asarray(mesh.bounds) == pytest.approx(np.array([[0, 0, 2.1], [1, 1, 2.1]]), abs=0.011)
    assert 0 < len(mesh.faces) <= len(faces)
    fine = spec.copy()
    fine.meshes[0].uservert = (0.1 * vertices).ravel()  # ten times smaller: most vertices fall together
    assert len(geom_mesh(fine.compile(), 0).faces) < len(faces) / 4


def test_without_the_library_a_warning_names_the_extra(run, monkeypatch, tmp_path):
    monkeypatch.setattr(record_module, "_viser", lambda: (_ for _ in ()).throw(MissingExtraError("a replay", "report")))
    warnings = []
    assert write_report(tmp_path, lambda: run_page(run, {}), warnings.append) == []
    assert "simprep[report]" in warnings[0]
    assert not list(tmp_path.iterdir())


def test_a_replay_of_nobody_is_refused():
    with pytest.raises(SettingError, match="no body"):
        Replay("empty", ())


def test_a_picture_stands_in_the_page(tmp_path):
    png = b"\x89PNG"
    (tmp_path / "a.png").write_bytes(png)
    written = page_html(Page("t", "h", pictures=[Picture("plot", tmp_path / "a.png")]))
    assert f"data:image/png;base64,{base64.b64encode(png).decode()}" in written


def test_a_report_plays_in_a_browser_without_the_network(page, tmp_path):
    api = pytest.importorskip("playwright.sync_api", reason="no playwright")
    browser_path = next(filter(None, map(shutil.which, ("chromium-headless-shell", "chromium", "google-chrome"))), None)
    if browser_path is None:
        pytest.skip("no Chromium on this machine")
    path = tmp_path / "report.html"
    path.write_text(page, encoding="utf-8")
    software = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path, args=software)
        tab = browser.new_page(viewport={"width": 160, "height": 200})
        asked, problems = [], []
        tab.on("request", lambda request: asked.append(request.url))
        tab.on("pageerror", lambda error: problems.append(str(error)))
        tab.on("console", lambda message: message.type == "error" and problems.append(message.text))
        tab.goto(path.as_uri())
        time = tab.frame_locator("#replay iframe").locator("[role=slider]")
        time.wait_for(state="attached", timeout=60_000)
        seen = {time.get_attribute("aria-valuenow")}
        end = monotonic() + 60
        while len(seen) < 3 and monotonic() < end:
            tab.wait_for_timeout(100)
            seen.add(time.get_attribute("aria-valuenow"))
        assert len(seen) >= 3  # the replay moves
        assert tab.frame_locator("#replay iframe").locator("canvas").count() >= 1
        browser.close()
    assert not problems
    assert {url.partition(":")[0] for url in asked} <= {"file", "data", "blob"}
    assert sum(url.startswith("file:") for url in asked) == 1
