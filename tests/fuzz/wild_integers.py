"""Command lines that are sound but for whole numbers near the ends of what a word holds, and near those divided by what they may
be multiplied with. Judged as other command lines are, within so much memory that a number which is asked of it fails."""
import random
import resource
import shutil

import command_lines

MEMORY = 6*10**9
# So many points of a sweep are solved one by one, which takes as long as it is asked for; of more it is refused.
LONG, REFUSED = 100, 10000
POWERS = (0, 3, 7, 8, 15, 16, 20, 24, 27, 28, 29, 30, 31, 32, 53, 62, 63, 64)
FACTORS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 40, 60, 100, 1000, 1000000)
ITERATION = (b"--modes", b"--subspace", b"--block", b"--max-restarts", b"--threads", b"--distribute", b"--groups")
# The command with its inputs, and its options that take whole numbers; # stands for one.
FORMS = (
    ((b"solve", b"problem.h5"), ITERATION + (b"--memory",)),
    ((b"solve", b"problem.h5", b"--formulation", b"quadratic"), ITERATION),
    ((b"solve", b"problem.h5", b"--formulation", b"damped-constrained"), ITERATION),
    ((b"solve", b"problem.h5", b"--method", b"arpack"), ITERATION),
    ((b"solve", b"undamped.h5", b"--formulation", b"symmetric"), ITERATION),
    ((b"solve", b"undamped.h5", b"--left", b"--certify"), ITERATION),
    ((b"solve", b"undamped.h5", b"--formulation", b"undamped-constrained"), ITERATION),
    ((b"solve", b"problem.h5", b"--band", b"0,1"), ITERATION[1:]),
    ((b"info", b"problem.h5"), ITERATION[:1]),
    ((b"compare", b"undamped.h5"), ITERATION),
    ((b"sensitivity", b"problem.h5", b"problem.h5"), ITERATION),
    ((b"sweep", b"problem.h5", b"undamped.h5"), ITERATION),
    ((b"sweep", b"spring-chain", b"--vary", b"mass=1:2:#"), ITERATION),
    ((b"response", b"problem.h5", b"--input", b"#", b"--frequencies", b"0.1:1:#"), (b"--at",)),
    ((b"response", b"problem.h5", b"--input", b"1", b"--frequencies", b"0.1:1:3"), (b"--at",)),
    ((b"view", b"result.h5", b"--output", b"frames"), (b"--frames", b"--modes")),
    ((b"scene", b"grid", b"--cells", b"#x3", b"--output", b"out.h5"), (b"--dashpots",)),
    ((b"scene", b"spring-chain", b"--output", b"out.h5"), (b"--masses",)),
    ((b"scene", b"rotor", b"--output", b"out.h5"), (b"--elements",)),
    ((b"scene", b"pendulum", b"--output", b"out.h5"), (b"--bars",)),
    ((b"scene", b"linkage", b"--output", b"out.h5"), (b"--loops", b"--cells-per-loop")),
    ((b"scene", b"free-free", b"--output", b"out.h5"), (b"--bodies", b"--elements")))


def wild(draw):
    """A whole number, near a power of two or that divided by a factor."""
    number = 2**draw.choice(POWERS)//draw.choice(FACTORS) + draw.choice((-2, -1, 0, 0, 1, 2))
    return b"%d" % (-number if draw.random() < 0.1 else number)


def make(seed, number):
    draw = random.Random(f"integers {seed} {number}")
    words, options = draw.choice(FORMS)
    words = [word.replace(b"#", wild(draw) if draw.random() < 0.7 else b"2") for word in words]
    words = [b"mass=1:2:%d" % LONG if word.startswith(b"mass=") and LONG < int(word[9:]) <= REFUSED else word for word in words]
    for option in draw.sample(options, min(len(options), draw.choice((1, 1, 1, 2, 3)))):
        words += [option, wild(draw)]
    return words


def limit():
    command_lines.limit()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def prepare(template, arguments):
    command_lines.prepare(template, arguments)
    command_lines.subprocess.run([arguments.kschur, "scene", "grid", "--cells", "3x2", "--damping", "none", "--output",
                                  template/"undamped.h5"], env=command_lines.ENVIRONMENT, capture_output=True, check=True)


def run(arguments, folder):
    """Yields (name, the words, what is wrong) for what fails."""
    prepare(folder/"template", arguments)
    for number in range(arguments.number):
        place = folder/"place"
        shutil.copytree(folder/"template", place)
        words = make(arguments.seed, number)
        wrong = command_lines.judge(arguments.kschur, words, place, limit)
        shutil.rmtree(place)
        if wrong:
            yield f"{arguments.seed}-{number}.words", b"\0".join(words), f"{words}: {wrong}"
