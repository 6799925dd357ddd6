"""One adjustment over all cameras and all board views: Levenberg–Marquardt with the board poses eliminated.

Every observation is a corner of the board, seen by one camera in one view. Parameters:

- of each camera, CAMERA_COLUMNS: nine of the lens, w and v of its pose, clock offset and readout time (17);
- of the board, BOARD_COLUMNS: relative size, warp along x and y (3);
- of each view: w and v of the board's pose (6).

A view touches only the cameras that saw it, so its six parameters are eliminated from the normal equations
first (Schur complement). The work grows linearly with views; what is left to solve is as small as the
cameras are few. Poses move as T ← (Exp(w) R, t + v). The inverse of the reduced matrix is the covariance of
what is kept.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from vision import lens as lens_model
from vision.rotation import exp_rotation, log_rotation, skew

CAMERA_COLUMNS = (
    *lens_model.LENS_TERMS, "w_x", "w_y", "w_z", "v_x", "v_y", "v_z", "clock_offset_s", "readout_s",
)  # fmt: skip
BOARD_COLUMNS = ("scale", "warp_x_mm", "warp_y_mm")
N_CAMERA, N_BOARD, N_VIEW = len(CAMERA_COLUMNS), len(BOARD_COLUMNS), 6
POSE = slice(9, 15)
CLOCK = slice(15, 17)


@dataclass(frozen=True, eq=False)
class Sightings:
    """What was seen, a row a corner: camera, view, corner (n,) int, px (n, 2), sigma_px (n,), time_s (n,).

    time_s is the picture's time after the view's own time: 0 where cameras are triggered together or a view
    has one camera. Rows are kept sorted by view and camera.
    """

    camera: np.ndarray
    view: np.ndarray
    corner: np.ndarray
    px: np.ndarray
    sigma_px: np.ndarray
    time_s: np.ndarray

    def __len__(self) -> int:
        return len(self.camera)

    def chosen(self, which: np.ndarray) -> "Sightings":
        """The rows that the mask or index array names, in their order."""
        return Sightings(*(getattr(self, name)[which] for name in self.__dataclass_fields__))

    def shot_starts(self) -> np.ndarray:
        """First row of each shot, a shot being one camera's picture of one view."""
        change = (np.diff(self.view) != 0) | (np.diff(self.camera) != 0)
        return np.concatenate([[0], np.flatnonzero(change) + 1])


@dataclass(frozen=True, eq=False)
class State:
    """All parameters. lens (C, 9); T_camera_world (C, 3, 4); T_world_board (V, 3, 4); board (3,):
    BOARD_COLUMNS; clock (C, 2): offset and readout, s. rates (V, 6): how the board turns (rad/s) and
    travels (mm/s), taken as known.
    """

    lens: np.ndarray
    T_camera_world: np.ndarray
    T_world_board: np.ndarray
    board: np.ndarray = field(default_factory=lambda: np.zeros(N_BOARD))
    clock: np.ndarray | None = None
    rates: np.ndarray | None = None

    def __post_init__(self):
        if self.clock is None:
            object.__setattr__(self, "clock", np.zeros((len(self.lens), 2)))

    def globals(self) -> np.ndarray:
        """The values that priors speak of, (17 C + 3,); poses stand as 0."""
        per_camera = np.zeros((len(self.lens), N_CAMERA))
        per_camera[:, :9], per_camera[:, CLOCK] = self.lens, self.clock
        return np.concatenate([per_camera.ravel(), self.board])

    def stepped(self, global_step: np.ndarray, view_steps: np.ndarray) -> "State":
        """Moved by (17 C + 3,) and (V, 6)."""
        cameras = global_step[:-N_BOARD].reshape(-1, N_CAMERA)
        return replace(
            self,
            lens=self.lens + cameras[:, :9],
            T_camera_world=_moved(self.T_camera_world, cameras[:, POSE]),
            T_world_board=_moved(self.T_world_board, view_steps),
            board=self.board + global_step[-N_BOARD:],
            clock=self.clock + cameras[:, CLOCK],
        )


def _moved(T: np.ndarray, steps: np.ndarray) -> np.ndarray:
    R = exp_rotation(steps[:, :3]) @ T[:, :, :3]
    return np.concatenate([R, (T[:, :, 3] + steps[:, 3:])[:, :, None]], axis=2)


