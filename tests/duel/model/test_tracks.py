"""From a two-person stream to what the transition model learns from."""

from dataclasses import replace

import numpy as np

from simprep.duel.model.tracks import pair_tracks
from simprep.duel.stream.stream import DuelStream, root_distance
from simprep.library.registry import library_motion
from simprep.motion.edit import at_origin, move
from simprep.motion.turns import turned


def test_tracks_of_two_who_face_each_other():
    one = replace(at_origin(library_motion("stand")), loop=False)
    stream = DuelStream((one, move(one, (1.5, 0.0), np.pi)))
    tracks = pair_tracks(stream)
    np.testing.assert_allclose(
        np.linalg.norm(np.diff(tracks.root[..., :2], axis=1)[:, 0], axis=1), root_distance(stream)
    )
    # The same pose seen from the own root: the other's place and direction leave no trace in it.
    np.testing.assert_allclose(tracks.joints[:, 0], tracks.joints[:, 1], atol=1e-9)
    assert tracks.joints.shape[2:] == (16, 3)
    heading = np.remainder(tracks.heading[:, 1] - tracks.heading[:, 0], 2 * np.pi)
    np.testing.assert_allclose(heading, np.pi, atol=1e-9)
    com = tracks.com - tracks.root
    np.testing.assert_allclose(turned(com[:, 1, :2], -np.pi), com[:, 0, :2], atol=1e-9)
