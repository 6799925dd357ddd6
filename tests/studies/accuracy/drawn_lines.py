"""Do intervals hold where every given is off by a draw of its assumed sigma? Sessions of line points, none painted.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/drawn_lines.py FOLDER [--count 100]
        [--before-deg 1.6] [--only GIVEN] [--square-off SHARE] [--causes]

A session: 14 views of the board for each of two cameras, three whisks by the rig's exact mechanics, each with its free
stroke of --before-deg. The wire's sag and set, corners, and lines of wire and bar are drawn with noise; lines are off
as a whole as the lamp makes them, alike in all whisks. The bench is as the protocol has it; what is stated of it is off
by a draw of each given's assumed sigma (`Assumed` in bench/session/manifest.py). Cameras are calibrated, placed by
T_rig_board and free strokes together, and the whisks fitted, as a session is. --only draws and states one given, all
others exact; "none" draws none. --square-off: every square is larger by a share than its draw has it. --causes prints
what each makes of d_x.
Seconds a session, a row of FOLDER's table each: interrupt it and go on.

Whisks of a session share their errors, so intervals are counted over sessions: one whisk of each, by its slope. With wide
strokes the square's draw is most of d_x's error, and a few sessions have a few draws: the last line averages over it.
"""

import argparse
import math
import sys
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import msgspec
import numpy as np
from scipy.stats import binomtest, norm

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.rig import build
from bench.rig.protocol import Protocol
from bench.rig.protocol_tables import CameraTable, TrialTable, WhiskerTable
from bench.rig.recording import Recording
from bench.session.givens import assumptions
from bench.session.manifest import BarKeys, BoardKeys, RigKeys, WhiskerKeys
from tests.studies.accuracy.board_scenes import BOARD, board_views, measured_pose, noisy, rig_view
from tests.studies.accuracy.rows import HALF_WIDTH_95, all_rows
from tests.studies.accuracy.scenes import (
    Scene,
    Sigmas,
    as_problem,
    begin,
    exact_cameras,
    line_points,
)
from vision.calibration import (
    MeasuredPose,
    Placement,
    by_board,
    by_strokes,
    combine,
    move_rig_frame,
    rescale,
)
from vision.calibration.calibrate import calibrate_cameras
from vision.calibration.views import BoardViews
from vision.fit.base_line import base_lines
from vision.fit.converged_fit import ConvergedFit
from vision.fit.covariance import shared_covariance
from vision.fit.problem import Problem, State
from vision.fit.scatter import inflated_by_residuals
from vision.fit.solve import LAST_SCALE, solve
from vision.geometry.base_lines import BaseLines
from vision.geometry.board import Board, printed_corners
from vision.geometry.camera import Cameras
from vision.geometry.rods import Bar, Wire
from vision.truth.whisk_fit import FREE_SHARED

GIVENS = ("placement", "square", "stretch", "bar", "wire", "length", "clock")
BETAS_DEG = (0.0, 30.0, 60.0)
D_X_MM = 60.0
# Slip is that of the frame nearest this pushing angle.
SLIP_AT_RAD = math.radians(3.0)
# [rad] Frames from so far before touch on make the truth, and all before touch the free stroke, as of a whisk.
NEAR_TOUCH_RAD = math.radians(3.5)
CAMERAS = [
    CameraTable(name="high", position_mm=(38.0, -175.0, 335.0)),
    CameraTable(
        name="low",
        position_mm=(98.0, -325.0, 120.0),
        target_mm=(53.0, 7.0, 0.0),
        focal_px=1932.0,
    ),
]
QUANTITIES = {"d_x_mm": 1.0, "touch_deg": 180 / math.pi, "beta_deg": 180 / math.pi, "slip_mm": 1.0}
OF_EACH = ("error", "sigma", "shared")
COLUMNS = (
    "seed",
    *(f"{name}_{beta:.0f}_{what}" for name in QUANTITIES for beta in BETAS_DEG for what in OF_EACH),
    "along_sigma_mm",
    "is_alarmed",
)
VIEWS, CLIPPED = 14, (4.0, 4.0, 4.0)
SCALES = (1e9,) * 4 + (10.0, 4.0, 4.0)


