"""An own change, then a parameter varied: how hard the lever is struck at several speeds."""

import exudyn_flexlink as fl

scene = fl.load_scene("no_clearance", turns=0.6, tolerance=1e-5)
scene = scene.with_({"bodies.link.rods": 3, "bodies.link.section.thickness": "0.8 mm"})

print("speed     approach   peak force  lever")
for speed in (8, 10, 12):
    result = fl.simulate(scene.with_({"drives.motor.value": f"{speed} rad/s"}))
    for strike in result.strikes("strike"):
        angle = result.lever("lever").farthest
        print(
            f"{speed:2} rad/s  {strike.approach_speed:.3f} m/s  "
            f"{strike.peak_force:6.3f} N   {angle:+.4f} rad"
        )
