"""Seeded mutations of what a person or a calibration states: read in one process, thousands in a minute.

    python tests/faults/fuzz_stated.py FIRST_SEED COUNT

The files are session.toml, trial.toml, rig.toml, rest.csv and gauges.toml of a session without trials' pictures. What
is read is refused in lines of printable text, or accepted with finite numbers and sigmas of 0 or more; nothing else
is raised, nothing takes longer than 5 s. Prints a line for each mutation with which it was otherwise, then how many ended how.
"""

import dataclasses
import io
import shutil
import signal
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr
from pathlib import Path

import numpy as np

from bench.base.input_problems import InputProblems
from bench.cameras.measured_place import contradiction, place_line
from bench.gauges.gauges_file import given_gauges
from bench.session.given_lines import assumed_line
from bench.session.rig_file import hash_of_rig
from bench.session.session import load_session
from tests.faults.fuzz import BYTES, GAUGES, TEXT, TRIAL, small_base

# Reads a session; returns how that ended and a line on it.
Read = Callable[[Path], tuple[str, str]]
# [s] Of a processor: a file of a few lines is read in milliseconds.
_MOST_S = 5
# Of the mutations, those that put a value or a key in place of another; the rest change bytes.
_OF_VALUES = 0.6
# Files whose bytes are no text.
_BINARY = (".h5", ".slp", ".mat", ".tr4", ".whiskers", ".measurements")
_FIRST_LINE = "format = 1\nexact = true\n"
_REST_OF_WHISKER = {
    "curvature": "rest_curvature_per_mm = [1e-3, -2e-4]\n",
    "traced": 'rest_shape = "rest.csv"\n',
}
_LENGTH = "length_mm = 100.0\n"
_TRIAL = """moment_gain_sigma = 0.02
first_frame_s = 0.0
first_frame_sigma_s = 0.001
gauge_filter_Hz = 800.0
object_velocity_mm_s = [0.0, 0.0, 0.0]
follicle_roll_sigma_deg = 1.0
"""
_GAUGES_MORE = """offset_sigma_V = [0.001, 0.001]
matrix_sigma_Nmm_per_V = [[0.1, 0.1], [0.1, 0.1]]
C_sigma_Nmm2 = 10.0
full_scale_Nmm = [3.0, 3.0]
one_factor_Nmm_per_V = [11.0, 10.4]
covariance = [[0.01, 0, 0, 0], [0, 0.01, 0, 0], [0, 0, 0.01, 0], [0, 0, 0, 0.01]]
[without.b60_4]
matrix_Nmm_per_V = [[11.2, 0.3], [-0.2, 10.4]]
covariance = [[0.01, 0, 0, 0], [0, 0.01, 0, 0], [0, 0, 0.01, 0], [0, 0, 0, 0.01]]
"""
# Keys of any table, and values of any type, that stand in each other's place.
_KEYS = (
    "exact",
    "stretch_sigma",
    "square_sigma_mm",
    "moment_gain_sigma",
    "rest_curvature_per_mm",
    "rest_shape",
    "length_sigma_mm",
    "diameter_sigma_mm",
    "T_rig_board_sigma_mm",
    "T_rig_board_sigma_deg",
    "T_rig_board",
    "covariance_deg_mm",
    "measured_from",
    "covariance",
    "follicle_roll_deg",
    "at_mm",
    "without",
    '"a\\nb"',
)
_VALUES = (
    "true",
    "false",
    "nan",
    "-nan",
    "inf",
    "-inf",
    "0",
    "-0.0",
    "1e-320",
    "-1e-3",
    "1e200",
    "1e308",
    "9" * 30,
    "9" * 5000,
    '""',
    '"rest.csv"',
    '"../rest.csv"',
    '"rig.toml"',
    '"."',
    '"a\\u0000b"',
    '"a\\nb"',
    f'"{"x" * 5000}"',
    "[]",
    "[[]]",
    "[0, 0]",
    "[nan, 0.0]",
    "[1e300, 1e300]",
    "[0.01, 0.01]",
    "[1, 2, 3]",
    "[[0, 0], [0, 0]]",
    "[[inf, 0.0], [0.0, 1.0]]",
    "{}",
    "{a = 1}",
    "[{}]",
    "1979-05-27",
    "07:32:00",
)