@dataclass(frozen=True)
class GivenSigmas:
    """What is assumed of each given; 0 of one that is exact."""

    place_mm: float
    place_rad: float
    square_mm: float
    stretch: float
    bar_mm: float
    wire_mm: float
    length_mm: float
    clock_frames: float

    @staticmethod
    def of(protocol: Protocol, drawn: Collection[str]) -> "GivenSigmas":
        """The assumed sigmas of those givens that are drawn."""

        def assumed(kind, key: str, value: float, name: str) -> float:
            return float(assumptions(kind)[key].sigma(value)) if name in drawn else 0.0

        whisker = protocol.whisker
        turn_deg = assumed(RigKeys, "T_rig_board_sigma_deg", 1.0, "placement")
        return GivenSigmas(
            place_mm=assumed(RigKeys, "T_rig_board_sigma_mm", 1.0, "placement"),
            place_rad=math.radians(turn_deg),
            square_mm=assumed(BoardKeys, "square_sigma_mm", BOARD.square_mm, "square"),
            stretch=assumed(BoardKeys, "stretch_sigma", 1.0, "stretch"),
            bar_mm=assumed(BarKeys, "diameter_sigma_mm", protocol.bar_diameter_mm, "bar"),
            wire_mm=assumed(WhiskerKeys, "diameter_sigma_mm", whisker.diameter_mm, "wire"),
            length_mm=assumed(WhiskerKeys, "length_sigma_mm", whisker.length_mm, "length"),
            clock_frames=0.5 if "clock" in drawn else 0.0,  # as `FrameTimes` has it, untold
        )


@dataclass(frozen=True, eq=False)
class Bench:
    """A session's bench as it is, its three whisks, and what is stated of it."""

    seed: int
    protocol: Protocol
    scenes: tuple[Scene, ...]
    sigmas: GivenSigmas
    printed_mm: np.ndarray
    board: Board
    on_rig: MeasuredPose
    wire: Wire
    bar: Bar
    late_rad: float

    @property
    def clock_sigma_rad(self) -> float:
        """The sigma of touch by the frames' clock."""
        return self.sigmas.clock_frames * math.radians(self.protocol.pictures.step_deg)


def make_bench(
    seed: int, before_deg: float, drawn: Collection[str], square_off: float = 0.0
) -> Bench:
    """A session drawn. Each given has a stream of its own: what is drawn does not depend on what else is."""
    protocol = _protocol(seed, before_deg)
    sigmas = GivenSigmas.of(protocol, drawn)
    streams = {name: draws_of(seed, name) for name in GIVENS}

    def off(name: str) -> float:
        return float(streams[name].standard_normal())

    scale = square_off + off("square") * sigmas.square_mm / BOARD.square_mm
    stretch = off("stretch") * sigmas.stretch
    T = build.T_rig_board(protocol)
    stated = measured_pose(T, sigmas.place_mm, sigmas.place_rad, streams["placement"])
    whisker = protocol.whisker
    wire = Wire(
        whisker.shape,
        whisker.length_mm + off("length") * sigmas.length_mm,
        whisker.diameter_mm + off("wire") * sigmas.wire_mm,
        sigmas.length_mm,
        sigmas.wire_mm,
    )
    return Bench(
        seed=seed,
        protocol=protocol,
        scenes=_scenes(seed, before_deg),
        sigmas=sigmas,
        printed_mm=printed_corners(BOARD.corners_mm, np.array([scale, stretch, 0.0, 0.0]))[0],
        board=replace(BOARD, square_sigma_mm=sigmas.square_mm, stretch_sigma=sigmas.stretch),
        on_rig=MeasuredPose(stated, sigmas.place_mm, sigmas.place_rad),
        wire=wire,
        bar=Bar(protocol.bar_diameter_mm + off("bar") * sigmas.bar_mm, sigmas.bar_mm),
        late_rad=off("clock") * sigmas.clock_frames * math.radians(protocol.pictures.step_deg),
    )


def draws_of(seed: int, name: str) -> np.random.Generator:
    """The stream of a session's given, of which a number alone takes the first draw."""
    return np.random.default_rng([seed, 30 + GIVENS.index(name)])


@lru_cache(maxsize=1)
def _scenes(seed: int, before_deg: float) -> tuple[Scene, ...]:
    """The whisks of a session before its exact cameras, whatever is stated of them."""
    protocol = _protocol(seed, before_deg)
    cameras = exact_cameras(protocol)
    scenes = []
    for number, run in enumerate(protocol.runs()):
        recording = Recording.make(run, np.random.default_rng([seed, 21, number]))
        scenes.append(Scene(seed, protocol, recording, cameras, Sigmas()))
    return tuple(scenes)


