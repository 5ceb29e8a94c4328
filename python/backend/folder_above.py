"""The build of the package from its own folder: that of the folder above."""
import os

from scikit_build_core.build import *  # noqa: F403

os.chdir("..")
