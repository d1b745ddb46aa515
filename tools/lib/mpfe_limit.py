"""Limits of the programs that tests start: seconds of the processor, so that no test fails on a loaded machine."""
import signal
import subprocess

HANGS = 10      # times the limit: the clock ends what waits for ever


def limited(command, seconds):
    """The command with that limit for itself, and as much for each process that it starts: SIGXCPU ends what takes more."""
    return ["/bin/sh", "-c", 'ulimit -St "$0"; exec "$@"', str(max(1, round(seconds)))] + list(command)


def used_up(code):
    """Did the limit end the program? Launchers and shells return 128 and the number of the signal."""
    return code in (-signal.SIGXCPU, 128 + signal.SIGXCPU)


def run_limited(command, seconds, **more):
    """subprocess.run; TimeoutExpired for both limits."""
    done = subprocess.run(limited(command, seconds), timeout=HANGS * seconds, **more)
    if used_up(done.returncode):
        raise subprocess.TimeoutExpired(command, seconds)
    return done
