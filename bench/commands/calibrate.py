"""The verb `calibrate`: of cameras (bench/cameras), of gauges and of the rig (bench/workflows)."""

import argparse
from pathlib import Path

from bench.base.progress import begin_step
from bench.commands.options import (
    Verbs,
    add_out,
    add_recorded,
    add_verb,
    add_workers,
)


def add(verbs: Verbs) -> None:
    """Add the verb with `cameras`, `gauges`, `rig` and `angles` below it."""
    calibrate = verbs.add_parser(
        "calibrate",
        help="cameras from their board views, gauges from the deflection seen, the rig from its turning",
    )
    what = calibrate.add_subparsers(title="what", metavar="WHAT", required=True)
    _add_cameras(what)
    _add_gauges(what)
    _add_rig(what)
    _add_angles(what)


def _add_cameras(what: Verbs) -> None:
    """Add `calibrate cameras`."""
    verb = add_verb(
        what,
        "cameras",
        _run_cameras,
        "calibrate the cameras from boards/ and place them in the rig, with their uncertainty",
        "whisker-bench calibrate cameras fixtures/small-session --out cameras.toml",
    )
    add_recorded(verb)
    add_out(verb, "FILE", "cameras.toml to write; its covariance goes beside it as .npz")
    verb.add_argument(
        "--lenses",
        type=Path,
        metavar="FILE",
        help="camera file of caliscope, aniposelib, OpenCV, Kalibr, MATLAB (.mat) or mrcal, or a folder of such: its "
        "lenses are taken as exact and only placed in the rig",
    )
    verb.add_argument(
        "--names",
        default="",
        metavar="NAME,NAME",
        help="the session's names of that file's cameras, in its order, where it calls them otherwise",
    )
    verb.add_argument(
        "--format",
        default="",
        choices=("anipose", "caliscope", "kalibr", "matlab", "mrcal", "opencv"),
        help="write the cameras for that program, without uncertainties, in place of cameras.toml",
    )


def _add_gauges(what: Verbs) -> None:
    """Add `calibrate gauges`."""
    verb = add_verb(
        what,
        "gauges",
        _run_gauges,
        "calibrate the gauges against the deflection seen, with a certificate",
        "whisker-bench calibrate gauges fixtures/small-session --out gauges.toml",
    )
    add_recorded(verb)
    add_out(verb, "FILE", "gauges.toml to write; the certificate goes beside it as .pdf")
    verb.add_argument(
        "--all", action="store_true", help='all trials, not only those marked purpose = "gauge"'
    )
    add_workers(verb)


def _add_rig(what: Verbs) -> None:
    """Add `calibrate rig`."""
    verb = add_verb(
        what,
        "rig",
        _run_rig,
        "measure where the board on the rig stands, by free strokes and a marker on the hub",
        "whisker-bench calibrate rig recorded/2026-05-04",
    )
    add_recorded(verb)
    verb.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="file to write (default: rig.toml in SESSION, which evaluate then reads); a picture goes beside it as .png",
    )
    add_workers(verb)


def _add_angles(what: Verbs) -> None:
    """Add `calibrate angles`."""
    verb = add_verb(
        what,
        "angles",
        _run_angles,
        "find the motor's angle in each frame by the hub's marker or the whisker's base, without a motor log",
        "whisker-bench calibrate angles recorded/2026-05-04",
    )
    add_recorded(verb)
    add_workers(verb)


def _run_cameras(options: argparse.Namespace) -> int:
    """Calibrate the cameras; return the exit code."""
    begin_step(f"reading {options.session}, calibrating its cameras")
    from bench.cameras.calibrate_session import calibrate_cameras_command

    return calibrate_cameras_command(
        options.session,
        options.out,
        options.lenses,
        names=[name for name in options.names.split(",") if name],
        file_format=options.format,
        follow_links=options.follow_links,
    )


def _run_gauges(options: argparse.Namespace) -> int:
    """Calibrate the gauges; return the exit code."""
    begin_step(f"reading {options.session}")
    from bench.workflows.gauge_calibration import calibrate_gauges_command

    return calibrate_gauges_command(
        options.session,
        options.out,
        every_trial=options.all,
        workers=options.workers,
        follow_links=options.follow_links,
    )


def _run_rig(options: argparse.Namespace) -> int:
    """Measure the rig; return the exit code."""
    begin_step(f"reading {options.session}")
    from bench.workflows.rig_calibration import calibrate_rig_command

    return calibrate_rig_command(
        options.session,
        options.out,
        workers=options.workers,
        follow_links=options.follow_links,
    )


def _run_angles(options: argparse.Namespace) -> int:
    """Find the motor's angles; return the exit code."""
    begin_step(f"reading {options.session}")
    from bench.workflows.angle_calibration import calibrate_angles_command

    return calibrate_angles_command(
        options.session, workers=options.workers, follow_links=options.follow_links
    )
