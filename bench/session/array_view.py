"""A session of several whiskers as one view a whisker: a session of that whisker alone, in its own base frame.

All conventions of one whisker hold in that frame: its origin is the base, its z the axis that the base turns about,
its x the whisker at motor angle 0. Every step of an evaluation can so take a view as it takes a session.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems
from bench.session import manifest
from bench.session.angle_source import MOTOR, TIME
from bench.session.daq import DaqFile
from bench.session.file_names import SESSION_TOML
from bench.session.manifest import ChannelKeys
from bench.session.rig_file import RIG_FILE
from bench.session.session import (
    Base,
    Session,
    given_gauges,
    read_manifest,
    session_of,
    stated_whisker,
)
from bench.session.signals import FORCES, MOMENTS, VOLTS
from bench.session.stated import whisker_label
from bench.session.strict_toml import values
from bench.session.table import column_names
from bench.session.trial import Trial
from vision.geometry import compose

# [1] Rounding of cosines: axes of bases on one motor. Derived.
_PARALLEL = 1e-6
_OWN = (*VOLTS, *MOMENTS, *FORCES)  # columns that no two whiskers share
_OWN_GAUGES = "give each of [[whiskers]] its own: [whiskers.gauges]"


def load_views(
    path: Path | str,
    problems: InputProblems | None = None,
    *,
    trials: Collection[str] | None = None,
    follow_links: bool = False,
) -> tuple[Session, ...]:
    """Load a session a whisker: the one of [whisker] as it is, or a view for each of [[whiskers]].

    Options and errors are those of `load_session`. Raises BadInput with [[whiskers]] also for names
    used twice, bases that touch, and whiskers that share a channel.
    """
    path = Path(path)
    problems = problems or InputProblems()
    stated = read_manifest(path, problems, follow_links)
    keys = stated.keys
    session = session_of(path, stated, problems, trials=trials)
    if not keys.whiskers:
        return (session,)
    _check_tables(session, keys)
    bases = [_base(whisker) for whisker in keys.whiskers]
    _check_names([base.name for base in bases])
    _check_distances(bases, keys.whiskers)
    trials_of = _trials_of_all(session, keys.whiskers, bases, problems)
    _check_placed(session)
    views = []
    for one, base in zip(keys.whiskers, bases):
        view = _view(session, one, base, trials_of[base.name])
        views.append(replace(view, givens=stated.givens_of(base.name)))
    return tuple(views)


def _check_placed(session: Session) -> None:
    """Raise BadInput for pictures of an array without T_rig_board or cameras.toml."""
    if session.has_pictures and session.T_rig_board is None and session.cameras_toml is None:
        cure = "measure it, or bring cameras.toml: of several wires it says which is whose"
        raise BadInput(f"[rig] T_rig_board is missing; {cure}", file=SESSION_TOML)


def _trials_of_all(
    session: Session,
    keys: Sequence[manifest.ArrayWhiskerKeys],
    bases: Sequence[Base],
    problems: InputProblems,
) -> dict[str, list[Trial]]:
    """Return the trials that can be read as each whisker would have recorded them, by its name."""
    trials: dict[str, list[Trial]] = {base.name: [] for base in bases}
    for trial in session.trials:
        with problems.guard():
            channels = _channels_of_all(trial, keys)
            _check_motors(bases, channels)
            _check_cone(bases, trial)
            if session.truth is not None:
                _check_stated_place(trial)
            for base in bases:
                trials[base.name].append(_trial_of(base, trial, channels[base.name]))
    return trials


def _check_tables(session: Session, keys: manifest.SessionKeys) -> None:
    """Raise BadInput for what one whisker alone has."""
    if keys.whisker is not None:
        raise BadInput("has [whisker] and [[whiskers]]; keep one of them", file=SESSION_TOML)
    if keys.gauges is not None:
        raise BadInput(f"[gauges] are one whisker's; {_OWN_GAUGES}", file=SESSION_TOML)
    if session.gauges_toml is not None:
        raise BadInput(f"is one whisker's; {_OWN_GAUGES}", file="gauges.toml")
    if session.measured_rig is not None:
        cure = "state [rig] T_rig_board, and remove the file"
        raise BadInput(f"was measured by one whisker; of several, {cure}", file=RIG_FILE)


def _check_names(names: Sequence[str]) -> None:
    """Raise BadInput for a name that cannot name a folder, or that two have."""
    taken = set()
    for name in names:
        if name.startswith(".") or not all(c.isalnum() or c in "_.-" for c in name):
            fix = "letters, digits, '_', '-' and '.' are allowed"
            raise BadInput(f"[[whiskers]] name {name!r}: {fix}", file=SESSION_TOML)
        if name.casefold() in taken:
            raise BadInput(f"[[whiskers]] name {name!r} is used twice", file=SESSION_TOML)
        taken.add(name.casefold())


def _base(keys: manifest.ArrayWhiskerKeys) -> Base:
    """Return a whisker's base: turned about the rig's x, then y, then z, and shifted."""
    rotation = Rotation.from_euler("xyz", keys.base_deg, degrees=True).as_matrix()
    pose = np.column_stack([rotation, keys.base_mm])
    return Base(keys.name, pose, keys.base_sigma_mm, math.radians(keys.base_sigma_deg))


def _check_distances(bases: Sequence[Base], keys: Sequence[manifest.ArrayWhiskerKeys]) -> None:
    """Raise BadInput where two bases are nearer than both radii."""
    for (one, a), (other, b) in combinations(zip(bases, keys), 2):
        distance_mm = float(np.linalg.norm(one.T_rig_base[:, 3] - other.T_rig_base[:, 3]))
        radii_mm = 0.5 * (a.diameter_mm + b.diameter_mm)
        if distance_mm < radii_mm:
            sizes = f"{distance_mm:.3g} mm apart, radii {radii_mm:.3g} mm"
            found = f"the bases of {one.name} and {other.name} touch: {sizes}"
            fix = "base_mm is each one's own, in the rig frame"
            raise BadInput(f"[[whiskers]] {found}; {fix}", file=SESSION_TOML)


def _channels_of_all(
    trial: Trial, whiskers: Sequence[manifest.ArrayWhiskerKeys]
) -> dict[str, DaqFile]:
    """Return each whisker's channels of the trial's file. Raise BadInput where two share one."""
    found = {keys.name: _channels(trial, keys) for keys in whiskers}
    owners: dict[str, str] = {}
    for name, daq in found.items():
        for column in filter(daq.channels.get, _OWN):
            channel = daq.channels[column].channel
            owner = owners.get(channel)
            if owner is not None:
                found_twice = f"{owner} and {name} share the channel {channel!r}"
                if owner == name:
                    found_twice = f"{name} has the channel {channel!r} twice"
                fix = "[whiskers.channels] names each one's own"
                raise BadInput(f"[[whiskers]] {found_twice}; {fix}", file=SESSION_TOML)
            owners[channel] = name
    return found


def _channels(trial: Trial, keys: manifest.ArrayWhiskerKeys) -> DaqFile:
    """Return a whisker's channels.

    They are as [whiskers.channels] names them; else those of [signals], or the columns of
    signals.csv that end in @ and its name.
    """
    named = {column: name for column, name in values(keys.channels).items() if name is not None}
    if trial.daq is not None:
        channels = dict(trial.daq.channels)
        for column, name in named.items():
            channels[column] = replace(channels.get(column, ChannelKeys(channel="")), channel=name)
        return replace(trial.daq, channels=channels)
    columns = _tagged_columns(trial, keys.name) | named
    if not any(column in columns for column in (*VOLTS, *MOMENTS)):
        columns |= {column: _tagged(column, keys.name) for column in VOLTS}
    channels = {column: ChannelKeys(channel=name) for column, name in columns.items()}
    return DaqFile(trial.signals_path.name, None, channels)


def _tagged(column: str, whisker: str) -> str:
    """Return the name of a whisker's own column in signals.csv."""
    return f"{column}@{whisker}"


