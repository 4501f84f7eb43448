"""A load and a sensor of one's own, solved by Exudyn alone; then the same load in the model."""

import exudyn as exu  # before the package, so that Exudyn checks item numbers
import numpy as np
from exudyn.itemInterface import LoadForceVector, SensorMarker

import exudyn_flexlink as fl

FORCE, SPEED, END, STEPS = 0.02, 30.0, 0.3, 6000  # N, rad/s, s

# One lap of the paper's mechanism, of whose track Exudyn keeps an ellipse by itself.
scene = fl.idealise(fl.load_scene("no_clearance", duration=END), without="impact")
scene = scene.with_({"joints.pin.curve": "ellipse"})
system = fl.exudyn_system(scene)
mbs, [end] = system.mbs, system.points["link.end"]
print(system)


def push(_mbs, time, _load):
    """Return the force at a time, N."""
    return [0.0, FORCE * np.sin(SPEED * time), 0.0]


mbs.AddLoad(LoadForceVector(markerNumber=end, loadVectorUserFunction=push))
sensor = mbs.AddSensor(
    SensorMarker(
        markerNumber=end, outputVariableType=exu.OutputVariableType.Position, storeInternal=True
    )
)
mbs.Assemble()  # again, with what was added
# The force begins at 0, so that accelerations at time 0 are those of the scene.
mbs.systemData.SetODE2Coordinates_tt(system.accelerations, exu.ConfigurationType.Initial)

settings = exu.SimulationSettings()
settings.timeIntegration.endTime = END
settings.timeIntegration.numberOfSteps = STEPS
settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
settings.timeIntegration.generalizedAlpha.computeInitialAccelerations = False
settings.solution.sensors.writePeriod = END / 100
settings.solution.file.write = False
mbs.SolveDynamic(settings)
own = mbs.GetSensorStoredData(sensor)  # rows of time, x, y, z

value = [0, f"{FORCE} N * sin({SPEED} rad/s * t)"]
drive = {"type": "force", "point": "link.end", "value": value}
result = fl.simulate(scene.with_({"drives.push": drive, "run.sample": END / 100}))
path = result.path("link.end")
apart = max(
    np.abs(np.interp(path.time, own[:, 0], own[:, k + 1]) - path.position[:, k]).max()
    for k in (0, 1)
)
print(f"the end of the link is {apart:.1e} m apart at most")