def _protocol(seed: int, before_deg: float) -> Protocol:
    """The rig of drawn_givens.py, its wire with a sag and a set of its own."""
    rng = np.random.default_rng([seed, 20])
    whisker = WhiskerTable(
        sag_mm=float(rng.uniform(0, 0.4)),
        set_y_mm=float(rng.normal(0, 0.6)),
        set_z_mm=float(rng.normal(0, 0.6)),
    )
    trial = TrialTable(beta_deg=list(BETAS_DEG), d_x_mm=D_X_MM, friction=0.185339)
    given = Protocol(name="drawn", whisker=whisker, cameras=CAMERAS, trials=[trial])
    pictures = msgspec.structs.replace(given.pictures, before_deg=before_deg)
    motor = msgspec.structs.replace(given.motor, before_deg=before_deg + 0.005)
    return msgspec.structs.replace(given, pictures=pictures, motor=motor)


def calibrated(bench: Bench) -> Cameras:
    """The cameras as they are calibrated from the print that is, by what is stated of it."""
    rng = np.random.default_rng([bench.seed, 22])
    corner_px = bench.scenes[0].sigmas.corner_px
    T = build.T_rig_board(bench.protocol)
    printed_mm = bench.printed_mm
    held = {}
    standing = {}
    sizes_px = {}
    for camera in bench.scenes[0].cameras:
        views = board_views(camera, VIEWS, rng, printed_mm=printed_mm)
        held[camera.name] = [noisy(view, corner_px, rng) for view in views]
        standing[camera.name] = noisy(rig_view(camera, T, printed_mm), corner_px, rng)
        sizes_px[camera.name] = camera.size_px
    views = BoardViews(held, sizes_px, standing)
    return calibrate_cameras(views, bench.board, bench.on_rig, triggered=True).cameras


@dataclass(frozen=True, eq=False)
class Fitted:
    """A whisk's fit, and the lines of its free stroke."""

    fit: ConvergedFit
    base: BaseLines | None


def fit_whisk(bench: Bench, scene: Scene, seen: Sequence, cameras: Cameras) -> Fitted:
    """A whisk fitted as on a trial: frames near touch make the truth, all before it the free stroke."""
    problem = as_problem(scene, cameras, bench.wire, bench.bar, seen)
    problem = replace(problem, motor_rad=scene.motor_rad + bench.late_rad)
    near = scene.motor_rad > scene.truth.touch - NEAR_TOUCH_RAD
    whole = problem
    problem = _during(whole, near)
    start = begin(problem)
    state, _ = solve(problem, start, scales=SCALES)
    problem = inflated_by_residuals(problem, state)
    state, _ = solve(problem, state, scales=CLIPPED)
    fit = ConvergedFit(problem, state)
    free = fit if np.all(near) else ConvergedFit(*_free_stroke(whole, problem, state))
    return Fitted(fit, base_lines(free))


def _during(problem: Problem, chosen: np.ndarray) -> Problem:
    """The problem in some of its frames (f,) bool."""
    number = np.cumsum(chosen) - 1
    seen = []
    for one in problem.seen:
        if one.frame < 0:
            seen.append(one)
        elif chosen[one.frame]:
            seen.append(replace(one, frame=int(number[one.frame])))
    return replace(
        problem,
        motor_rad=problem.motor_rad[chosen],
        touching=problem.touching[chosen],
        bent=problem.bent[chosen],
        seen=seen,
    )


def _free_stroke(whole: Problem, problem: Problem, state: State) -> tuple[Problem, State]:
    """All frames before touch, fitted as `vision.truth.whisk_fit.free_stroke` does."""
    alone = _during(whole, ~whole.bent)
    alone = replace(alone, seen=[one for one in alone.seen if one.frame >= 0])
    middle_mm = np.full(len(alone.motor_rad), 0.5 * alone.wire.length_mm)
    state = State(state.vector[: problem.first_bend], middle_mm)
    state, _ = solve(alone, state, scales=[LAST_SCALE] * 3)
    return inflated_by_residuals(alone, state, FREE_SHARED), state