def _tagged_columns(trial: Trial, whisker: str) -> dict[str, str]:
    """Return time and motor angle, and a whisker's own columns in signals.csv, by what they are."""
    path = trial.signals_path
    in_file = column_names(path, trial.label(path.name))
    columns = {TIME: TIME, MOTOR: MOTOR}
    for column in (MOTOR, *_OWN):
        if _tagged(column, whisker) in in_file:
            columns[column] = _tagged(column, whisker)
    return columns


def _check_motors(bases: Sequence[Base], channels: Mapping[str, DaqFile]) -> None:
    """Raise BadInput where whiskers on one motor turn about axes that are not parallel."""
    for one, other in combinations(bases, 2):
        motor = channels[one.name].channels[MOTOR]
        if motor != channels[other.name].channels[MOTOR]:
            continue
        cosine = one.T_rig_base[:, 2] @ other.T_rig_base[:, 2]
        if abs(cosine) < 1 - _PARALLEL:
            angle = f"their axes {np.degrees(np.arccos(cosine)):.3g}° apart"
            found = f"{one.name} and {other.name} are on one motor ({motor.channel}), {angle}"
            fix = "name each one's own motor_deg in [whiskers.channels]"
            raise BadInput(f"[[whiskers]] {found}; {fix}", file=SESSION_TOML)


