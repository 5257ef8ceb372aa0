"""Ctrl-C: what it ends, how soon, and what it leaves."""

import contextlib
import signal
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import skinfit

pytestmark = [
    pytest.mark.skipif(sys.platform == "win32", reason="there is no such signal"),
    pytest.mark.timed,
]

# Seconds after which what hangs is ended, so that its test fails.
PATIENCE = 120.0

# Of what a shell runs in the background Ctrl-C is ignored, until somebody says otherwise.
_HEARD = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"

_INTERRUPTED = """
    import sys, time, warnings
    import skinfit
    warnings.simplefilter("ignore")
    scene = skinfit.load_file({scene!r}, cache={cache!r})
    def watch(step):
        print("step", flush=True)
        time.sleep(0.2)
    found = scene.fit(watch, engine="cpu", solver="nelder-mead", run={run!r})
    print(found.ending, len(found.history), flush=True)
"""


@contextlib.contextmanager
def running(script: str) -> "Iterator[subprocess.Popen[str]]":
    """A process of this script; what it has not told in time it will not tell."""
    with subprocess.Popen([sys.executable, "-c", _HEARD + script], stdout=subprocess.PIPE, text=True) as process:
        watch = threading.Timer(PATIENCE, process.kill)
        watch.start()
        try:
            yield process
            process.wait(PATIENCE)
        finally:
            watch.cancel()
            process.kill()


def test_ctrl_c_keeps_what_there_is(small_file: Path, cache: Path, tmp_path: Path) -> None:
    script = textwrap.dedent(_INTERRUPTED.format(scene=str(small_file), cache=str(cache), run=str(tmp_path / "run")))
    with running(script) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "step\n"
        process.send_signal(signal.SIGINT)
        told = process.stdout.read().split()
    assert process.returncode == 0
    # It stopped soon, not after its hundreds of steps.
    assert told.count("step") < 20 and told[-2] == "interrupted"
    assert skinfit.load_run(tmp_path / "run").ending == "interrupted"


def interrupted(script: str, after: str, seconds: float) -> tuple[float, list[str]]:
    """When a script was interrupted, so many seconds after a word, and the words of its next line."""
    with running(script) as process:
        assert process.stdout is not None and process.stdout.readline() == f"{after}\n"
        time.sleep(seconds)
        sent = time.time()
        process.send_signal(signal.SIGINT)
        return sent, process.stdout.readline().split()


_AT_WORK = """
    import time
    import skinfit
    f = skinfit.load_file({scene!r}, cache={cache!r}).objective()
    print("begun", flush=True)
    try:
        while True:
            f.image(f.start)
    except KeyboardInterrupt:
        print("interrupted", time.time(), flush=True)
"""


def test_ctrl_c_is_heard_within_a_second_while_the_library_works(demo_file: Path, cache: Path) -> None:
    script = textwrap.dedent(_AT_WORK.format(scene=str(demo_file), cache=str(cache)))
    sent, (word, heard) = interrupted(script, after="begun", seconds=0.5)
    assert word == "interrupted" and float(heard) - sent < 1.0


_SEARCHING = """
    import time, warnings
    import skinfit
    warnings.simplefilter("ignore")
    scene = skinfit.load_file({scene!r}, cache={cache!r})
    last = []
    def watch(step):
        if not last:
            print("step", flush=True)
        last[:] = [time.time()]
    found = scene.fit(watch, engine="cpu", solver="nelder-mead", starts=500, max_iterations=100000)
    print(found.ending, last[0], time.time(), flush=True)
"""


def test_ctrl_c_ends_a_long_search_within_a_second(demo_file: Path, cache: Path) -> None:
    script = textwrap.dedent(_SEARCHING.format(scene=str(demo_file), cache=str(cache)))
    sent, (ending, last, over) = interrupted(script, after="step", seconds=1.0)
    assert ending == "interrupted" and float(last) - sent < 1.0
    # The report of three views is written, too: some seconds on two slow cores.
    assert float(over) - sent < 30.0


_LEFT = """
    import skinfit
    steps = skinfit.load_file({scene!r}, cache={cache!r}).fit_steps(engine="cpu", solver="nelder-mead", starts=500)
    {taken}
    print("left", flush=True)
"""


@pytest.mark.parametrize("taken", ["pass", "next(steps)"])
def test_a_program_ends_that_leaves_a_fit_under_way(taken: str, demo_file: Path, cache: Path) -> None:
    script = textwrap.dedent(_LEFT.format(scene=str(demo_file), cache=str(cache), taken=taken))
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == 0 and done.stdout == "left\n", done


_AGAIN = """
    import sys, warnings
    import skinfit
    warnings.simplefilter("ignore")
    scene = skinfit.load_file({scene!r}, cache={cache!r})
    def run():
        {run}
    print("begun", flush=True)
    try:
        run()
    except KeyboardInterrupt:
        # What a prompt keeps: the frames of what was interrupted, and all in them.
        kept = sys.exc_info()
        print("interrupted", flush=True)
        print(scene.fit(engine="cpu", run={folder!r}).ending, flush=True)
"""


def interrupted_and_run_again(scene: Path, cache: Path, folder: Path, run: str, after: str) -> list[str]:
    """What is told of a run that is interrupted soon after a word, and of the fit into its folder that follows at once."""
    script = textwrap.dedent(_AGAIN).format(scene=str(scene), cache=str(cache), folder=str(folder), run=run)
    with running(script) as process:
        assert process.stdout is not None
        while process.stdout.readline().strip() != after:
            assert process.poll() is None
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        return process.stdout.read().split()


def test_a_fit_follows_at_once_on_one_that_was_interrupted_while_it_baked(demo_file: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    run = f"scene.fit(engine='cpu', run={str(folder)!r})"
    told = interrupted_and_run_again(demo_file, tmp_path / "cache", folder, run, after="begun")
    assert told == ["interrupted", "converged"]


@pytest.mark.parametrize(
    "body",
    [
        # Between two steps, in a loop over what has a name and in one over what has none; then while a step is waited for.
        "steps = {steps}\n    for step in steps: print('step', flush=True); import time; time.sleep(60)",
        "for step in {steps}: print('step', flush=True); import time; time.sleep(60)",
        "seen = []\n    for step in {steps}: seen or print('step', flush=True); seen.append(step)",
        "with {steps} as steps:\n        for step in steps: print('step', flush=True); import time; time.sleep(60)",
    ],
)
def test_a_fit_follows_at_once_on_steps_that_were_interrupted(
    body: str, small_file: Path, cache: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "run"
    steps = f"scene.fit_steps(run={str(folder)!r}, engine='cpu', solver='nelder-mead', starts=500, max_iterations=100000)"
    told = interrupted_and_run_again(small_file, cache, folder, body.format(steps=steps), after="step")
    assert told == ["interrupted", "converged"]
