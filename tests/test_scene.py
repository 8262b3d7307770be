"""Scenes of any number of bodies: names, collisions, obstacles, and how many fit in."""

import mujoco
import numpy as np
import pytest

from simprep.errors import SettingError
from simprep.humanoid_model import humanoid
from simprep.scene import (
    BODY_LIMIT,
    FLOOR_BIT,
    GLOVE_S,
    OBJECT_BIT,
    Obstacle,
    SceneSettings,
    body_prefix,
    build_scene,
    collision_bits,
)


def test_prefixes_are_letters_and_never_repeat() -> None:
    assert body_prefix(0, 1) == ""
    assert [body_prefix(n, 2) for n in (0, 1)] == ["a_", "b_"]
    assert [body_prefix(n, 800) for n in (2, 25, 26, 27, 51, 52, 701, 702)] == [
        "c_", "z_", "aa_", "ab_", "az_", "ba_", "zz_", "aaa_",
    ]  # fmt: skip
    assert len({body_prefix(n, 2000) for n in range(2000)}) == 2000


def meet(one: tuple[int, int], other: tuple[int, int]) -> bool:
    """MuJoCo's rule."""
    return bool(one[0] & other[1] or other[0] & one[1])


@pytest.mark.parametrize("count", [2, 3, 4, 9, 30, BODY_LIMIT])
def test_every_body_meets_every_other_and_never_itself(count: int) -> None:
    bits = [collision_bits(number, count) for number in range(count)]
    types, affinities = np.array(bits).T
    hits = (types[:, None] & affinities) | (types & affinities[:, None])
    np.testing.assert_array_equal(hits != 0, ~np.eye(count, dtype=bool))
    assert all(kind & (FLOOR_BIT | OBJECT_BIT) == 0 for kind in types)
    assert all(affinity & FLOOR_BIT and affinity & OBJECT_BIT for affinity in affinities)


def test_the_bits_of_two_are_those_they_always_had() -> None:
    assert [collision_bits(number, 2) for number in (0, 1)] == [(2, 1 | 4 | 1024), (4, 1 | 2 | 1024)]
    model = build_scene(SceneSettings((humanoid(), humanoid())))
    assert (model.geom("floor").contype[0], model.geom("floor").conaffinity[0]) == (1, 6)


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_bodies_collide_with_each_other_the_floor_and_obstacles(count: int) -> None:
    pads = tuple(Obstacle(f"pad{n}", (0.05 * n, 0.0, 1.3), (0.1, 0.1, 0.1), soft=True) for n in range(count))
    model = build_scene(SceneSettings((humanoid(),) * count, pads))
    data = mujoco.MjData(model)
    for number in range(count):  # all within each other, feet in the floor
        data.qpos[44 * number : 44 * number + 3] = 0.05 * number, 0.0, 0.93
    mujoco.mj_forward(model, data)
    root = model.body_rootid[model.geom_bodyid[data.contact.geom]]
    found = {tuple(sorted(pair)) for pair in root.tolist()}
    roots = sorted({int(one) for one in model.body_rootid} - {0})
    assert len(roots) == count
    others = {(a, b) for a in roots for b in roots if a < b}
    assert others <= found
    assert {(0, one) for one in roots} <= found  # floor and pads
    touched = {model.geom(int(g)).name for pair in data.contact.geom for g in pair}
    assert {"floor", *(pad.name for pad in pads)} <= touched
    own = [pair for pair, (a, b) in zip(data.contact.geom.tolist(), root.tolist()) if a == b]
    listed = {tuple(sorted(pair)) for pair in zip(model.pair_geom1.tolist(), model.pair_geom2.tolist())}
    assert all(tuple(sorted(pair)) in listed for pair in own)  # only what the model file lists


def test_more_bodies_than_the_bits_tell_apart_are_refused() -> None:
    for count in (0, BODY_LIMIT + 1):
        with pytest.raises(SettingError, match=rf"{count} bodies in a scene; valid: 1 to 511 \(the 9 collision bits"):
            build_scene(SceneSettings((humanoid(),) * count))


