"""Downloading a collection of captured motions into a folder, which is then a user's library.

A collection is a recipe, a TOML file beside this module. The first download of a file writes its SHA-256 to
`SHA256SUMS` in the folder; later downloads of that file must match.
"""

import contextlib
import hashlib
import json
import os
import tempfile
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from simprep.errors import MissingExtraError, SettingError, SimprepError
from simprep.files import atomic_path

SUMS = "SHA256SUMS"
"""Checksums of a folder's files, in the format of `sha256sum -c`."""
TIMEOUT_S = 30.0
CHUNK_BYTES = 65536
SHOWN = 4
"""Missing files named in a message."""


class FetchError(SimprepError):
    """A download failed; the message says which, why, and what is already there."""


@dataclass(frozen=True)
class Take:
    """One recording of a collection.

    Attributes:
        name: `SUBJECT_NUMBER`, such as `13_17`.
        family: of the library.
        summary: what the person does.
    """

    name: str
    family: str
    summary: str

    @property
    def subject(self) -> str:
        """The person recorded, whose skeleton all their takes share."""
        return self.name.partition("_")[0]

    @property
    def files(self) -> tuple[str, str]:
        """Skeleton and motion."""
        return f"{self.subject}.asf", f"{self.name}.amc"


@dataclass(frozen=True)
class Recipe:
    """A collection and where it is.

    Attributes:
        name: of the collection; motions are called NAME_TAKE.
        title: of the collection.
        url: where the files are, as SUBJECT/FILE.
        terms: of use.
        takes: its recordings.
    """

    name: str
    title: str
    url: str
    terms: str
    takes: tuple[Take, ...]

    def files(self) -> tuple[str, ...]:
        """Every file once, a skeleton before its takes."""
        return tuple(dict.fromkeys(file for take in self.takes for file in take.files))


@dataclass(frozen=True)
class Fetched:
    """Files that came now (`downloaded`), and files that were there and match their checksums (`kept`)."""

    downloaded: tuple[str, ...]
    kept: tuple[str, ...]


def read_recipe(name: str) -> Recipe:
    """A recipe of the package, such as `cmu`."""
    content = tomllib.loads((Path(__file__).parent / f"{name}.toml").read_text(encoding="utf-8"))
    takes = tuple(Take(take, **said) for take, said in content.pop("takes").items())
    return Recipe(takes=takes, **content)


def fetch(
    recipe: Recipe, folder: Path, url: str | None = None, progress: Callable[[str, int], None] = lambda name, done: None
) -> Fetched:
    """Download the missing files of a collection, and write a sidecar beside every take without one.

    Files arrive whole or not at all. A file that no longer matches its checksum is downloaded again; a download that
    does not match is refused. Existing sidecars stay: they may hold events that the user has marked.

    Args:
        recipe: the collection.
        folder: where to; made if missing.
        url: another place with the same files; None for the recipe's.
        progress: receives the current file and the number of files done.

    Raises:
        MissingExtraError: pooch is not installed.
        SettingError: the folder cannot be written to, or the URL is not one.
        FetchError: the server cannot be reached, lacks a file, or sends another one than before.
    """
    pooch = _pooch()
    base = (recipe.url if url is None else url).rstrip("/")
    if not base.startswith(("http://", "https://")):
        raise SettingError(
            f"--url {url!r}; valid: http://... or https://..., below which the files are, as 13/13_17.amc"
        )
    sums = _read_sums(folder)
    downloaded: list[str] = []
    kept: list[str] = []
    missing: list[str] = []
    files = recipe.files()
    for number, file in enumerate(files):
        progress(file, number)
        known = sums.get(file)
        if known is not None and _sha256(folder / file) == known:
            kept.append(file)
            continue
        subject = file.partition(".")[0].partition("_")[0]
        try:
            _download(pooch, f"{base}/{subject}/{file}", folder, file, known)
        except _NotThereError as problem:
            missing.append(str(problem))
            continue
        except FetchError as problem:
            there = len(downloaded) + len(kept)
            raise FetchError(f"{problem}; {there} of {len(files)} files are in {folder}, run again to go on") from None
        downloaded.append(file)
        sums[file] = _sha256(folder / file) or ""
        with _writing(folder / SUMS) as path:
            path.write_text("".join(f"{value}  {name}\n" for name, value in sorted(sums.items())), encoding="utf-8")
    progress("", len(files))
    for take in recipe.takes:
        sidecar = folder / f"{take.name}.toml"
        if all(name in sums for name in take.files) and not sidecar.exists():
            with _writing(sidecar) as path:
                path.write_text(_sidecar(recipe, take), encoding="utf-8")
    if missing:
        more = "" if len(missing) <= SHOWN else f"; and {len(missing) - SHOWN} more"
        raise FetchError(f"{len(missing)} of {len(files)} files are not there: {'; '.join(missing[:SHOWN])}{more}")
    return Fetched(tuple(downloaded), tuple(kept))


