"""The code that results come from, as a hash: part of every case's name, so that changed code means new cases."""

import ast
from functools import lru_cache
from pathlib import Path

import simprep
from simprep.library.cache import code_key

START = "study/sweep/measure.py"
"""What measures a case; all that it imports, directly or not, counts."""
PICTURES = "report"
"""The package that draws; it changes no number."""


@lru_cache(maxsize=1)
def results_code() -> str:
    """Hash of the code, of simprep and its packages, that results come from: 16 hexadecimal digits."""
    return code_key(result_sources())


def result_sources() -> tuple[str, ...]:
    """Files of simprep that results come from, by their paths in the package."""
    package = Path(simprep.__file__).parent
    found, waiting = set[str](), [START]
    while waiting:
        name = waiting.pop()
        if name in found or name.split("/")[0] == PICTURES:
            continue
        found.add(name)
        tree = ast.parse((package / name).read_text(encoding="utf-8"))
        for node in ast.walk(tree):  # imports within functions too
            if isinstance(node, ast.Import):
                modules = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and node.module:
                modules = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
            else:
                continue
            waiting += [file for module in modules for file in _files(package, module)]
    return tuple(sorted(found))


def _files(package: Path, module: str) -> list[str]:
    """The file of a module of simprep, and those of the packages that it is in, but for simprep itself; else nothing."""
    parts = module.split(".")
    if parts[0] != "simprep":
        return []
    tried = ["/".join(parts[1 : end + 1]) + "/__init__.py" for end in range(1, len(parts))]
    tried.append("/".join(parts[1:]) + ".py")
    return [name for name in tried if (package / name).is_file()]
