"""Sessions whose motor log is left out."""

import shutil
from pathlib import Path


def without_log(source: Path, target: Path, keys: str, trials: int | None = None) -> Path:
    """Copy a session without motor_deg and traces, with these keys in [trial] and some of its trials."""
    shutil.copytree(source, target, ignore=shutil.ignore_patterns("trace_*"))
    folders = sorted((target / "trials").iterdir())
    for folder in folders[len(folders) if trials is None else trials :]:
        shutil.rmtree(folder)
    text = (target / "session.toml").read_text()
    if "[trial]" not in text:
        text += "\n[trial]\n"
    (target / "session.toml").write_text(text.replace("[trial]", f"[trial]\n{keys}"))
    for file in target.glob("trials/*/signals.csv"):
        rows = [line.split(",") for line in file.read_text().split()]
        motor = rows[0].index("motor_deg")
        lines = [",".join(row[:motor] + row[motor + 1 :]) for row in rows]
        file.write_text("\n".join(lines) + "\n")
    return target
