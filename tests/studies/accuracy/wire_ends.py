"""Where the whisker is seen to end, in scenes whose whisker is as long as stated, and stated otherwise.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/wire_ends.py FOLDER [FACTOR] [PATTERN]

FOLDER is one of path_traced.py. A row a scene: by camera how far from the base the wire is seen to end, mm, or nothing
where it is not told, with the length stated FACTOR (1) times as long as it is; and what a run would say.
"""

import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.session.whisker import Whisker
from bench.trials.consistency import check_length
from bench.trials.seeing import PRESETS
from tests.studies.accuracy.bar_scenes import read_scene
from vision.geometry.rods import Rods
from vision.truth.observe import observe_trial
from vision.truth.trial_pictures import TrialPictures


def ends(folder: Path, factor: float) -> tuple[dict, str]:
    """By camera where the wire of a scene ends, and what is said of it; a draft's look is enough."""
    views, cameras, rods, motor_rad, _ = read_scene(folder)
    wire = replace(rods.wire, length_mm=factor * rods.wire.length_mm)
    pictures = TrialPictures(
        {view.camera.name: view.frames for view in views},
        0.05 * motor_rad,
        motor_rad,
        {view.camera.name: view.background for view in views},
    )
    everything = [slice(0, len(motor_rad))]
    (whisk,) = observe_trial(
        pictures, everything, cameras, Rods(wire, rods.bar), PRESETS["draft"]
    ).whisks
    stated = Whisker(
        shape=wire.shape,
        length_mm=wire.length_mm,
        diameter_mm=wire.diameter_mm,
        youngs_modulus_GPa=1.0,
    )
    return whisk.ends, check_length(whisk.ends, stated) or whisk.status


def main(folder: Path, factor: str = "1", pattern: str = "*") -> None:
    """A row a scene."""
    for scene in sorted(folder.glob(pattern)):
        if (scene / "trials" / "w" / "truth.toml").is_file():
            found, said = ends(scene, float(factor))
            by_camera = ", ".join(
                f"{name} {end.value:.0f} ± {end.sigma:.0f}" for name, end in found.items()
            )
            print(f"{scene.name}: {by_camera or 'not told'}; {said}", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:])
