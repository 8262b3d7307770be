"""The benchmark's long import: a file of so many minutes at 120 Hz, in a process of its own."""

import pytest

from bench import long_import


def test_a_long_import_is_measured() -> None:
    numbers = long_import(0.1)
    assert numbers["frames"] == 720
    assert 10 < numbers["import_fps"] < 1e6
    assert 50 < numbers["peak_rss_mb"] < 1000


def test_no_time_is_no_file(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    import bench

    monkeypatch.setattr("sys.argv", ["bench.py", "--import-bvh-minutes", "0"])
    with pytest.raises(SystemExit) as end:
        bench.main()
    assert end.value.code == 2
    assert "above 0, at most 60" in capsys.readouterr().err
