"""Natural frequencies by Exudyn's own eigenvalue solver; `check cantilever` tells the same four."""

import numpy as np

import exudyn_flexlink as fl

system = fl.exudyn_system(fl.load_scene("cantilever"))
print(system)

frequencies, _ = system.mbs.ComputeODE2Eigenvalues(convert2Frequencies=True)
for mode, frequency in enumerate(np.sort(frequencies)[:4], start=1):
    print(f"mode {mode}: {frequency:6.2f} Hz")
