"""A figure for a paper, of one column: own axes, drawn from the numbers of a run."""

import matplotlib.pyplot as plt
import numpy as np

import exudyn_flexlink as fl

scene = fl.load_scene("no_clearance", turns=0.7, tolerance=1e-6)
result = fl.simulate(scene)
lever, (strike, *_) = result.lever("lever"), result.strikes("strike")
touches = result.touches("strike")

figure, axes = plt.subplots(figsize=(3.35, 2.2), layout="constrained")
axes.plot(1e3 * lever.time, np.degrees(lever.value), color="black", linewidth=0.8)
for begin, end in zip(touches.begin, touches.until(result.time[-1]), strict=True):
    axes.axvspan(1e3 * begin, 1e3 * end, color="tab:orange", alpha=0.5, linewidth=0)
axes.set_xlim(1e3 * strike.begin - 5, 1e3 * lever.time[-1])
axes.set_xlabel("time (ms)")
axes.set_ylabel("lever (deg)")
figure.savefig("lever.pdf")

# The program's own figures have a style for print, too: one column wide, without titles.
result.plot.coordinates(style="print").savefig("coordinates.pdf")
