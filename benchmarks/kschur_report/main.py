"""The program kschur-report."""

import pathlib
import shutil
import sys

from . import plan
from .campaign import Runner, progress
from .hard_cases import run_hard_cases
from .machine import describe, now
from .page import write_report
from .problem import InputError, read_problem
from .runs import Campaign, read_campaign, write_campaign


def find_program(name, given, beside):
    """The path given, or the program beside another, or on the PATH; None where there is none."""
    for candidate in (given, beside and beside.parent / name, shutil.which(name)):
        if candidate and pathlib.Path(candidate).is_file():
            return pathlib.Path(candidate).resolve()
    return None


def studies_of(options):
    """What the options ask for: of the preset, or of one's own problem."""
    if options.problem:
        problem = read_problem(options.problem)
        studies = plan.of_problem(
            str(pathlib.Path(options.problem).resolve()),
            pathlib.Path(options.problem).name,
            options.modes,
            problem.constraints.shape[0] > 0,
            options.preset,
        )
    else:
        studies = plan.PRESETS[options.preset]()
    return plan.without_peers(studies) if options.no_peers else studies


def measure(options, folder, launcher):
    """Runs what the options ask for and stores it."""
    kschur = find_program("kschur", options.kschur, launcher)
    if kschur is None:
        raise InputError("the program kschur was not found; name it with --kschur")
    campaign = campaign_of_before(options, folder) if options.again else new_campaign(options, kschur)
    studies = studies_of(options)
    if options.again:
        studies = tuple(study for study in studies if study.name == options.again)
        if not studies:
            names = ", ".join(sorted({study.name for study in studies_of(options)}))
            raise InputError(f"--again {options.again}: preset {options.preset} has the studies {names}")
    folder.mkdir(parents=True, exist_ok=True)

    def keep():
        write_campaign(folder / "data.h5", campaign)

    if not options.problem and not options.again:
        add_hard_cases(options, campaign, kschur)
    Runner(kschur, campaign).run_plan(studies, after_each=keep)
    return campaign


def new_campaign(options, kschur):
    title = (
        f"kschur compared on {pathlib.Path(options.problem).name}"
        if options.problem
        else "kschur compared: speed against accuracy"
    )
    return Campaign(title, options.preset, describe(kschur), {"command": command_line()})


def campaign_of_before(options, folder):
    """The one in the folder, whose preset counts; it notes that a study was measured again, and when."""
    campaign = read_campaign(folder / "data.h5")
    options.preset = campaign.preset
    campaign.settings["command"] += "\n" + command_line()
    again = f"{options.again} again on {now()}"
    campaign.settings["again"] = ", ".join(filter(None, [campaign.settings.get("again"), again]))
    return campaign


def command_line():
    return " ".join(["kschur-report", *sys.argv[1:]])


def add_hard_cases(options, campaign, kschur):
    program = find_program("benchmark_hard_cases", options.hard_cases, kschur)
    if program is None:
        campaign.notes.append(
            "Stability map: left out. benchmark_hard_cases is not beside kschur; it is built with the tests."
        )
        return
    progress("hard cases")
    campaign.hard_cases = run_hard_cases(program, plan.HARD_GROUPS.get(options.preset, ()))


def main(options, launcher=None):
    """`launcher` is the path of the program that calls this."""
    try:
        folder = pathlib.Path(options.output)
        campaign = read_campaign(folder / "data.h5") if options.redraw else measure(options, folder, launcher)
        page = write_report(folder, campaign)
    except (InputError, OSError) as wrong:
        print(f"kschur-report: {wrong}", file=sys.stderr)
        sys.exit(2)
    print(page)
