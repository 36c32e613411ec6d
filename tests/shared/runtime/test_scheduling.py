"""Each case in a process of its own, since a granted priority would stay with the tests."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

import pytest

pytestmark = pytest.mark.live

LOOK = """
import json, os, sys
from cohaptic.runtime.scheduling import LOOP_PRIORITY, prefer_this_process
before = os.nice(0)
if sys.argv[1:] == ["powerless"] and os.geteuid() == 0:
    os.setgroups([])
    os.setgid(65534)
    os.setuid(65534)
said = prefer_this_process(LOOP_PRIORITY)
real_time = sys.platform == "linux" and os.sched_getscheduler(0) == os.SCHED_FIFO
print(json.dumps({"said": said, "nice": os.nice(0), "before": before, "real_time": real_time}))
"""

posix = pytest.mark.skipif(sys.platform == "win32", reason="has neither users nor niceness")


def look(*arguments: str) -> dict[str, Any]:
    command = [sys.executable, "-c", LOOK, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    seen: dict[str, Any] = json.loads(done.stdout)
    return seen


@posix
@pytest.mark.parametrize("who", ["as we are", "powerless"])
def test_the_reported_scheduling_is_the_granted_one_and_never_worse(who: str) -> None:
    seen = look(who)
    if seen["real_time"]:
        assert seen["said"] == "real-time (SCHED_FIFO 5)"
    elif seen["nice"] < seen["before"]:
        assert seen["said"] == f"nice {seen['nice']}"
    else:
        assert seen["said"] == "normal"
        assert seen["nice"] == seen["before"]
