#!/usr/bin/env python3
"""Problems that once failed, judged again: kept_cases.py KSCHUR [FOLDER ...]. Without folders, those in cases.

What is only flagged has failed too, unless flagged.txt in the folder says why no more is expected."""
import os
import sys
from pathlib import Path

from bands import judge_band
from case_folder import read_case
from judge import FLAGGED, judge_folder

program, *folders = sys.argv[1:]
folders = [Path(folder) for folder in folders] or sorted(f for f in Path(__file__).parent.glob("cases/*") if f.is_dir())
failures = 0
for folder in folders:
    problem = read_case(folder)
    judge = judge_band if "--band" in problem.command else judge_folder
    verdict = judge(os.path.abspath(program), folder, problem)
    expected = folder / "flagged.txt"
    failures += verdict.failed or (verdict.name == FLAGGED and not expected.exists())
    print(f"{folder.name}: {verdict}" + (f" (expected: {expected.read_text().strip()})" if expected.exists() else ""))
print(f"{failures} failed of {len(folders)}")
sys.exit(failures > 0 or not folders)
