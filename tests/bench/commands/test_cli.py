"""The command line: thin, quick, one line for bad input, and the exit codes that scripts rely on."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from bench.base.errors import BadInput
from bench.base.settings import Settings
from bench.commands import cli, evaluate, info
from bench.plan.run_plan import Options

COMMANDS = Path(cli.__file__).parent
HEAVY = {"numpy", "cv2", "scipy", "matplotlib", "msgspec"}
BELOW = {
    "calibrate": ("cameras", "gauges"),
    "figures": ("5", "6", "8", "tilt", "radius"),
}
EXAMPLES = [verb for verb in cli.VERBS if verb not in BELOW]
EXAMPLES += [f"{verb} {what}" for verb, below in BELOW.items() for what in below]


@pytest.mark.parametrize("verb", EXAMPLES)
def test_each_verb_shows_a_worked_example(verb, capsys):
    with pytest.raises(SystemExit) as done:
        cli.main([*verb.split(), "--help"])
    assert done.value.code == 0
    assert f"example:\n  whisker-bench {verb}" in capsys.readouterr().out


def test_help_lists_every_verb(capsys):
    with pytest.raises(SystemExit):
        cli.main(["--help"])
    shown = capsys.readouterr().out
    assert [verb for verb in cli.VERBS if f"\n    {verb}" not in shown] == []


def test_each_module_is_a_verb():
    modules = {path.stem for path in COMMANDS.glob("*.py")}
    verbs = {verb.replace("-", "_") for verb in cli.VERBS}
    assert modules == {*verbs, "__init__", "cli", "options"}


@pytest.mark.parametrize("verb", cli.VERBS)
def test_help_imports_nothing_heavy(verb):
    """In a fresh process: `bench.commands.cli` has imported every verb before it shows any help."""
    code = (
        "import sys\n"
        "from bench.commands.cli import main\n"
        f"try: main([{verb!r}, '--help'])\n"
        "except SystemExit: print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(done.stdout.split())
    assert f"bench.commands.{verb.replace('-', '_')}" in loaded and not HEAVY & loaded


def test_options_that_are_not_given_are_the_settings_own():
    parser = cli.make_parser()
    assert evaluate._settings(parser.parse_args(["evaluate", "s", "--out", "o"])) == Settings()
    plan = parser.parse_args(["plan", "rig.toml"])
    assert Options(plan.theta_deg, plan.changes, plan.follow_links) == Options()
    assert parser.parse_args(["robot", "s", "--out", "o"]).alpha_est_deg == Settings().alpha_est_deg


def test_a_check_without_boards_imports_no_solver(steel_signals):
    """Of the second that `check` takes to start, half was scipy.optimize and what imports it."""
    code = f"import sys; from bench.commands.cli import main; main(['check', {str(steel_signals)!r}]); print(*sys.modules)"
    said = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout
    heavy = {
        "scipy.optimize",
        "scipy.interpolate",
        "scipy.integrate",
        "scipy.stats",
        "matplotlib",
        "skimage",
        "jinja2",
    }
    assert "no error, no warning" in said and not heavy & set(said.split())


def test_linear_algebra_has_one_thread_before_it_is_loaded(small_session):
    """By verbs that open no workers, too, it is computed by one thread."""
    code = (
        "import os, sys\n"
        "class Watch:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name == 'numpy': print('loaded with', os.environ.get('OPENBLAS_NUM_THREADS'))\n"
        "sys.meta_path.insert(0, Watch())\n"
        "from bench.commands.cli import main\n"
        f"main(['check', {str(small_session)!r}])"
    )
    environment = {name: value for name, value in os.environ.items() if "THREADS" not in name}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment
    )
    assert done.stdout.startswith("loaded with 1\n")


@pytest.mark.parametrize("job", ["session_evaluation", "live_push"])
def test_a_session_is_evaluated_and_a_push_followed_without_loading_what_draws(job):
    code = f"import bench.api, bench.workflows.{job}, sys; from bench.report.page import write; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert "bench.trials.seen" in loaded
    assert not {"matplotlib", "scipy.stats"} & set(loaded)


@pytest.mark.parametrize(
    "arguments", [[], ["no-such-verb"], ["check"], ["check", "x", "--no-such-option"]]
)
def test_wrong_usage_is_exit_code_2(arguments, capsys):
    with pytest.raises(SystemExit) as done:
        cli.main(arguments)
    assert done.value.code == 2
    assert capsys.readouterr().err.startswith("usage: whisker-bench")


def test_check_of_a_sound_session(small_session, capsys):
    assert cli.main(["check", str(small_session)]) == 0
    said = capsys.readouterr().out
    assert "4 trials, no error, no warning" in said
    assert "rig: placed by T_rig_board" in said
    assert said.endswith(f"then run: whisker-bench evaluate {small_session} --out OUT\n")


def test_check_of_a_session_with_a_warning(small_copy, capsys):
    manifest = small_copy / "trials" / "b30_3" / "trial.toml"
    manifest.write_text(manifest.read_text().replace("speed_deg_s = 10.0", "speed_deg_s = 90.0"))
    assert cli.main(["check", str(small_copy)]) == 1
    assert capsys.readouterr().out.startswith("warning: trials/b30_3/signals.csv")


def test_check_of_a_bad_session(small_copy, capsys):
    (small_copy / "session.toml").unlink()
    assert cli.main(["check", str(small_copy)]) == 2
    assert capsys.readouterr().out.startswith("error: ")


def test_info(capsys):
    assert cli.main(["info"]) == 0
    assert "opencv-contrib-python-headless" in capsys.readouterr().out


def main_with(monkeypatch, problem: BaseException) -> int:
    def fail(_):
        raise problem

    monkeypatch.setattr(info, "run", fail)
    return cli.main(["info"])


@pytest.mark.parametrize(
    ("problem", "code", "line"),
    [
        (
            BadInput("has 3 values", file="a.csv", row=7),
            2,
            "whisker-bench: a.csv, row 7: has 3 values\n",
        ),
        (KeyboardInterrupt(), 130, "whisker-bench: interrupted; what was finished is kept\n"),
        (
            OSError(28, "No space left on device", "out.csv"),
            2,
            "whisker-bench: out.csv: No space left on device\n",
        ),
        (
            FileExistsError(),
            2,
            "whisker-bench: file system: a file stands where a folder is wanted\n",
        ),
        (
            ZeroDivisionError("x"),
            70,
            "whisker-bench: a fault of ours, please report it (ZeroDivisionError: x); ",
        ),
    ],
)
def test_whatever_ends_a_run_is_one_line_and_a_code(monkeypatch, capsys, problem, code, line):
    assert main_with(monkeypatch, problem) == code
    error = capsys.readouterr().err
    assert error.startswith(line)
    assert error.count("\n") == 1


def test_a_polite_kill_ends_as_an_interruption():
    code = (
        "import sys, time\n"
        "from bench.commands import cli, info\n"
        "info.run = lambda _: (print('up', flush=True), time.sleep(60))\n"
        "sys.exit(cli.main(['info']))"
    )
    command = [sys.executable, "-c", code]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline() == "up\n"
        started = time.monotonic()
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=10) == 130
        assert time.monotonic() - started < 5
        assert process.stderr.read() == "whisker-bench: interrupted; what was finished is kept\n"


def test_a_reader_that_stops_reading_is_no_fault():
    shell = f"{sys.executable} -m bench.commands.cli info | head -n 0; echo ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", shell], capture_output=True, text=True)
    assert "Traceback" not in done.stderr
    assert done.stdout.strip() in {"0", "141"}
