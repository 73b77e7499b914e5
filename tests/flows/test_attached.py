from __future__ import annotations

import subprocess
import sys


def test_program_ends_with_the_process_that_started_it() -> None:
    command = [sys.executable, "-u", "-m", "shoal_flows.attached", "http.server", "--bind", "127.0.0.1", "0"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert b"Serving HTTP" in process.stdout.readline()
        assert process.poll() is None
        process.stdin.close()
        assert process.wait(timeout=60) != 0