def stated_base(folder: Path, rest: str) -> Path:
    """Make a session with all files that state something. rest: how its whisker's rest is stated."""
    (folder / rest).mkdir()
    base = small_base(folder / rest)
    shutil.rmtree(base / "trials" / TRIAL / "low")
    shutil.rmtree(base / "trials" / TRIAL / "high")
    (base / "cameras.toml").unlink()
    manifest = base / "session.toml"
    text = manifest.read_text()
    assert text.startswith(_FIRST_LINE)
    text = text.replace(_FIRST_LINE, "format = 1\nexact = false\n", 1)
    text = text.replace(_LENGTH, _LENGTH + "length_sigma_mm = 0.5\n" + _REST_OF_WHISKER[rest], 1)
    text = text.replace("legacy = false\n", "legacy = false\nstretch_sigma = 1e-3\n", 1)
    manifest.write_text(text)
    trial = base / "trials" / TRIAL / "trial.toml"
    trial.write_text(trial.read_text() + _TRIAL)
    (base / "gauges.toml").write_text(GAUGES + _GAUGES_MORE)
    (base / "rest.csv").write_text(_traced())
    (base / "rig.toml").write_text(_rig(base, text))
    return base


def _traced() -> str:
    """A whisker that lies s²/2000 aside, as rest.csv has it."""
    x_mm = np.linspace(0.0, 97.0, 12)
    rows = "".join(f"{x:.3f},{x * x / 2000:.3f},0.0\n" for x in x_mm)
    return f"x_mm,y_mm,z_mm\n{rows}"


def _rig(base: Path, manifest: str) -> str:
    """A rig.toml that agrees with the manifest's T_rig_board."""
    (pose,) = (line for line in manifest.splitlines() if line.startswith("T_rig_board = "))
    covariance = [[0.01 * (row == column) for column in range(6)] for row in range(6)]
    pictures = hash_of_rig(sorted((base / "boards" / "rig").iterdir()))
    return (
        f"{pose}\ncovariance_deg_mm = {covariance}\nrig_pictures = '{pictures}'\n"
        f"measured_from = ['the free strokes']\ntrials = ['{TRIAL}']\ntrial_files = '0123'\n"
    )


def stated_files(session: Path) -> list[Path]:
    """Return the files that are changed."""
    return sorted([*session.glob("*.toml"), *session.glob("*.csv"), *session.rglob("trial.toml")])


def mutate(session: Path, files: list[Path], rng: np.random.Generator) -> list[str]:
    """Make one or two changes to some files of a session; return what was done."""
    done = []
    for _ in range(int(rng.integers(1, 3))):
        path = files[int(rng.integers(len(files)))]
        if path.suffix == ".toml" and rng.random() < _OF_VALUES:
            ways = (another_value, another_key)
        else:
            ways = BYTES + TEXT if path.suffix not in _BINARY else BYTES
        way = ways[int(rng.integers(len(ways)))]
        path.write_bytes(way(path.read_bytes(), rng))
        done.append(f"{way.__name__} {path.relative_to(session).as_posix()}")
    return done


def another_value(data: bytes, rng: np.random.Generator) -> bytes:
    """A key has a value of another size or type."""
    lines = data.decode("utf-8", "replace").split("\n")
    with_key = [k for k, line in enumerate(lines) if " = " in line]
    if with_key:
        k = with_key[int(rng.integers(len(with_key)))]
        key = lines[k].partition(" = ")[0]
        lines[k] = f"{key} = {_VALUES[int(rng.integers(len(_VALUES)))]}"
    return "\n".join(lines).encode()


def another_key(data: bytes, rng: np.random.Generator) -> bytes:
    """A line more: a key of some table, with some value."""
    lines = data.decode("utf-8", "replace").split("\n")
    key = _KEYS[int(rng.integers(len(_KEYS)))]
    value = _VALUES[int(rng.integers(len(_VALUES)))]
    lines.insert(int(rng.integers(len(lines) + 1)), f"{key} = {value}")
    return "\n".join(lines).encode()