@pytest.mark.parametrize(("friction", "holds"), [(0.3, 0.3), (0.6, 0.6), (1.0, 1.0), (1.4, 1.4)])
@pytest.mark.parametrize("count", [1, 2])
def test_the_friction_of_the_floor_is_that_of_soles_on_it(count: int, friction: float, holds: float) -> None:
    model = build_scene(SceneSettings(bodies=(humanoid(),) * count, friction=friction))
    data = mujoco.MjData(model)
    for number in range(count):
        data.qpos[number * humanoid().nq :][: humanoid().nq] = humanoid().standing_qpos
        data.qpos[number * humanoid().nq] += 2.0 * number
    data.qpos[2 :: humanoid().nq] -= 0.005
    mujoco.mj_forward(model, data)
    floor = model.geom("floor").id
    found = [contact.friction[0] for contact in data.contact if floor in contact.geom]
    assert len(found) >= 6 * count
    np.testing.assert_allclose(found, holds)


@pytest.mark.parametrize("friction", [0.05, 1.0, 1.4])
def test_the_floor_is_as_slippery_as_was_asked_for(friction: float) -> None:
    model = build_scene(SceneSettings(friction=friction))
    data = mujoco.MjData(model)
    data.qpos[2] -= 0.002
    mujoco.mj_forward(model, data)
    floor = (data.contact.geom == model.geom("floor").id).any(axis=1)
    assert floor.sum() == 8
    np.testing.assert_array_equal(data.contact.friction[floor, :2], friction)
    np.testing.assert_allclose(data.contact.solref[floor, 0], 0.01)  # as hard as before


@pytest.mark.parametrize(("gloves", "hand"), [(False, 0.0066), (True, GLOVE_S)])
def test_bodies_are_as_hard_to_each_other_as_their_parts_and_floor_and_obstacles_as_they_were(
    gloves: bool, hand: float
) -> None:
    """Two bodies in one place, in the floor and in a box: everything touches everything."""
    box = Obstacle("box", (0.0, 0.0, 0.9), (0.3, 0.3, 0.3))
    model = build_scene(SceneSettings((humanoid(), humanoid()), (box,), gloves=gloves))
    data = mujoco.MjData(model)
    for number in range(2):
        own = data.qpos[number * humanoid().nq :][: humanoid().nq]
        own[:] = humanoid().standing_qpos
        own[2] -= 0.01
    mujoco.mj_forward(model, data)
    seen = set()
    for contact in data.contact:
        names = [model.geom(int(geom)).name for geom in contact.geom]
        if {"floor", "box"} & set(names):
            assert tuple(contact.solref) == (0.01, 1.0)
            seen.add("fixed")
        elif {name[0] for name in names} == {"a", "b"}:
            parts = [name[2:].removeprefix("left_").removeprefix("right_") for name in names]
            wanted = {"head": 0.008, "shank": 0.008, "hand": hand, "forearm": 0.0066, "heel": 0.0066}
            if any("ball" in part or part == "toe" for part in parts):
                continue
            np.testing.assert_allclose(contact.solref, [np.mean([wanted.get(part, 0.01) for part in parts]), 0.5])
            seen |= {"bodies", *({"hand"} & set(parts))}
    assert seen == {"fixed", "bodies", "hand"}


@pytest.mark.parametrize("meet", [True, False])
def test_bodies_that_do_not_meet_pass_through_each_other_and_still_stand_on_the_floor(meet: bool) -> None:
    model = build_scene(SceneSettings((humanoid(), humanoid()), bodies_meet=meet))
    data = mujoco.MjData(model)
    for number in range(2):
        own = data.qpos[number * humanoid().nq :][: humanoid().nq]
        own[:] = humanoid().standing_qpos
        own[:3] += [0.1 * number, 0.0, -0.01]
    mujoco.mj_forward(model, data)
    root = model.body_rootid[model.geom_bodyid[data.contact.geom]]
    bodies = sorted({int(one) for one in model.body_rootid} - {0})
    pairs = {tuple(sorted(pair)) for pair in root.tolist()}
    assert (tuple(bodies) in pairs) == meet
    assert {(0, one) for one in bodies} <= pairs
