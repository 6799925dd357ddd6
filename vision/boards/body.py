"""A rigid body with a ChArUco board on each of several faces, such as a cube.

How its faces stand to each other is not stated. `Body` knows each face as a plane of its own;
`PlacedBody` has places of the faces to begin with, and the parameters by which they differ from
there. The body's frame is that of its first face. A point's id is its ChArUco id, counted on from
face to face.
"""

from dataclasses import dataclass, field, fields
from functools import cached_property
from itertools import pairwise

import numpy as np

from vision.boards.charuco import CharucoBoard
from vision.boards.corners import Corners, is_found
from vision.geometry.board import PRINT_TERMS, Board, printed_corners
from vision.geometry.checks import require
from vision.geometry.rotation import apply, left_jacobian, moved_pose, skew

# [parameters] Of a face's pose. A layout, no threshold.
_N_POSE = 6
# [rad] Of a face's turn about its first guess, which errs by less than a tenth: keeps solvable what
# one camera's views leave open. Stated.
_TURN_SIGMA = 0.3
# [1] Of a face's shift about its first guess, over the side of a face. As above. Stated.
_SHIFT_SIGMA = 0.3


@dataclass(frozen=True)
class Body(Board):
    """A body with equal ChArUco boards on its faces, each known as a plane of its own.

    squares, square_mm, marker_mm, dictionary, legacy, inverted: of each face. first_ids: number of
    the first marker on each face. Raises Refused for a body that cannot be.
    """

    marker_mm: float
    dictionary: str
    first_ids: tuple[int, ...]
    legacy: bool = False
    inverted: bool = False

    kind: str = field(default="body", init=False)

    def __post_init__(self):
        """Raise Refused for counts, lengths or numbers of markers that cannot be."""
        super().__post_init__()
        object.__setattr__(self, "first_ids", tuple(int(first) for first in self.first_ids))
        require(
            len(self.first_ids) >= 2,
            f"board first_ids = {list(self.first_ids)}: a body has two faces or more, a number each",
        )
        count = self.faces[0].marker_count
        for first, after in pairwise(sorted(self.first_ids)):
            require(
                after - first >= count,
                f"board first_ids: faces from {first} and {after} on share markers, each has {count}",
            )

    @cached_property
    def faces(self) -> tuple[CharucoBoard, ...]:
        """Return the board on each face."""
        own = {part.name for part in fields(CharucoBoard) if part.init}
        given = {name: getattr(self, name) for name in own - {"first_id"}}
        return tuple(CharucoBoard(**given, first_id=first) for first in self.first_ids)

    @property
    def grid(self) -> tuple[int, int]:
        """Return the number of points in a row, and of rows, one face's after the other's."""
        columns, rows = self.faces[0].grid
        return columns, rows * len(self.faces)

    @cached_property
    def flat_mm(self) -> np.ndarray:
        """Return the points in the plane of the face that each is printed on, (m, 3), z = 0."""
        return np.tile(self.faces[0].corners_mm, (len(self.faces), 1))

    @cached_property
    def corners_mm(self) -> np.ndarray:
        """Return the points each in the frame of its own face, (m, 3)."""
        return self.flat_mm

    @cached_property
    def face_of(self) -> np.ndarray:
        """Return the number of the face that each point is printed on, (m,)."""
        return np.repeat(np.arange(len(self.faces)), len(self.faces[0].corners_mm))

    @property
    def neighbours(self) -> np.ndarray:
        """Return the ids of points that are neighbours in a row or a column of a face, (p, 2)."""
        pairs = super().neighbours
        return pairs[self.face_of[pairs[:, 0]] == self.face_of[pairs[:, 1]]]

    @property
    def is_white_on_black(self) -> bool:
        """Return whether the faces, and markers with them, are printed white on black."""
        return self.inverted

    @property
    def spare_markers(self) -> tuple[str, int]:
        """Return the faces' dictionary, and the first number beyond those of all faces."""
        return self.dictionary, max(face.spare_markers[1] for face in self.faces)

    def detect(self, picture: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return OpenCV's own corners on all faces, ids (n,) and px (n, 2)."""
        ids = []
        px = []
        for number, face in enumerate(self.faces):
            own_ids, own_px = face.detect(picture)
            ids.append(own_ids + number * len(face.corners_mm))
            px.append(own_px)
        return np.concatenate(ids), np.concatenate(px)

    def refine(self, grey: np.ndarray, px_guess: np.ndarray, ids: np.ndarray) -> Corners:
        """Fit the points `ids` (n,) near known places px_guess (n, 2), face by face."""
        found = [Corners.none()]
        for number, face in enumerate(self.faces):
            own = self.face_of[ids] == number
            first = number * len(face.corners_mm)
            corners = face.refine(grey, px_guess[own], ids[own] - first)
            found.append(Corners(corners.ids + first, corners.px, corners.sigma_px))
        return Corners.join(found)

    def cut(self, grey: np.ndarray, px: np.ndarray, ids: np.ndarray) -> tuple | None:
        """Return the pixels about corners of one face, and a frame at each; None where too few are
        seen.
        """
        if not len(ids):
            return None
        number = self.face_of[ids[0]]
        face = self.faces[number]
        return face.cut(grey, px, ids - number * len(face.corners_mm))

    def why_not_found(self, greys: list[np.ndarray], *, mirrored: bool = False) -> str | None:
        """Return a sentence naming the setting that would find the first face; None if any face is
        found.
        """
        if is_found(self, greys):
            return None
        return self.faces[0].why_not_found(greys, mirrored=mirrored)

    def check_print(self, greys: list[np.ndarray]) -> None:
        """Raise Refused where marker_mm and square_mm contradict the markers in pictures."""
        for face in self.faces:
            face.check_print(greys)

    def placed(self, T_body_face: np.ndarray) -> "PlacedBody":
        """Return the body with its faces at poses (F, 3, 4) to begin with, the first at its frame."""
        given = {part.name: getattr(self, part.name) for part in fields(Body) if part.init}
        return PlacedBody(**given, T_body_face=T_body_face)


@dataclass(frozen=True, eq=False)
class PlacedBody(Body):
    """A body with its faces at poses T_body_face (F, 3, 4), mm, the first at the body's frame.

    The parameters of its shape are w and v of each face but the first: T = (Exp(w) R, t + v).
    """

    T_body_face: np.ndarray = field(kw_only=True)

    @cached_property
    def corners_mm(self) -> np.ndarray:
        """Return the points in the body's frame with its faces at T_body_face, (m, 3)."""
        return self.printed(self.stated_terms)[0]

    @property
    def shape_sigma(self) -> np.ndarray:
        """Return how far w, rad, and v, mm, of each face but the first are from 0, (6 (F − 1),)."""
        shift_mm = _SHIFT_SIGMA * max(self.squares) * self.square_mm
        of_face = np.repeat([_TURN_SIGMA, shift_mm], 3)
        return np.tile(of_face, len(self.faces) - 1)

    def printed(self, terms: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the points in the body's frame (m, 3), mm, and their derivatives by the terms
        (m, 3, 6 (F − 1) + 4).

        terms: w and v of each face but the first, then PRINT_TERMS, alike on all faces.
        """
        flat, by_print = printed_corners(self.faces[0].corners_mm, terms[-len(PRINT_TERMS) :])
        points = []
        derivatives = []
        for number, T in enumerate(self.faces_at(terms)):
            in_body = apply(T, flat)
            by_terms = np.zeros((len(flat), 3, len(terms)))
            by_terms[:, :, -len(PRINT_TERMS) :] = T[:, :3] @ by_print
            if number:  # the first face stands at the body's frame
                own = slice(_N_POSE * (number - 1), _N_POSE * number)
                by_terms[:, :, own] = _by_step(in_body - T[:, 3], terms[own])
            points.append(in_body)
            derivatives.append(by_terms)
        return np.concatenate(points), np.concatenate(derivatives)

    def faces_at(self, terms: np.ndarray) -> np.ndarray:
        """Return the poses (F, 3, 4) of the faces on the body, by the terms of its shape."""
        of_shape = terms[: len(self.shape_sigma)]
        first_face = np.zeros(_N_POSE)  # the body's frame is tied to it
        steps = np.append(first_face, of_shape).reshape(-1, _N_POSE)
        return moved_pose(self.T_body_face, steps)


def _by_step(from_origin: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Return the derivatives (m, 3, 6) of points of a face by its step on the body, w and v.

    from_origin (m, 3): from the face's own origin, along the body's axes, mm.
    """
    by_turn = -skew(from_origin) @ left_jacobian(step[:3])
    by_shift = np.broadcast_to(np.eye(3), by_turn.shape)
    return np.concatenate([by_turn, by_shift], axis=2)