def read(session: Path) -> tuple[str, str]:
    """Read a session as `check` does before it opens a recording.

    Return how it ended ('refused', 'accepted', or what is wrong) and a line on it.
    """
    problems = InputProblems(stop_at_first=False)
    loaded = None
    gauges = None
    with problems.guard():
        loaded = load_session(session, problems)
        contradiction(loaded)
        assumed_line((loaded,))
        place_line(loaded)
        if loaded.whisker is not None:
            gauges = given_gauges(loaded)
    for line in (*problems.refusals, *problems.warnings):
        if not line.isprintable():
            return "unprintable line", repr(line)
    if problems.refusals:
        return "refused", problems.refusals[0]
    sigma = None if gauges is None else gauges.all.sigma
    numbers = [*_numbers("session", loaded), *_numbers("gauges", gauges), *_numbers("sigma", sigma)]
    for name, value in numbers:
        if not np.all(np.isfinite(value)):
            return "not finite", f"{name} = {value}"
        if "sigma" in name.rpartition(".")[2] and np.any(np.asarray(value) < 0):
            return "negative sigma", f"{name} = {value}"
    return "accepted", ""


def _numbers(name: str, thing: object) -> Iterator[tuple[str, float | np.ndarray]]:
    """Yield every number in a session with its name."""
    if dataclasses.is_dataclass(thing):
        for field in dataclasses.fields(thing):
            yield from _numbers(f"{name}.{field.name}", getattr(thing, field.name))
    elif isinstance(thing, dict):
        for key, part in thing.items():
            yield from _numbers(f"{name}[{key!r}]", part)
    elif isinstance(thing, (tuple, list)):
        for k, part in enumerate(thing):
            yield from _numbers(f"{name}[{k}]", part)
    elif isinstance(thing, (float, np.floating)) or (
        isinstance(thing, np.ndarray) and thing.dtype.kind == "f"
    ):
        yield name, thing


def _out_of_time(*_) -> None:
    raise TimeoutError(f"more than {_MOST_S} s")


def tried(session: Path, seed: int, files: list[Path], read: Read) -> tuple[str, str]:
    """Read a session with the seed's mutations, and undo them. Return how it ended and a line on it."""
    sound = {path: path.read_bytes() for path in files}
    done = "; ".join(mutate(session, files, np.random.default_rng(seed)))
    said = io.StringIO()
    signal.setitimer(signal.ITIMER_PROF, _MOST_S)
    try:
        with redirect_stderr(said), warnings.catch_warnings():
            warnings.simplefilter("error")
            how, line = read(session)
    except Exception as fault:
        place = traceback.extract_tb(fault.__traceback__)[-1]
        how = f"raised {type(fault).__name__}"
        line = f"{Path(place.filename).name}:{place.lineno}: {fault}"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
    for path, content in sound.items():
        path.write_bytes(content)
    return how, f"seed {seed}: {done}: {line[:300]}"


def fuzz(
    first: int, count: int, bases: list[Path], files_of: Callable[[Path], list[Path]], read: Read
) -> tuple[Counter, list[str]]:
    """Return how many mutations ended how, and a line for each that is neither accepted nor refused."""
    signal.signal(signal.SIGPROF, _out_of_time)
    ways: Counter = Counter()
    bad = []
    for base in bases:
        assert read(base) == ("accepted", ""), read(base)
    files = {base: files_of(base) for base in bases}
    for seed in range(first, first + count):
        base = bases[seed % len(bases)]
        how, line = tried(base, seed, files[base], read)
        ways[how] += 1
        if how not in ("accepted", "refused"):
            bad.append(f"{how}: {line}")
    return ways, bad


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        stated = [stated_base(Path(place), rest) for rest in _REST_OF_WHISKER]
        ended, wrong = fuzz(int(sys.argv[1]), int(sys.argv[2]), stated, stated_files, read)
    print(*wrong, dict(ended), sep="\n")
    sys.exit(bool(wrong))
