"""pytest plugin: the fixture `stability_regression`, with options as users of pytest-regressions know them.

It imports nothing of simprep until a test asks for the fixture. `--force-regen` and `--regen-all` are those of
pytest-regressions where that is installed.
"""

import re
from collections.abc import Callable, Generator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from simprep.physics.run import Run
    from simprep.regression.ensemble import Subject
    from simprep.regression.measured import Case
    from simprep.regression.tolerance import Tolerance

GROUP = "regressions"
REGENERATE = {
    "--force-regen": "Regenerate regression data files, failing tests with different data.",
    "--regen-all": "Regenerate all files, letting tests pass (use to regenerate everything in one run).",
}


def pytest_addoption(parser: pytest.Parser) -> None:
    """Options that are simprep's alone."""
    group = parser.getgroup(GROUP)
    group.addoption(
        "--stability-seeds",
        type=int,
        default=None,
        metavar="N",
        help="stability_regression: seeds 0 to N - 1 for functions of a seed (default 10, or what the test asks for).",
    )
    group.addoption(
        "--stability-reason",
        default=None,
        metavar="TEXT",
        help="stability_regression: why baselines are regenerated; kept in them.",
    )


@pytest.hookimpl(wrapper=True)
def pytest_load_initial_conftests(parser: pytest.Parser) -> Generator[None, None, None]:
    """Add the options that pytest-regressions has too, after every other plugin had its turn, and only if they are missing."""
    result = yield
    group = parser.getgroup(GROUP)
    for option, words in REGENERATE.items():
        try:
            group.addoption(option, action="store_true", default=False, help=words)
        except ValueError:  # another plugin has it already
            continue
    return result


@pytest.fixture
def stability_regression(request: pytest.FixtureRequest) -> "StabilityRegression":
    """Compares runs and other numbers with a baseline beside the test: `check` by bands, `golden` state by state."""
    return StabilityRegression(request)


class StabilityRegression:
    """What the fixture `stability_regression` gives.

    The baseline of a test is `MODULE/TEST.json` beside the test's module. Where it is missing, it is written and the
    test fails. `--force-regen` writes it anew and fails where numbers moved, `--regen-all` writes and passes.
    """

    def __init__(self, request: pytest.FixtureRequest) -> None:
        self._request = request
        self._used: set[Path] = set()

    def check(
        self,
        subject: "Subject | Callable[[int], Subject]",
        *,
        seeds: int | Sequence[int] | None = None,
        tolerances: "Sequence[str | Tolerance]" = (),
        false_alarm: float | None = None,
        strict: bool = False,
        basename: str | None = None,
    ) -> None:
        """Compare numbers with the baseline; fail with a table of what moved.

        Args:
            subject: a `Run` or `Motion` (its metrics), a mapping of names to numbers, or a function of a seed that gives
                one of them: an ensemble, whose numbers may move as far as chance explains.
            seeds: for a function; how many, from 0, or which. `--stability-seeds` overrides it.
            tolerances: what may move, as `simprep check --tolerance` takes it: `"mpjpe_mm=2"`, `"peak_*=5%"`.
            false_alarm: probability that this check alarms where nothing has changed; None for 0.001.
            strict: a change for the better fails too.
            basename: name of the baseline; None for the test's. A second check in a test needs one.
        """
        __tracebackhide__ = True
        from simprep.regression.ensemble import cases_by_seed

        cases = cases_by_seed(subject, self._seeds(seeds), self._request.node.name)
        self._compare(cases, tolerances, false_alarm, strict, basename)

    def golden(
        self, run: "Run", *, steps: int | None = None, tolerance: float = 1e-6, basename: str | None = None
    ) -> None:
        """Compare the states after a run's first steps with the baseline, in both directions.

        Args:
            run: of one body or several, at least that long.
            steps: how many, up to 100; None for 50. Later states differ between processors by chaos alone.
            tolerance: absolute and relative, of qpos, qvel and torque.
            basename: as of `check`.
        """
        __tracebackhide__ = True
        from simprep.regression.states import STEPS, states_of
        from simprep.regression.tolerance import Tolerance

        cases = states_of(run, STEPS if steps is None else steps)
        self._compare(cases, (Tolerance("*", tolerance, tolerance),), None, True, basename)

    def _compare(
        self,
        cases: "dict[str, Case]",
        tolerances: "Sequence[str | Tolerance]",
        false_alarm: float | None,
        strict: bool,
        basename: str | None,
    ) -> None:
        __tracebackhide__ = True
        from dataclasses import replace

        from simprep.regression.baseline import new_baseline, read_baseline, save_baseline
        from simprep.regression.compare import compare
        from simprep.regression.environment import here
        from simprep.regression.tables import as_text
        from simprep.regression.tolerance import parse_tolerance

        path = self._path(basename)
        wishes = tuple(parse_tolerance(one) if isinstance(one, str) else one for one in tolerances)
        option = self._request.config.getoption
        everything, force = option("--regen-all", False), option("--force-regen", False)
        measured, reason = here(cases), option("--stability-reason", None)
        former = read_baseline(path) if path.is_file() else None
        if former is None:
            save_baseline(new_baseline(measured, reason or "first baseline", None, wishes, false_alarm), path)
            if not everything:
                pytest.fail(f"no baseline yet, written now; look at it and run again:\n- {path}", pytrace=False)
            return
        patterns = {one.pattern for one in wishes}
        kept = tuple(one for one in former.tolerances if one.pattern not in patterns)
        baseline = replace(
            former, tolerances=(*wishes, *kept), false_alarm=former.false_alarm if false_alarm is None else false_alarm
        )
        comparison = compare(measured, baseline, strict)
        if everything or (force and comparison.failures):
            words = reason or f"pytest {'--regen-all' if everything else '--force-regen'}"
            save_baseline(new_baseline(measured, words, former, wishes, false_alarm), path)
        if comparison.failures and not everything:
            after = f"\nwritten anew, as --force-regen is set:\n- {path}" if force else f"\nbaseline: {path}"
            pytest.fail(
                f"{len(comparison.failures)} numbers moved\n{as_text(comparison, baseline)}{after}", pytrace=False
            )

    def _seeds(self, wished: int | Sequence[int] | None) -> tuple[int, ...]:
        from simprep.regression.ensemble import SEEDS

        asked = self._request.config.getoption("--stability-seeds", None)
        if asked is not None and asked < 1:
            raise pytest.UsageError(f"--stability-seeds {asked}; valid: 1 or more")
        chosen = asked or (SEEDS if wished is None else wished)
        return tuple(range(chosen)) if isinstance(chosen, int) else tuple(chosen)

    def _path(self, basename: str | None) -> Path:
        module = self._request.path
        name = basename or re.sub(r"[\W]", "_", self._request.node.name)
        path = module.parent / module.stem / f"{name}.json"
        if path in self._used:
            raise pytest.UsageError(f"two checks of one test share the baseline {path.name}; give one a basename")
        self._used.add(path)
        return path
