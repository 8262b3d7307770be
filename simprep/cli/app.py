"""`simprep app`: a live page on this machine."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from simprep.cli.output import BaseCommand, Json, Output, Quiet


@dataclass(frozen=True)
class AppCommand(BaseCommand):
    """Serve a page on this machine on which simulated characters are steered live: preparation and duel.

    Prints its address and goes on until Ctrl-C. Motions that are saved there go to the folder of -o, nowhere else.

    Example: simprep app --scene ball
    """

    scene: Annotated[str, tyro.conf.arg(metavar="NAME", help_behavior_hint="")] = "ball"
    """What is shown first: ball, opponents, course, empty, or "duel automatic", "duel interactive", "duel passive"."""

    arm: Annotated[str, tyro.conf.arg(metavar="NAME", help_behavior_hint="")] = "optimised"
    """How the character prepares: none, traditional, blended or optimised."""

    beside: Annotated[str | None, tyro.conf.arg(metavar="NAME", help_behavior_hint="")] = None
    """Another way of preparing, simulated and shown beside the first: the same scene, seed and commands."""

    preset: Annotated[str, tyro.conf.arg(metavar="NAME", help_behavior_hint="")] = "live"
    """Effort of the tracking controller: live, default or bake. The page shows how fast it runs."""

    controller: Annotated[str, tyro.conf.arg(metavar="NAME", help_behavior_hint="")] = "mpc"
    """Tracking controller: mpc, or pd, which is fast and falls."""

    seed: int = 0
    """Seed of the tracking controller's random numbers, and of fights."""

    host: str = "127.0.0.1"
    """Address to listen at. Anything but this machine's own lets others steer, and read what is saved by name."""

    port: int = 0
    """Port; 0 for a free one."""

    seconds: Annotated[float | None, tyro.conf.arg(metavar="FLOAT", help_behavior_hint="")] = None
    """End by itself after so long [s]."""

    out: Annotated[Path, tyro.conf.arg(aliases=("-o",), metavar="DIR", help_behavior_hint="")] = Path("results/app")
    """Folder for saved motions."""

    json: Json = False
    quiet: Quiet = False

    def _run(self, output: Output) -> dict[str, Any]:
        from simprep.app.app import App
        from simprep.app.session import Session, SessionSettings

        output.say("making the motion graph and the controller ...")
        session = Session(
            SessionSettings(self.scene, self.arm, self.preset, self.controller, self.seed, self.out, self.beside)
        )
        app = App(session, self.host, self.port)
        try:
            # also with --json and --quiet: without it the page cannot be found
            print(f"simprep app: {app.address} (Ctrl-C ends it)", file=sys.stderr, flush=True)
            output.say(
                "without a graphics card the page has half the resolution; /?fixedDpr=1 behind the address has all of it"
            )
            app.serve(self.seconds)
        except KeyboardInterrupt:
            output.say("stopped")
        finally:
            app.stop()
        return {"schema": "simprep.app/1", "address": app.address, "scene": session.settings.scene,
                "simulated_s": session.time}  # fmt: skip
