"""What aniposelib makes of the board pictures that tests/studies/speed/beside.py hands over; run by it, in an environment of
its own.

    python others_boards.py PICTURES.npy SQUARES_X SQUARES_Y SQUARE_MM MARKER_MM MARKER_BITS DICTIONARY_SIZE OUT.npz

PICTURES.npy: (c, v, h, w) of 8 bits, view v of all c cameras taken at once. OUT.npz: by camera matrix (c, 3, 3),
distortion (c, 5) and pose (c, 3, 4); seconds of processor of finding the board in a picture, and of the adjustment.
"""

import contextlib
import os
import sys
import time
from importlib.metadata import version

import cv2
import numpy as np
from aniposelib.boards import CharucoBoard
from aniposelib.cameras import Camera, CameraGroup


def found(board: CharucoBoard, pictures: np.ndarray) -> list[list[dict]]:
    """Corners by camera, a row a view, as aniposelib's own readers of films make them."""
    rows = []
    for views in pictures:
        each = [(number, *board.detect_image(view)) for number, view in enumerate(views)]
        rows.append(
            [
                {
                    "framenum": (0, number),
                    "corners": corners,
                    "ids": ids,
                    "filled": board.fill_points(corners, ids),
                }
                for number, corners, ids in each
                if len(corners)
            ]
        )
    return rows


def main() -> None:
    pictures, numbers, out = np.load(sys.argv[1]), sys.argv[2:8], sys.argv[8]
    squares_x, squares_y, bits, size = (int(numbers[k]) for k in (0, 1, 4, 5))
    board = CharucoBoard(squares_x, squares_y, float(numbers[2]), float(numbers[3]), bits, size)
    height, width = pictures.shape[-2:]
    group = CameraGroup(
        [Camera(name=f"c{k}", size=(width, height), extra_dist=True) for k in range(len(pictures))]
    )
    begin = time.process_time()
    rows = found(board, pictures)
    found_s = time.process_time() - begin
    begin = time.process_time()
    with open(os.devnull, "w") as nowhere, contextlib.redirect_stdout(nowhere):
        group.calibrate_rows(rows, board, verbose=False)
    adjusted_s = time.process_time() - begin
    made = group.cameras
    poses = [
        np.column_stack([cv2.Rodrigues(c.get_rotation())[0], np.ravel(c.get_translation())])
        for c in made
    ]
    np.savez(
        out,
        matrix=[c.get_camera_matrix() for c in made],
        pose=poses,
        adjusted_s=adjusted_s,
        distortion=[np.ravel(c.get_distortions())[:5] for c in made],
        version=version("aniposelib"),
        found_s=found_s / (pictures.shape[0] * pictures.shape[1]),
    )


if __name__ == "__main__":
    main()