def place(bench: Bench, cameras: Cameras, lines: Sequence[Sequence]) -> tuple[Cameras, Placement]:
    """The cameras in the rig frame of board and free strokes together, as `bench.trials.placing` moves them."""
    on_rig = bench.on_rig
    square_sigma = bench.sigmas.square_mm / BOARD.square_mm
    board = by_board(on_rig.T_rig_board, on_rig.sigma_mm, on_rig.sigma_rad, square_sigma)
    if on_rig.is_exact:
        return cameras, board
    exact = replace(board, covariance=np.zeros((6, 6)))
    here = move_rig_frame(cameras, board, exact)
    for _ in range(2):
        bases = []
        for scene, seen in zip(bench.scenes, lines):
            bases.append(fit_whisk(bench, scene, seen, here).base)
        both = combine(board, by_strokes([base for base in bases if base is not None]))
        here = move_rig_frame(here, exact, replace(both, covariance=exact.covariance))
        board = replace(board, step=board.step - both.step)
        both = replace(both, step=exact.step)
    here = move_rig_frame(here, exact, both)
    return rescale(here, on_rig.T_rig_board[:, 3], both), both


def session_row(
    seed: int, before_deg: float, drawn: Collection[str], square_off: float = 0.0
) -> dict:
    """The row of a session: errors, sigmas and their shared parts of each whisk."""
    bench = make_bench(seed, before_deg, drawn, square_off)
    lines = []
    for number, scene in enumerate(bench.scenes):
        own = np.random.default_rng([seed, 23, number])
        lines.append(line_points(scene, own, np.random.default_rng([seed, 24])))
    cameras, placement = place(bench, calibrated(bench), lines)
    along_sigma_mm = float(np.sqrt(placement.covariance[3, 3]))
    row: dict = {"seed": seed, "along_sigma_mm": along_sigma_mm}
    row["is_alarmed"] = float(bool(placement.alarm))
    for beta_deg, scene, seen in zip(BETAS_DEG, bench.scenes, lines):
        fitted = fit_whisk(bench, scene, seen, cameras)
        for name, values in _values(bench, scene, fitted).items():
            for what, value in zip(OF_EACH, values):
                row[f"{name}_{beta_deg:.0f}_{what}"] = QUANTITIES[name] * float(value)
    return row


def _values(bench: Bench, scene: Scene, fitted: Fitted) -> dict[str, tuple[float, float, float]]:
    """Errors, sigmas and shared parts by quantity."""
    measured, by = fitted.fit.measured, fitted.fit.by_parameter
    truth = scene.truth
    covariance = fitted.fit.fit_covariance
    shared = shared_covariance(fitted.fit)
    near = scene.motor_rad > truth.touch - NEAR_TOUCH_RAD
    at = int(np.argmin(np.abs(scene.motor_rad[near] - truth.touch - SLIP_AT_RAD)))
    pairs = {
        "d_x_mm": (measured.whisk["d_x"] - truth.d_x, by.whisk["d_x"], 0.0),
        "touch_deg": (
            measured.whisk["touch"] - truth.touch,
            by.whisk["touch"],
            bench.clock_sigma_rad,
        ),
        "beta_deg": (measured.whisk["beta"] - truth.beta, by.whisk["beta"], 0.0),
        "slip_mm": (measured.frame["slip"][at] - truth.slip[near][at], by.frame["slip"][at], 0.0),
    }
    found = {}
    for name, (error, rows, more) in pairs.items():
        sigma = math.hypot(math.sqrt(rows @ covariance @ rows), more)
        found[name] = (error, sigma, math.hypot(math.sqrt(rows @ shared @ rows), more))
    return found


