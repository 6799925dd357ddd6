"""Where the faces of a body stand to each other, to begin with.

Each camera is calibrated from single faces, as if each were a board of its own. A picture that shows
two faces then gives the place of one before the other.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from vision.boards.body import Body
from vision.boards.corners import Corners, by_face
from vision.boards.sufficiency import MIN_VIEWS, fixes_pose, without_strays
from vision.calibration.first_guess import chain_poses, has_pose
from vision.calibration.one_picture import calibrate_picture, first_lenses
from vision.calibration.views import BoardViews
from vision.geometry.board import Board
from vision.geometry.crop import Crop
from vision.geometry.refusals import Refused
from vision.geometry.rotation import invert_transform


def place_faces(views: BoardViews, board: Board) -> Board:
    """Return the board with its faces placed by pictures that show two; a plane as it is.

    Raises Refused where a face is in no picture, or in none with another face.
    """
    if not isinstance(board, Body):
        return board
    poses = _poses_by_face(views, board)
    for face, of_face in poses.items():
        if not of_face:
            raise Refused(
                f"no view shows the face of {_markers(board, face)} well: is it on the body (first_ids)?"
            )
    T_face_body = chain_poses(poses)
    for face in poses:
        if face not in T_face_body:
            raise Refused(
                f"the face of {_markers(board, face)} is in no picture with another face, so its place on the "
                "body is not known: record such pictures"
            )
    return board.placed(np.array([invert_transform(T_face_body[face]) for face in poses]))


def _markers(board: Body, face: int) -> str:
    """Return in words which markers are on a face."""
    first = board.first_ids[face]
    return f"markers {first} to {first + board.faces[face].marker_count - 1}"


def _poses_by_face(
    views: BoardViews, board: Body
) -> dict[int, Mapping[tuple[str, int], np.ndarray]]:
    """Return by face the poses T_face_camera (3, 4) in each picture that shows it: camera and index."""
    poses = {face: {} for face in range(len(board.faces))}
    for name, series in views.boards.items():
        for index, face, T_face_camera in _face_poses(series, board, views.crop(name)):
            poses[face][name, index] = T_face_camera
    return poses


def _face_poses(
    series: Sequence[Corners], board: Body, crop: Crop
) -> list[tuple[int, int, np.ndarray]]:
    """Return picture, face and pose T_face_camera (3, 4) of each face in a camera's pictures; none
    where too few show one.
    """
    single = []
    for index, whole in enumerate(series):
        single += [(index, view) for view in _faces(whole, board)]
    start = first_lenses([[view for _, view in single]], board, [crop])[0]
    single = [(index, view) for index, view in single if has_pose(view, board.corners_mm, start)]
    if len(single) < MIN_VIEWS:
        return []
    adjusted = calibrate_picture([[view for _, view in single]], board, [crop])
    poses = []
    for (index, view), T in zip(single, adjusted.solution.state.T_world_board):
        face = int(board.face_of[view.ids[0]])
        poses.append((index, face, invert_transform(T)))
    return poses


def _faces(view: Corners, board: Body) -> list[Corners]:
    """Return the faces of a view that fix a pose each, without stray corners."""
    return [part for part in by_face(without_strays(view, board), board) if fixes_pose(part, board)]
