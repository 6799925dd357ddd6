"""Where the rig frame is, by the board and by the free strokes together.

The swing gives the rig frame (conventions: origin, z, x) by itself (`vision.calibration.swing`), as a turn w and shift
v of the frame that the board gave:

    x_board_rig = Exp(w) x_rig + v

Covariances say how well each knows it, and weigh the two.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtri

from vision.geometry.camera import Cameras
from vision.geometry.refusals import Refused
from vision.geometry.rotation import compose, exp_rotation, skew

# [chance] By which swing and board, both right, would disagree as much as calls for an alarm.
# Study: chosen.
FALSE_ALARM = 1e-3
# [mm] Where the swing alone places the rig it must fix the centre along the whisker as well as a
# ruler would, for d_x has it whole (`_BY_RULER_MM` of `bench/trials/placing.py`). Study: chosen.
_MOST_ALONG_SIGMA_MM = 1.0
# [mm] Beyond, the centre along the whisker is most of d_x's sigma, and a doubt asks for a wider
# stroke: nine in ten of d_x's errors with an exact board are below 0.044 mm. Study:
# path_traced.py.
_HELPED_ALONG_SIGMA_MM = 0.05
# [deg] Beyond, a swing's word on the axis is none: a narrow fan may lean any way about the
# whisker. Origin not known. Study: docs/cameras.md.
_MOST_AXIS_SIGMA_DEG = 3.0
# [1] Of the free strokes' width that is asked for: a fifth over what the sigma needs. Stated.
_OVER = 1.2
_COMPONENTS = ("w_x", "w_y", "w_z", "v_x", "v_y", "v_z")


@dataclass(frozen=True, eq=False)
class Placement:
    """The rig frame against the board's word of it: step (6,) = w rad, v mm, with its covariance (6, 6).

    rise_rad: elevation of the whisker's base above the plane of rotation (None where no swing was seen). width_rad: of
    the widest stroke. notes: what was learnt. alarm: how swing and board disagree, None where they do not.
    """

    step: np.ndarray
    covariance: np.ndarray
    rise_rad: float | None = None
    width_rad: float = 0.0
    notes: tuple[str, ...] = ()
    alarm: str | None = None

    @property
    def T_board_rig(self) -> np.ndarray:
        """(3, 4): rig coordinates to those of the rig frame that the board gave."""
        return np.column_stack([exp_rotation(self.step[:3]), self.step[3:]])

    @property
    def centre_mm(self) -> np.ndarray:
        """Centre of rotation in the frame that the board gave, (3,)."""
        return self.step[3:]

    @property
    def spread(self) -> str:
        """How well centre, axis and zero are known, in words."""
        sigma = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        across = np.hypot(sigma[4], sigma[5]) / np.sqrt(2)
        axis = np.degrees(max(sigma[0], sigma[1]))
        lean = (
            f"axis ± {axis:.3f} degrees" if axis < _MOST_AXIS_SIGMA_DEG else "axis not observable"
        )
        return (
            f"centre of rotation ± {across:.4f} mm across and ± {sigma[3]:.4f} mm along the whisker, {lean}, "
            f"encoder's zero {np.degrees(self.step[2]):+.3f} ± "
            f"{np.degrees(sigma[2]):.3f} degrees"
        )


def by_board(T_rig_board: np.ndarray, sigma_mm: float, sigma_rad: float) -> Placement:
    """What the board alone says: no step, and the covariance of its measured pose.

    T_rig_board errs by a shift and by a turn about the board's origin, per axis; at the rig's origin that turn shifts.
    """
    lever = np.eye(6)
    lever[3:, :3] = skew(T_rig_board[:, 3])
    return Placement(
        np.zeros(6), lever @ np.diag(np.repeat([sigma_rad**2, sigma_mm**2], 3)) @ lever.T
    )


def combine(board: Placement, swing: Placement) -> Placement:
    """Both, each by its covariance; with an alarm where they disagree by more than chance allows.

    A board taken as exact stays as it is; the alarm still speaks.
    """
    both = board.covariance + swing.covariance
    gain = np.linalg.solve(both, board.covariance).T
    step = board.step + gain @ (swing.step - board.step)
    covariance = board.covariance - gain @ board.covariance
    apart = swing.step - board.step
    square = float(apart @ np.linalg.solve(both, apart))
    alarm = _alarm(apart, np.sqrt(np.diag(both))) if square > chdtri(6, FALSE_ALARM) else None
    made = replace(swing, step=step, covariance=0.5 * (covariance + covariance.T), alarm=alarm)
    return replace(made, notes=(*swing.notes, f"With the board: {made.spread}."))


def check_swing_suffices(made: Placement) -> str:
    """'' where the swing alone fixes the centre well along the whisker, which is what distances count from; else
    a doubt that says how wide a stroke would. Raises Refused where a ruler would do better."""
    along = float(np.sqrt(made.covariance[3, 3]))
    if along <= _HELPED_ALONG_SIGMA_MM:
        return ""
    width = np.degrees(made.width_rad)
    # An apex is fixed as the fan is wide, and as the root of its frames, of which a wider one has more.
    needed = np.ceil(_OVER * width * (along / _HELPED_ALONG_SIGMA_MM) ** (2 / 3))
    asked = f"record free strokes of about {needed:.0f} degrees, or measure T_rig_board better"
    fixed = f"the free strokes are what places the rig, and {width:.1f} degrees fix the centre of rotation"
    if along > _MOST_ALONG_SIGMA_MM:
        raise Refused(
            f"{fixed} to {along:.2f} mm along the whisker; {_MOST_ALONG_SIGMA_MM:g} mm is needed: {asked}"
        )
    return f"{fixed} to {along:.3f} mm along the whisker only, which every d_x is off by: {asked}"


def _alarm(apart: np.ndarray, sigma: np.ndarray) -> str:
    """The component that disagrees most, in words."""
    worst = int(np.argmax(np.abs(apart) / sigma))
    words = {
        "w_x": "the axis leans about rig x",
        "w_y": "the axis leans about rig y",
        "w_z": "the encoder's zero is off",
        "v_x": "the centre lies along the whisker",
        "v_y": "the centre lies across the whisker",
        "v_z": "the centre lies along the axis",
    }
    scale, unit = (np.degrees(1.0), "degrees") if worst < 3 else (1.0, "mm")
    return (
        f"board and free stroke disagree: by the stroke {words[_COMPONENTS[worst]]} by {scale * apart[worst]:+.3f} ± "
        f"{scale * sigma[worst]:.3f} {unit} from where T_rig_board has it; check T_rig_board, the board's square_mm "
        "and the encoder"
    )


def placed(cameras: Cameras, before: Placement, after: Placement) -> Cameras:
    """The cameras in the rig frame of `after`, whose poses were made in that of `before` (see `by_board`).

    Their covariance loses the placement error that `before` gave to all of them in common and gains that of `after`.
    The swing is seen by the same cameras; that link is left out, which errs to the wide side.
    """
    moved = tuple(
        replace(camera, T_camera_rig=compose(camera.T_camera_rig, after.T_board_rig))
        for camera in cameras
    )
    shared = cameras.by_placement
    change = shared @ (after.covariance - before.covariance) @ shared.T
    covariance = _positive(cameras.covariance + change, np.sqrt(np.diag(cameras.covariance)))
    turned = np.kron(
        np.eye(2), after.T_board_rig[:, :3]
    )  # `after` counts along the old axes, the cameras along theirs
    return Cameras(moved, covariance, turned.T @ after.covariance @ turned)


def _positive(covariance: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Without what rounding left below zero where nearly all of a variance was taken off; scale: of each parameter."""
    scale = np.where(scale > 0, scale, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    return (vectors * np.maximum(values, 0.0)) @ vectors.T * np.outer(scale, scale)