def summary(rows: Sequence[dict]) -> Iterator[str]:
    """What share of the intervals holds by slope, with its 95 % interval; z; and the parts of sigma."""
    yield f"{len(rows)} sessions, {sum(row['is_alarmed'] for row in rows):.0f} with an alarm of the placement"
    for name in QUANTITIES:
        for beta in [f"{beta:.0f}" for beta in BETAS_DEG]:
            error, sigma, shared = (
                np.array([row[f"{name}_{beta}_{what}"] for row in rows]) for what in OF_EACH
            )
            z = error / sigma
            held = int(np.sum(np.abs(z) < HALF_WIDTH_95))
            low, high = binomtest(held, len(z)).proportion_ci(method="wilson")
            own = np.sqrt(np.maximum(sigma**2 - shared**2, 0.0))
            yield (
                f"{name:9s} beta {beta:>2s}: {100 * held / len(z):5.1f} % hold ({100 * low:.0f} to {100 * high:.0f}), "
                f"z {np.sqrt(np.mean(z**2)):.2f} RMS, mean {np.mean(z):+.2f}; error {np.sqrt(np.mean(error**2)):.4f} RMS, "
                f"stated {np.median(sigma):.4f}: own {np.median(own):.4f}, shared {np.median(shared):.4f}"
            )


def held_over_squares(rows: Sequence[dict]) -> str:
    """The share of d_x's intervals at the first slope that hold, each averaged over all draws of the square.

    d_x errs by its share of the square's error: what is left of a session's error is that of all else.
    """
    beta = f"{BETAS_DEG[0]:.0f}"
    sigma_mm = D_X_MM * assumptions(BoardKeys)["square_sigma_mm"].sigma(1.0)
    draws = np.array([draws_of(int(row["seed"]), "square").standard_normal() for row in rows])
    sigma = np.array([row[f"d_x_mm_{beta}_sigma"] for row in rows])
    rest = np.array([row[f"d_x_mm_{beta}_error"] for row in rows]) + sigma_mm * draws
    half = HALF_WIDTH_95 * sigma
    held = norm.cdf((half - rest) / sigma_mm) - norm.cdf((-half - rest) / sigma_mm)
    left = np.sqrt(np.median(sigma) ** 2 - sigma_mm**2)
    return (
        f"d_x_mm beta {beta}: {100 * held.mean():.1f} % hold, averaged over the square's draw ({np.sqrt(np.mean(draws**2)):.2f} "
        f"RMS here); without it error {np.sqrt(np.mean(rest**2)):.4f} RMS, stated {left:.4f}"
    )


def causes(seeds: Sequence[int], before_deg: float) -> Iterator[str]:
    """What each given by itself makes of d_x, a line each: its error over its draw, and what is stated of it.

    The errors of the same corners and lines with all givens exact are taken off. A placement has six draws, and a
    stretch is measured by the views, so that no error goes as its draw: of these, what is stated alone.
    """
    beta = f"{BETAS_DEG[0]:.0f}"
    exact = [session_row(seed, before_deg, ()) for seed in seeds]
    for name in GIVENS:
        made = []
        stated = []
        for seed, without in zip(seeds, exact):
            row = session_row(seed, before_deg, {name})
            change_mm = row[f"d_x_mm_{beta}_error"] - without[f"d_x_mm_{beta}_error"]
            made.append(change_mm / draws_of(seed, name).standard_normal())
            more = row[f"d_x_mm_{beta}_sigma"] ** 2 - without[f"d_x_mm_{beta}_sigma"] ** 2
            stated.append(math.sqrt(max(more, 0.0)))
        by_draw = (
            "" if name == "placement" else f"makes {np.sqrt(np.mean(np.square(made))):.4f} mm, "
        )
        yield f"{name:9s} {by_draw}stated {np.sqrt(np.mean(np.square(stated))):.4f} mm"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--first", type=int, default=0, help="seed of the first session")
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--before-deg", type=float, default=1.6)
    parser.add_argument("--only", choices=("none", *GIVENS))
    parser.add_argument("--square-off", type=float, default=0.0, metavar="SHARE")
    parser.add_argument("--causes", action="store_true", help="of d_x, by given")
    options = parser.parse_args()
    if options.causes:
        seeds = range(options.first, options.first + options.count)
        print(*causes(seeds, options.before_deg), sep="\n")
        return
    drawn: Collection[str] = GIVENS if options.only is None else {options.only}
    off = f"_{options.square_off:g}" if options.square_off else ""
    table = options.folder / f"{options.only or 'all'}_{options.before_deg:g}{off}.csv"
    rows = all_rows(
        table,
        COLUMNS,
        range(options.first, options.first + options.count),
        lambda seed: session_row(seed, options.before_deg, drawn, options.square_off),
    )
    print(*summary(rows), sep="\n")
    if "square" in drawn and not options.square_off:
        print(held_over_squares(rows))


if __name__ == "__main__":
    main()
