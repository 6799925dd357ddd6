"""Pictures of a board that is fixed to the touched object."""

from bench.base.errors import BadInput
from bench.session.footage import read_still
from bench.session.trial import Trial
from vision.boards import Corners, find_corners
from vision.geometry import Board


def board_on_object(trial: Trial, board: Board | None) -> dict[str, Corners]:
    """Return by camera the corners of the board on a trial's object. board: of session.toml.

    A part of a picture may show none where another part does. Raises BadInput for a picture that cannot be read
    or shows no board.
    """
    found = {}
    by_file: dict[str, list[str]] = {}
    for camera, path in trial.board_pictures.items():
        label = trial.label(path.name)
        if board is None:
            raise BadInput("shows a board, and session.toml has no [board]", file=label)
        corners = find_corners(read_still(path, label), board)
        if len(corners):
            found[camera] = corners
        by_file.setdefault(label, []).append(camera)
    for label, cameras in by_file.items():
        if not found.keys() & set(cameras):
            raise BadInput("shows no board of session.toml", file=label)
    return found
