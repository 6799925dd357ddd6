"""certificate.png for docs/gauges.md: the certificate of a session's gauge calibration.

python docs/pictures/take_certificate.py SESSION
"""

import argparse
from pathlib import Path

from bench.base.input_problems import InputProblems
from bench.gauges.certificate import page
from bench.session.session_check import checked_session
from bench.workflows.gauge_calibration import calibrate_gauges, trials_to_use

HERE = Path(__file__).resolve().parent


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("session", type=Path)
    session = checked_session(parser.parse_args().session)
    certificate = calibrate_gauges(
        session, trials_to_use(session, every_trial=False), InputProblems()
    )
    page(certificate).savefig(HERE / "certificate.png", dpi=90)
    print("\n".join(certificate.lines()))


if __name__ == "__main__":
    main()
