"""What a recipe says in the end."""
import inspect
import time

import numpy as np


def timed(call):
    """(what the call gives, seconds)."""
    start = time.perf_counter()
    value = call()
    return value, time.perf_counter() - start


def lines_of(function):
    """Lines of code of a function, without its head and what it says of itself."""
    lines = [line.strip() for line in inspect.getsource(function).splitlines()[1:]]
    return sum(bool(line) and not line.startswith(('"""', "#")) for line in lines)


def report(code, model, unknowns, glue, ours, theirs, taken, solved, own):
    """Prints sizes, lines of glue, the largest relative difference of eigenvalues or frequencies, and seconds."""
    ours, theirs = np.asarray(ours), np.asarray(theirs)
    if ours.shape != theirs.shape:
        raise SystemExit(f"{code}: {len(ours)} values, {len(theirs)} of its own")
    print(f"{code}: {model}, {unknowns} unknowns, {glue} lines of glue")
    print(f"largest difference {np.max(np.abs(ours - theirs) / np.abs(theirs)):.1e} of {len(ours)} values")
    print(f"seconds: kschur {solved:.3f}, after {taken:.3f} to take the matrices over; {code} {own:.3f}")
