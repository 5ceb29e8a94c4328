"""What failed once: the files in the folder cases, NAME.KIND, each judged as those at random are."""
from pathlib import Path

import hdf5_files
import texts
from cases import answers


def run(arguments, folder):
    """Yields (name, bytes, what is wrong) for what fails."""
    kept = sorted((Path(__file__).parent/"cases").iterdir())
    arguments.number = len(kept)
    given, names = [], []
    for path in kept:
        kind = path.suffix[1:]
        # Without a child process too, as callers of the library read files.
        for how in (kind, kind + "!") if kind in ("problem", "result") else (kind,):
            given.append((how, path.read_bytes()))
            names.append(f"{path.stem}.{how}")
    for name, (kind, content), answer in zip(names, given, answers(arguments.reader, given, folder)):
        if kind in texts.HOWS:
            wrong = texts.judge(kind, content, answer)
        else:
            wrong = hdf5_files.judge(kind.strip("!"), content, answer, set(), hdf5_files.Judge(folder))
        if wrong:
            yield name, content, wrong
