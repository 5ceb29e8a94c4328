"""Modes of damped, constrained, possibly unsymmetric structures.

    result = kschur.solve(M, K, R, Cq, modes=20)      # matrices of SciPy or NumPy
    result                                            # prints as a table
    result.frequency_hz, result.damping_ratio, result.shapes
"""
from . import errors
from ._library import version as _version
from .codes import from_exudyn, from_opensees
from .convert import Problem, read
from .energies import strain_energy_shares
from .errors import Error
from .geometry import Geometry
from .loading import load
from .response import Response, frequency_response
from .result import Result
from .solving import solve
from .sweeping import Event, Onset, Sweep, sweep
from .viscoelastic import Material, ViscoelasticModes, solve_viscoelastic

__version__ = _version()
__all__ = ["Error", "Event", "Geometry", "Material", "Onset", "Problem", "Response", "Result", "Sweep", "ViscoelasticModes", "errors",
           "frequency_response", "from_exudyn", "from_opensees", "load", "read", "solve", "solve_viscoelastic", "strain_energy_shares",
           "sweep"]