class _NotThereError(FetchError):
    """The server answers, but not with this file."""


def _download(pooch: Any, url: str, folder: Path, file: str, known: str | None) -> None:
    from requests import RequestException

    try:
        folder.mkdir(parents=True, exist_ok=True)
        # apart from the folder itself: pooch takes any file of that name for the one wanted where no checksum is known
        with tempfile.TemporaryDirectory(dir=folder, prefix=".part") as apart:
            pooch.retrieve(url, known and f"sha256:{known}", file, apart, downloader=_downloader(pooch))
            os.replace(Path(apart) / file, folder / file)
    except RequestException as error:
        response = error.response
        if response is not None:
            raise _NotThereError(f"{url}: the server answers {response.status_code} {response.reason}") from None
        raise FetchError(f"{url} cannot be downloaded ({type(error).__name__}); is this machine offline?") from None
    except ValueError as error:  # pooch: the checksum differs
        if "hash" not in str(error):
            raise
        raise FetchError(
            f"{url} is not the file whose checksum is kept in {folder / SUMS} (sha256 {known}); nothing was replaced. "
            "Remove its line there if the change is meant"
        ) from None
    except OSError as error:
        raise SettingError(f"{folder} cannot be written to ({error.strerror})") from None


def _downloader(pooch: Any) -> Callable[..., None]:
    http = pooch.HTTPDownloader(timeout=TIMEOUT_S, chunk_size=CHUNK_BYTES)

    def download(url: str, output_file: str, manager: Any) -> None:
        http(url, output_file, manager)
        with open(output_file, "rb") as stream:
            head = stream.read(1_000_000).splitlines()
        first = next((line.strip() for line in head if line.strip() and not line.lstrip().startswith(b"#")), b"")
        if not first.startswith(b":"):  # a login page, say, whose checksum must not be kept
            raise FetchError(f"{url} is not an Acclaim file: it begins with {first[:40].decode(errors='replace')!r}")

    return download


def _pooch() -> Any:
    try:
        import pooch
    except ImportError:
        raise MissingExtraError("downloading motions", "fetch") from None
    pooch.get_logger().setLevel("WARNING")  # we say what happens ourselves
    return pooch


def _read_sums(folder: Path) -> dict[str, str]:
    path = folder / SUMS
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    except (FileNotFoundError, NotADirectoryError):
        return {}
    except OSError as error:
        raise FetchError(f"{path} cannot be read ({error.strerror})") from None
    sums = {}
    for number, line in enumerate(lines, 1):
        value, _, name = line.partition("  ")
        if len(value) != 64 or not name:
            raise FetchError(f"{path}, line {number}: {line[:80]!r}; valid: a SHA-256, two spaces, a file name")
        sums[name] = value
    return sums


def _sha256(path: Path) -> str | None:
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError:
        return None


@contextlib.contextmanager
def _writing(path: Path) -> Iterator[Path]:
    try:
        with atomic_path(path) as temporary:
            yield temporary
    except OSError as error:
        raise SettingError(f"{path} cannot be written ({error.strerror})") from None


def _sidecar(recipe: Recipe, take: Take) -> str:
    values: Mapping[str, str] = {
        "name": f"{recipe.name}_{take.name}",
        "family": take.family,
        "summary": take.summary,
        "terms": f"{recipe.title}. {recipe.terms}",
    }
    # JSON's strings are TOML's, for text without control characters
    lines = [f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in values.items()]
    return "\n".join([*lines, "# events = {target = 0.8, impact = 1.35}  # in seconds, once you have marked them", ""])
