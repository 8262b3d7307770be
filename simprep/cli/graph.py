"""`simprep graph`: the motion graph of the library."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from simprep.cli.output import BaseCommand, Json, Output, Quiet


@dataclass(frozen=True)
class Graph(BaseCommand):
    """Build the hierarchical motion graph: core nodes of locomotion, target motions, and the transitions between them.

    Writes graph.json, and graph.png where it can be drawn.

    Example: simprep graph -o out/graph
    """

    threshold: float = 0.2
    """Largest distance of a transition [m]: RMS over the joints, velocities counting 0.1 s."""

    out: Annotated[Path, tyro.conf.arg(aliases=("-o",), metavar="DIR", help_behavior_hint="")] = Path("results/graph")
    """Folder for the results."""

    json: Json = False
    quiet: Quiet = False

    def _run(self, output: Output) -> dict[str, Any]:
        from simprep.controller.graph import GraphSettings
        from simprep.controller.graph_store import save_graph
        from simprep.controller.runtime.world import library_graph
        from simprep.library.registry import library_entries
        from simprep.report.gl import pictures_or_warning
        from simprep.report.graph_figure import plot_graph

        graph = library_graph(GraphSettings(threshold=self.threshold))
        files = [save_graph(graph, self.out / "graph.json")]
        with pictures_or_warning("no picture", output.warn):
            families = {entry.name: entry.family for entry in library_entries()}
            files.append(plot_graph(graph, self.out / "graph.png", families))
        kinds = dict(Counter(transition.kind for transition in graph.transitions))
        output.say(f"{len(graph.core)} core nodes ({', '.join(graph.core)}), {len(graph.targets)} targets")
        output.say(f"transitions: {', '.join(f'{count} {kind}' for kind, count in kinds.items())}")
        if graph.unreachable():
            output.say(f"no transition under {self.threshold:g} m into: {', '.join(graph.unreachable())}")
        if graph.dead_ends():
            output.say(f"no transition under {self.threshold:g} m out of: {', '.join(graph.dead_ends())}")
        output.say(f"written: {', '.join(map(str, files))}")
        return {
            "core": graph.core,
            "targets": len(graph.targets),
            "transitions": kinds,
            "unreachable": graph.unreachable(),
            "dead_ends": graph.dead_ends(),
            "files": [str(path) for path in files],
        }
