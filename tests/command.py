"""The command line as tests run it: as a user does, in a process of its own, or at once, in this one.

A process takes a second or two to start. One test of a verb goes that way; what else a verb says is asked at once.
"""

import contextlib
import io
import logging
import os
import subprocess
import sys
import warnings

import pytest


def as_command(*arguments, cwd=None, **environment):
    """Run `ramsight` in a process of its own."""
    command = [sys.executable, "-m", "ramsight.cli", *map(str, arguments)]
    return subprocess.run(
        command, capture_output=True, text=True, cwd=cwd, env=os.environ | environment, check=False, timeout=300
    )


def at_once(*arguments, cwd=None):
    """Run `ramsight` in this process, from its arguments to its exit code; what it changes of the process goes back."""
    from ramsight.cli import main
    from ramsight.cli.verbs import OTHER_ARRAYS

    words, out, err = ["ramsight", *map(str, arguments)], io.StringIO(), io.StringIO()
    with contextlib.ExitStack() as stack:
        patch = stack.enter_context(pytest.MonkeyPatch.context())
        patch.setattr(sys, "argv", words)
        patch.setattr(logging.getLogger(), "handlers", list(logging.getLogger().handlers))
        stack.enter_context(warnings.catch_warnings())
        stack.enter_context(contextlib.redirect_stdout(out))
        stack.enter_context(contextlib.redirect_stderr(err))
        stack.enter_context(contextlib.chdir(cwd or "."))
        try:
            main()
            code = 0
        except SystemExit as end:
            code = end.code or 0
        for name in OTHER_ARRAYS:  # a command never loads them; this process may want to
            if sys.modules.get(name) is None:
                sys.modules.pop(name, None)
    return subprocess.CompletedProcess(words, code, out.getvalue(), err.getvalue())


def refused(done, *words):
    """Assert that a command was refused in one line, which has these words."""
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    lines = [line for line in done.stderr.strip().splitlines() if not line.endswith(" s so far")]  # of a busy machine
    assert len(lines) == 1, done.stderr
    assert "Traceback" not in done.stderr
    for word in words:
        assert word in done.stderr
