"""Writes the recording in tests/fixtures/replay: `python tests/replay/make_fixture.py`.

Renew it only when the message version changes on purpose: it stands for the users' recordings.
"""

from pathlib import Path

from groundstation.process import numba_cache

ROOT = Path(__file__).parents[2]
FIXTURE = ROOT / "tests" / "fixtures" / "replay"


def main() -> None:
    """Fly the study and write its recording."""
    numba_cache.activate(numba_cache.EVERYTHING)  # before anything imports numba
    from flown_study import FlownStudy

    from groundstation.settings.load import load_field
    from groundstation.settings.resolved import resolved_field
    from sim_bridge.study.runner import StudyOptions

    FIXTURE.mkdir(parents=True, exist_ok=True)
    field = resolved_field(load_field(ROOT / "config" / "lab.yaml"))
    FlownStudy(field, FIXTURE, StudyOptions(seed=5, duration_s=1.5), small=True).fly()


if __name__ == "__main__":
    main()
