"""Downloading a collection from a local server: whole files, checksums on first use, resume, clear errors offline."""

import contextlib
import hashlib
import json
import socket
import sys
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
from motion_files import amc_text, asf_text

from simprep.cli.main import main
from simprep.errors import MissingExtraError
from simprep.library.entry import FAMILIES
from simprep.library.fetch import SUMS, FetchError, Recipe, Take, fetch, read_recipe
from simprep.library.user import find_entry, read_folder

TAKES = (Take("13_17", "punch", "boxing"), Take("13_11", "jump", "jump"), Take("16_01", "jump", "jump"))
SMALL = Recipe("cmu", "Test collection", "http://nowhere.invalid", 'free "as is"', TAKES)


class Handler(SimpleHTTPRequestHandler):
    """Serves files and notes what was asked for; breaks off in the middle of the files named in `broken`."""

    asked: list[str]
    broken: set[str]

    def do_GET(self):
        name = self.path.rpartition("/")[2]
        self.asked.append(name)
        if name in self.broken:
            self.send_response(200)
            self.send_header("Content-Length", "100000")
            self.end_headers()
            self.wfile.write(b":FULLY-SPECIFIED\n")
            return
        super().do_GET()

    def log_message(self, *args):
        pass


@pytest.fixture
def server(tmp_path, monkeypatch):
    """A server with the recipe's small collection; yields (url, its folder, handler)."""
    root = tmp_path / "server"
    for take in TAKES:
        (root / take.subject).mkdir(parents=True, exist_ok=True)
        (root / take.subject / f"{take.subject}.asf").write_text(asf_text())
        (root / take.subject / f"{take.name}.amc").write_text(amc_text(40))
    handler = type("Noting", (Handler,), {"asked": [], "broken": set()})
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(handler, directory=str(root))) as running:
        thread = threading.Thread(target=running.serve_forever, kwargs={"poll_interval": 0.02})
        thread.start()
        yield f"http://127.0.0.1:{running.server_port}", root, handler
        running.shutdown()
        thread.join()


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()} if folder.exists() else set()


def test_a_fetched_folder_is_a_library_and_nothing_comes_twice(server, tmp_path):
    url, root, handler = server
    folder = tmp_path / "cmu"
    steps = []
    first = fetch(SMALL, folder, url + "/", lambda name, done: steps.append(done))
    assert first.downloaded == SMALL.files()
    assert steps == [0, 1, 2, 3, 4, 5]
    assert names(folder) == {*SMALL.files(), SUMS, *(f"{take.name}.toml" for take in TAKES)}
    for file in SMALL.files():
        content = (folder / file).read_bytes()
        assert content == (root / file[:2] / file).read_bytes()
        assert f"{hashlib.sha256(content).hexdigest()}  {file}\n" in (folder / SUMS).read_text()
    said = {sidecar.name: (sidecar.family, sidecar.terms) for sidecar in read_folder(folder)}
    assert said == {f"cmu_{take.name}": (take.family, 'Test collection. free "as is"') for take in TAKES}
    motion = find_entry("cmu_13_17", folder).generate()
    assert (motion.name, motion.source) == ("cmu_13_17", "Acclaim file 13_17.amc")

    (folder / "13_17.toml").write_text('family = "kick"\nterms = "mine"\n')
    handler.asked.clear()
    again = fetch(SMALL, folder, url)
    assert again.kept == SMALL.files()
    assert handler.asked == []
    assert read_folder(folder)[1].family == "kick"


def test_what_is_lost_or_damaged_comes_again_and_a_changed_source_is_refused(server, tmp_path):
    url, root, handler = server
    folder = tmp_path / "cmu"
    fetch(SMALL, folder, url)
    (folder / "13_17.amc").write_text("damaged")
    (folder / "16.asf").unlink()
    handler.asked.clear()
    assert fetch(SMALL, folder, url).downloaded == ("13_17.amc", "16.asf")
    assert handler.asked == ["13_17.amc", "16.asf"]

    (root / "13" / "13_17.amc").write_text(amc_text(41))
    assert fetch(SMALL, folder, url).downloaded == ()  # what is there still matches
    (folder / "13_17.amc").unlink()
    before = names(folder)
    with pytest.raises(FetchError, match=r"13_17.amc is not the file whose checksum is kept in .*SHA256SUMS"):
        fetch(SMALL, folder, url)
    assert names(folder) == before


