"""Options of every command that reads motion files of other programs."""

from pathlib import Path
from typing import Annotated, Literal

import tyro

Up = Annotated[
    Literal["x", "y", "z"] | None, tyro.conf.arg(help="Vertical axis of the file that is read; default: found.")
]
Scale = Annotated[
    float | None,
    tyro.conf.arg(
        metavar="FLOAT", help_behavior_hint="", help="Metres per length unit of the file that is read; default: found."
    ),
]
JointMap = Annotated[
    Path | None,
    tyro.conf.arg(
        metavar="FILE",
        help_behavior_hint="",
        help='JSON object {"our part": "joint of the file"} for joints that are not recognised by their names.',
    ),
]
FileFps = Annotated[
    float | None,
    tyro.conf.arg(
        metavar="FLOAT",
        help_behavior_hint="",
        help="Frames per second of the file that is read, where it does not state them, or states wrong ones.",
    ),
]
BodyModel = Annotated[
    Path | None,
    tyro.conf.arg(
        metavar="FILE",
        help_behavior_hint="",
        help="SMPL body model (.npz) of yours, for the bones of SMPL and AMASS files; default: those of a mean body.",
    ),
]
Clip = Annotated[
    str | None, tyro.conf.arg(metavar="NAME", help_behavior_hint="", help="Which clip of a file with several.")
]
