"""A first run: a model that comes with the program, its strike, and where the link's end goes."""

import exudyn_flexlink as fl

scene = fl.load_scene("no_clearance", turns=1)
result = fl.simulate(scene)
print(result.summary())

for strike in result.strikes("strike"):
    print(f"{strike.contact} at {strike.begin:.5f} s: {strike.impulse:.3g} N s")

s = result.path("link.end")
print(f"S starts at {s.position[0]} m and ends at {s.position[-1]} m")

folder = result.save("runs/first_run")
for name, figure in result.plot.all().items():
    figure.savefig(folder / f"{name}.png")