def test_a_break_leaves_whole_files_only_and_the_next_call_goes_on(server, tmp_path):
    url, _, handler = server
    folder = tmp_path / "cmu"
    handler.broken.add("13_11.amc")
    with pytest.raises(FetchError, match=r"13_11.amc cannot be downloaded .*; 2 of 5 files are in .*, run again"):
        fetch(SMALL, folder, url)
    assert names(folder) == {"13.asf", "13_17.amc", SUMS}
    handler.broken.clear()
    handler.asked.clear()
    assert fetch(SMALL, folder, url).kept == ("13.asf", "13_17.amc")
    assert handler.asked == ["13_11.amc", "16.asf", "16_01.amc"]


def test_a_missing_file_does_not_stop_the_others_and_a_web_page_is_refused(server, tmp_path):
    url, root, _ = server
    folder = tmp_path / "cmu"
    (root / "13" / "13_17.amc").unlink()
    with pytest.raises(FetchError, match=r"1 of 5 files are not there: .*13_17.amc: the server answers 404"):
        fetch(SMALL, folder, url)
    assert {sidecar.name for sidecar in read_folder(folder)} == {"cmu_13_11", "cmu_16_01"}
    (root / "13" / "13_17.amc").write_text("<html>please log in</html>")
    with pytest.raises(FetchError, match=r"13_17.amc is not an Acclaim file: it begins with '<html>"):
        fetch(SMALL, folder, url)
    assert "13_17.amc" not in names(folder)
    assert "13_17.amc" not in (folder / SUMS).read_text()


def test_offline_is_one_message_and_leaves_nothing(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    with contextlib.closing(socket.socket()) as free:
        free.bind(("127.0.0.1", 0))  # taken, but nobody listens
        url = f"http://127.0.0.1:{free.getsockname()[1]}"
        assert main(["library", "fetch", "cmu", "--url", url, "-o", str(tmp_path / "cmu"), "--json"]) == 2
    printed = capsys.readouterr()
    assert not printed.out
    assert printed.err.splitlines()[-1].startswith(f"simprep: {url}/13/13.asf cannot be downloaded (ConnectionError)")
    assert "offline" in printed.err
    assert "Traceback" not in printed.err
    assert not list((tmp_path / "cmu").glob("*"))
    assert main(["library", "fetch", "cmu", "--url", "ftp://x", "-o", str(tmp_path)]) == 2
    assert "--url 'ftp://x'; valid: http" in capsys.readouterr().err


def test_the_command_fetches_every_take_of_the_recipe(server, tmp_path, capsys):
    url, root, _ = server
    recipe = read_recipe("cmu")
    assert len(recipe.takes) == len({take.name for take in recipe.takes}) == 30
    assert {take.family for take in recipe.takes} <= set(FAMILIES)
    for take in recipe.takes:
        (root / take.subject).mkdir(exist_ok=True)
        for file, text in zip(take.files, (asf_text(), amc_text(2))):
            (root / take.subject / file).write_text(text)
    folder = tmp_path / "cmu"
    assert main(["library", "fetch", "cmu", "--url", url, "-o", str(folder), "--json"]) == 0
    printed = capsys.readouterr()
    content = json.loads(printed.out)
    assert content["takes"] == [take.name for take in recipe.takes]
    assert len(content["downloaded"]) == 30 + len({take.subject for take in recipe.takes})
    assert "mocap.cs.cmu.edu" in content["terms"]
    assert len(read_folder(folder)) == 30
    assert all("resold" in sidecar.terms for sidecar in read_folder(folder))


def test_without_pooch_the_message_says_what_to_install(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "pooch", None)  # importing it fails
    assert main(["library", "fetch", "cmu", "-o", str(tmp_path / "cmu")]) == 2
    assert capsys.readouterr().err == f"simprep: {MissingExtraError('downloading motions', 'fetch')}\n"
    assert not (tmp_path / "cmu").exists()
