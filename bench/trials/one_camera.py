"""Distance, force and give by the shape that one camera sees of a whisk, without gauges (`estimator.seen_shape`).

It sees its own trial, as no other estimate does: its rows have a table and a line of their own (`one_camera.csv`).
"""

from bench.base.errors import BadInput
from bench.base.settings import OBJECT_REACH_MM, TILT_SIGMA_RAD, Settings
from bench.records.trial_result import ByOneCamera
from bench.session.session import Session
from bench.session.whisker import Whisker
from estimator.seen_shape import SeenShape, contact_of_shape
from vision.truth.records import WhiskTruth
from vision.truth.sight_lines import sights_of
from vision.truth.value import Value

NOT_SHOWN = "the camera shows nothing of this whisk's wire, or was left out"


def require_camera(session: Session, settings: Settings) -> None:
    """Raises BadInput where the one camera that is asked for took no pictures."""
    names = sorted({name for trial in session.trials for name in trial.camera_sources})
    if settings.one_camera is not None and settings.one_camera not in names:
        there = f"cameras are {', '.join(names)}" if names else "no trial has pictures"
        raise BadInput(f"--one-camera {settings.one_camera}: {there}")


def by_one_camera(truth: WhiskTruth, whisker: Whisker, settings: Settings) -> ByOneCamera | None:
    """None where no camera was asked for."""
    name = settings.one_camera
    if name is None:
        return None
    sights = None if truth.problem is None else sights_of(truth.problem, name)
    if sights is None:
        return ByOneCamera(name, status=truth.status if truth.problem is None else NOT_SHOWN)
    share = whisker.C_sigma_Nmm2 / whisker.C_Nmm2
    told = {"reach_mm": OBJECT_REACH_MM, "tilt_sigma_rad": TILT_SIGMA_RAD, "rigidity_share": share}
    said = contact_of_shape(SeenShape(**vars(sights)), settings.theta_rad, whisker.beam, **told)
    return ByOneCamera(
        name,
        Value(said.touch_rad, said.touch_sigma_rad),
        Value(said.d_x_mm, said.d_x_sigma_mm),
        Value(said.force_N, said.force_sigma_N),
        Value(said.moved_mm, said.moved_sigma_mm),
        *(said.stiffness_N_mm, said.stiffness_sigma_N_mm, said.stiffness_low_N_mm),
        said.status,
    )