@dataclass(frozen=True, eq=False)
class Knowledge:
    """What is known beside the pictures, and what is held.

    free: (17 C + 3,) bool. mean, sigma: (17 C + 3,) of independent observations of the global parameters,
    sigma inf where there is none (poses: always inf). view_free: (V,) bool. pose_view, pose_T (3, 4),
    pose_sigma (6,): one view whose pose was measured (the board on the rig), in w rad and v mm; pose_view
    is None where there is none.
    """

    free: np.ndarray
    mean: np.ndarray
    sigma: np.ndarray
    view_free: np.ndarray
    pose_view: int | None = None
    pose_T: np.ndarray | None = None
    pose_sigma: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Solution:
    """The state of least cost, its residuals (n, 2) px (seen − predicted), and the covariance (17 C + 3
    squared) of the global parameters with all view poses marginalised; rows of held parameters are 0."""

    state: State
    residual_px: np.ndarray
    covariance: np.ndarray
    cost: float
    iterations: int
    converged: bool


def predict(state: State, seen: Sightings, corners_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pixels (n, 2) and their Jacobian (n, 2, 26): the seeing camera's 17 columns, the board's 3, the
    view's 6.
    """
    px, J = np.empty((len(seen), 2)), np.empty((len(seen), 2, N_CAMERA + N_BOARD + N_VIEW))
    points, by_board = _printed(state, seen, corners_mm)
    for camera in np.unique(seen.camera):
        rows = np.flatnonzero(seen.camera == camera)
        px[rows], J[rows] = _predict_one(state, camera, seen.chosen(rows), points[rows], by_board[rows])
    return px, J


def _printed(state: State, seen: Sightings, corners_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Board points (n, 3) in the board frame and d point / d (scale, warp_x, warp_y) (n, 3, 3).

    Warp after mrcal: z = warp_x (1 − x²) + warp_y (1 − y²), x and y from −1 to 1 over the corners.
    """
    half = np.maximum(np.ptp(corners_mm[:, :2], axis=0) / 2, 1e-9)
    unit = (corners_mm[:, :2] - corners_mm[:, :2].mean(axis=0)) / half
    by_board = np.zeros((len(corners_mm), 3, N_BOARD))
    by_board[:, :, 0] = corners_mm
    by_board[:, 2, 1:] = 1.0 - unit**2
    points = corners_mm + by_board @ state.board
    return points[seen.corner], by_board[seen.corner]


def _predict_one(state: State, camera: int, seen: Sightings, points: np.ndarray, by_board: np.ndarray):
    T_board, T_camera = state.T_world_board[seen.view], state.T_camera_world[camera]
    turned = np.einsum("nij,nj->ni", T_board[:, :, :3], points)
    travel, velocity = _travel(state, camera, seen, turned)
    world = turned + T_board[:, :, 3] + travel
    R = T_camera[:, :3]
    in_camera = world @ R.T
    px, by_x, by_lens = lens_model.project_with_jacobians(in_camera + T_camera[:, 3], state.lens[camera])
    by_world = by_x @ R
    by_time = by_world @ velocity[:, :, None]
    rows = _row_share(seen.px, state.lens[camera])[:, None, None]
    columns = [by_lens, -by_x @ skew(in_camera), by_x, by_time, by_time * rows]
    columns += [by_world @ T_board[:, :, :3] @ by_board, -by_world @ skew(turned), by_world]
    return px, np.concatenate(columns, axis=2)


def _travel(state: State, camera: int, seen: Sightings, turned: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far each point has moved since the view's own time, mm, and its velocity, mm/s; (n, 3) both."""
    if state.rates is None:
        return np.zeros_like(turned), np.zeros_like(turned)
    rates = state.rates[seen.view]
    velocity = np.cross(rates[:, :3], turned) + rates[:, 3:]
    offset_s, readout_s = state.clock[camera]
    elapsed = seen.time_s + offset_s + readout_s * _row_share(seen.px, state.lens[camera])
    return velocity * elapsed[:, None], velocity


def _row_share(px: np.ndarray, lens: np.ndarray) -> np.ndarray:
    """Place of a row between the picture's top (−½) and bottom (½), taking the principal point as its
    middle.
    """
    return (px[:, 1] - lens[3]) / (2 * lens[3])


def robust_weight(squared: np.ndarray, width: float) -> np.ndarray:
    """Cauchy's weight of a corner whose squared residual, in sigmas, is `squared`; all 1 for infinite
    width.
    """
    return 1.0 / (1.0 + squared / width**2)


def robust_cost(squared: np.ndarray, width: float) -> np.ndarray:
    """Cauchy's cost, width² log(1 + u²/width²); the square itself for infinite width."""
    return squared if np.isinf(width) else width**2 * np.log1p(squared / width**2)


@dataclass(frozen=True, eq=False)
class _Normal:
    """Normal equations: A (G, G), a (G,) of the globals; B (V, G, 6); C (V, 6, 6), c (V, 6) of the views."""

    A: np.ndarray
    a: np.ndarray
    B: np.ndarray
    C: np.ndarray
    c: np.ndarray
    cost: float
    residual_px: np.ndarray


def _normal_equations(
    state: State, seen: Sightings, corners_mm: np.ndarray, known: Knowledge, width: float
) -> _Normal:
    px, J = predict(state, seen, corners_mm)
    residual = seen.px - px
    squared = np.sum(residual**2, axis=1) / seen.sigma_px**2
    if not np.all(np.isfinite(squared)):
        return _Normal(*(None,) * 5, cost=np.inf, residual_px=residual)
    root = np.sqrt(robust_weight(squared, width)) / seen.sigma_px
    J, r = J * root[:, None, None], residual * root[:, None]
    blocks = np.add.reduceat(
        J.transpose(0, 2, 1) @ np.concatenate([J, r[:, :, None]], axis=2), seen.shot_starts()
    )
    normal = _assemble(blocks, seen, len(state.lens), len(state.T_world_board))
    cost = float(np.sum(robust_cost(squared, width)))
    return _with_knowledge(normal, cost, residual, state, known)


def _assemble(blocks: np.ndarray, seen: Sightings, n_cameras: int, n_views: int) -> tuple[np.ndarray, ...]:
    """Adds each shot's block (26 × 27, the last column being the gradient) where its parameters stand."""
    starts, size = seen.shot_starts(), N_CAMERA * n_cameras + N_BOARD
    camera, view = seen.camera[starts], seen.view[starts]
    own = N_CAMERA * camera[:, None] + np.arange(N_CAMERA)
    shared = np.broadcast_to(np.arange(size - N_BOARD, size), (len(starts), N_BOARD))
    columns, m = np.concatenate([own, shared], axis=1), N_CAMERA + N_BOARD
    A, a = np.zeros((size, size)), np.zeros(size)
    B, C, c = np.zeros((n_views, size, 6)), np.zeros((n_views, 6, 6)), np.zeros((n_views, 6))
    np.add.at(A, (columns[:, :, None], columns[:, None, :]), blocks[:, :m, :m])
    np.add.at(a, columns, blocks[:, :m, -1])
    np.add.at(B, (view[:, None, None], columns[:, :, None], np.arange(6)), blocks[:, :m, m:-1])
    np.add.at(C, view, blocks[:, m:, m:-1])
    np.add.at(c, view, blocks[:, m:, -1])
    return A, a, B, C, c


def _with_knowledge(parts, cost: float, residual: np.ndarray, state: State, known: Knowledge) -> _Normal:
    """Adds the observations beside the pictures, and takes out what is held."""
    A, a, B, C, c = parts
    weight = 1.0 / known.sigma**2
    miss = known.mean - state.globals()
    miss[weight == 0] = 0.0
    A = A + np.diag(weight)
    a = a + weight * miss
    cost += float(np.sum(weight * miss**2))
    if known.pose_view is not None and known.view_free[known.pose_view]:
        T, information = state.T_world_board[known.pose_view], 1.0 / known.pose_sigma**2
        off = -pose_difference(known.pose_T, T)
        C[known.pose_view] += np.diag(information)
        c[known.pose_view] += information * off
        cost += float(np.sum(information * off**2))
    held = ~known.view_free | (np.einsum("vii->v", C) == 0)
    B[held], c[held], C[held] = 0.0, 0.0, np.eye(6)
    return _Normal(A, a, B, C, c, cost, residual)


def pose_difference(T_from: np.ndarray, T_to: np.ndarray) -> np.ndarray:
    """(w, v) that moves one pose to the other: T_to = (Exp(w) R_from, t_from + v). (6,) rad and mm."""
    return np.concatenate([log_rotation(T_to[:, :3] @ T_from[:, :3].T), T_to[:, 3] - T_from[:, 3]])


def _solve_step(normal: _Normal, free: np.ndarray, damping: float) -> tuple[np.ndarray, np.ndarray]:
    """Marquardt's step of the globals (G,) and the views (V, 6)."""
    raise_by = 1.0 + damping
    C = normal.C.copy()
    np.einsum("vii->vi", C)[...] *= raise_by
    reduced, gradient, BC = _eliminate(normal, C, free)
    np.einsum("ii->i", reduced)[...] += damping * np.diag(normal.A)[free]
    step = np.zeros(len(free))
    step[free] = _scaled_solve(reduced, gradient)
    views = np.linalg.solve(C, normal.c[:, :, None])[:, :, 0] - np.einsum("vgi,g->vi", BC, step[free])
    return step, views


def _eliminate(normal: _Normal, C: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Schur complement: reduced matrix and gradient of the free globals, and B C⁻¹ (V, F, 6)."""
    B = normal.B[:, free]
    BC = np.linalg.solve(C, B.transpose(0, 2, 1)).transpose(0, 2, 1)
    flat, flat_BC = (M.transpose(1, 0, 2).reshape(B.shape[1], 6 * len(B)) for M in (B, BC))
    reduced = normal.A[np.ix_(free, free)] - flat_BC @ flat.T
    return reduced, normal.a[free] - flat_BC @ normal.c.ravel(), BC


def _scale(matrix: np.ndarray) -> np.ndarray:
    diagonal = np.diag(matrix)
    return 1.0 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))


def _scaled_solve(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Solves with rows and columns scaled to a unit diagonal: fx is 10³, k1 is 10⁻¹."""
    if not len(vector):
        return vector
    scale = _scale(matrix)
    return scale * np.linalg.lstsq(matrix * np.outer(scale, scale), scale * vector, rcond=1e-14)[0]


def _inverse(matrix: np.ndarray) -> np.ndarray:
    scale = _scale(matrix)
    return np.linalg.pinv(matrix * np.outer(scale, scale), rcond=1e-14, hermitian=True) * np.outer(
        scale, scale
    )


def solve(
    state: State,
    seen: Sightings,
    corners_mm: np.ndarray,
    known: Knowledge,
    *,
    width: float = np.inf,
    max_iterations: int = 60,
    tolerance: float = 1e-9,
    between: Callable[[State], State] | None = None,
) -> Solution:
    """Least cost from `state`. width: of Cauchy's loss in sigmas, inf for least squares.

    tolerance: relative fall of the cost at which it is done. between: called after each accepted step, for
    what is taken as known within a step (the board's rates).
    """
    normal = _normal_equations(state, seen, corners_mm, known, width)
    damping, done, iteration = 1e-4, False, 0
    while not done and iteration < max_iterations and np.isfinite(normal.cost):
        iteration += 1
        tried = state.stepped(*_solve_step(normal, known.free, damping))
        trial = _normal_equations(tried, seen, corners_mm, known, width)
        if trial.cost <= normal.cost * (1 + 1e-13):
            done = normal.cost - trial.cost <= tolerance * (1e-12 + normal.cost)
            state, normal, damping = tried, trial, max(damping * 0.1, 1e-12)
            if between is not None:
                state = between(state)
                normal = _normal_equations(state, seen, corners_mm, known, width)
        else:
            damping *= 10.0
            done = damping > 1e8
    return _solution(state, normal, known, iteration, done)


def _solution(state: State, normal: _Normal, known: Knowledge, iterations: int, done: bool) -> Solution:
    covariance = np.zeros((len(known.free),) * 2)
    if np.isfinite(normal.cost) and known.free.any():
        reduced, _, _ = _eliminate(normal, normal.C, known.free)
        covariance[np.ix_(known.free, known.free)] = _inverse(reduced)
    return Solution(state, normal.residual_px, covariance, normal.cost, iterations, done)
