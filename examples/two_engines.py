"""One scene by Exudyn and by the hand-written Lagrangian; then with and without flexibility."""

import exudyn_flexlink as fl

scene = fl.load_scene("no_clearance", turns=0.6, tolerance=1e-5)
exudyn = fl.simulate(scene)
lagrangian = fl.simulate(scene, engine="lagrangian")
compared = fl.compare(exudyn, lagrangian)
print(compared.summary())
compared.plot().savefig("two_engines.png")

rigid = fl.simulate(fl.idealise(scene, without=["flexibility"]))
print(fl.compare(rigid, exudyn, names=("rigid", "flexible")))