def _check_stated_place(trial: Trial) -> None:
    """Raise BadInput where a stage's truth is one whisker's: by d_x_mm, or a bar's slope without its axis."""
    if not trial.states_place:
        found = "states no place of the object; d_x_mm is one whisker's, of an array write point_mm of [object]"
    elif trial.is_bar and (trial.object is None or trial.object.axis is None):
        found = "beta_deg is one whisker's slope; of an array write axis of [object], the bar's direction"
    else:
        return
    raise BadInput(found, file=f"{trial.place}/trial.toml")


def _check_cone(bases: Sequence[Base], trial: Trial) -> None:
    """Raise BadInput for a cone that is said to end before any whisker's plane of whisking."""
    stated = trial.object
    if stated is None or stated.shape != "cone" or stated.point_mm is None:
        return
    tip = np.array(stated.point_mm)
    axis = np.array(stated.direction) / np.linalg.norm(stated.direction)
    for base in bases:
        normal = base.T_rig_base[:, 2]
        towards = np.copysign(1.0, (base.T_rig_base[:, 3] - tip) @ normal) * normal
        angle_rad = np.arccos(np.clip(-axis @ towards, -1.0, 1.0))
        if angle_rad - np.radians(stated.half_angle_deg) < np.pi / 2:
            return
    found = "the cone's tip, point_mm, lies before every whisker's plane: none can touch it"
    raise BadInput(f"[object] {found}; axis points to the tip", file=f"{trial.place}/trial.toml")


def _trial_of(base: Base, trial: Trial, daq: DaqFile) -> Trial:
    """Return a trial as one whisker alone would have recorded it, in its base frame."""
    velocity = trial.object_velocity_mm_s
    if velocity is not None:
        velocity = (base.T_rig_base[:, :3].T @ velocity).tolist()
    return replace(trial, daq=daq, whisker=base.name, object_velocity_mm_s=velocity)


def _view(
    session: Session, keys: manifest.ArrayWhiskerKeys, base: Base, trials: Sequence[Trial]
) -> Session:
    """Return the session as that whisker alone would have recorded it, in its base frame.

    The other wires are in its pictures, too.
    """
    board = session.T_rig_board
    return replace(
        session,
        name=f"{session.name}, whisker {base.name}",
        whisker=stated_whisker(keys, f"{whisker_label(base.name)}:", session.path),
        gauges=given_gauges(keys.gauges),
        trials=tuple(trials),
        base=base,
        whole=session,
        T_rig_board=None if board is None else compose(base.T_base_rig, board),
        T_rig_board_sigma_mm=math.hypot(session.T_rig_board_sigma_mm, base.sigma_mm),
        T_rig_board_sigma_rad=math.hypot(session.T_rig_board_sigma_rad, base.sigma_rad),
    )
