"""A rotor on two bearings by ROSS (ross-rotordynamics from PyPI): modes at a speed, the Campbell diagram, and unbalance."""
import numpy as np
import ross
from comparison import lines_of, report, timed

import kschur

SPEED = 400.0
SPEEDS = np.linspace(0.0, 800.0, 9)
NODE, UNBALANCE = 11, 1e-4


def build():
    steel = ross.Material("steel", rho=7810, E=211e9, G_s=81.2e9)
    shaft = [ross.ShaftElement(L=0.05, idl=0.0, odl=0.05, material=steel, n=k) for k in range(30)]
    disks = [ross.DiskElement.from_geometry(n=n, material=steel, width=0.07, i_d=0.05, o_d=0.28) for n in (NODE, 20)]
    bearings = [ross.BearingElement(n=n, kxx=1e7, kyy=2e7, cxx=500.0, cyy=800.0) for n in (0, 30)]
    return ross.Rotor(shaft, disks, bearings)


def glue(rotor, speed):
    return rotor.M(speed), rotor.K(speed), rotor.C(speed) + rotor.G()*speed


def upper(eigenvalues, count):
    """Of each conjugate pair that oscillates one, the lowest first."""
    return np.array(sorted(eigenvalues[eigenvalues.imag > 1.0], key=abs))[:count]


rotor = build()
rotor.run_modal(0.0, num_modes=40)      # compiles what ROSS compiles once
own, seconds = timed(lambda: rotor.run_modal(SPEED, num_modes=40))
matrices, taken = timed(lambda: glue(rotor, SPEED))
result, solved = timed(lambda: kschur.solve(*matrices, modes=14))
print(result)
report("ross", f"rotor on two bearings at {SPEED:.0f} rad/s", result.unknowns, lines_of(glue), upper(result.eigenvalues, 10),
       upper(own.evalues, 10), taken, solved, seconds)

campbell, seconds = timed(lambda: rotor.run_campbell(SPEEDS, frequencies=6))
sweep, solved = timed(lambda: kschur.sweep(lambda speed: glue(rotor, speed), SPEEDS, modes=10, parameter="speed", unit="rad/s"))
difference = max(np.abs(upper(found, 5)/upper(campbell.modal_results[speed].evalues, 5) - 1).max()
                 for found, speed in zip(sweep.eigenvalues, SPEEDS))
print(f"Campbell diagram of {len(SPEEDS)} speeds: kschur {solved:.3f} s, ross {seconds:.3f} s; {sweep.frequency_hz.shape[1]} branches, "
      f"largest difference {difference:.1e}")

omega = np.linspace(50.0, 800.0, 40)
response, seconds = timed(lambda: rotor.run_unbalance_response(node=NODE, unbalance_magnitude=UNBALANCE, unbalance_phase=0.0, frequency=omega))
force = np.zeros(rotor.ndof, complex)
force[6*NODE:6*NODE + 2] = UNBALANCE, -1j*UNBALANCE
ours, solved = timed(lambda: kschur.frequency_response(
    rotor.M(0.0), rotor.K(0.0), [rotor.C(speed) + rotor.G()*speed for speed in omega], frequencies=omega/(2*np.pi), forces=force))
displacement = ours.displacement.T * omega**2
difference = np.abs(displacement - response.forced_resp).max() / np.abs(response.forced_resp).max()
print(f"unbalance at {len(omega)} speeds: kschur {solved:.3f} s, ross {seconds:.3f} s, largest difference {difference:.1e}")
