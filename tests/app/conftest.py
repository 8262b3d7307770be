"""A session that is cheap to simulate: somebody who stands, held by servos alone."""

from dataclasses import replace

import pytest

from simprep.app.director import Caption, PieceDirector
from simprep.app.session import Session, SessionSettings
from simprep.humanoid_model import humanoid
from simprep.library import library_motion
from simprep.motion.edit import cut


class Standing(PieceDirector):
    """Stands, and says so."""

    def __init__(self):
        self.characters = (humanoid(),)
        self.asked = 0

    def first(self):
        stand = library_motion("stand")
        return (cut(replace(stand, loop=False), 0, 20),)

    def more(self, state):
        self.asked += 1
        return None

    def caption(self, time):
        return Caption(0.5, (f"stands at {time:.2f}",))


@pytest.fixture
def session(tmp_path):
    return Session(SessionSettings("ball", controller="pd", folder=tmp_path / "saved"), Standing)
