"""Andrews' squeezing mechanism, against published numbers and equations written for it alone.

Seven angles as in the IVP test set; the program below is checked against the accelerations that are
published, then integrated. The published angles at the end are numbers of test_verification.
"""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from exudyn_flexlink import load_scene, simulate

MODEL = Path(__file__).parents[1] / "models" / "benchmarks" / "andrews_squeezer.yaml"
NAMES = ("crank", "coupler", "triangle", "upper", "upper_arm", "lower", "lower_arm")
# kg and kg m^2, in that order
MASSES = np.array([0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498])
INERTIAS = np.array([2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5])
A, B, C = complex(-0.06934, -0.00227), complex(-0.03635, 0.03273), complex(0.014, 0.072)  # m
# beta, Theta, gamma, Phi, delta, Omega, epsilon
START = np.array(
    [-0.0617138900142764, 0.0, 0.455279819163070, 0.222668390165886, 0.487364979543843,
     -0.222668390165886, 1.23054744454982]
)  # fmt: skip
END = np.array(  # at 0.03 s
    [15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948,
     0.5244099658805304, 0.5347301163226948, 1.048080741042263]
)  # fmt: skip
# Angles of the bodies against the ground, from those of the test set.
TURNS = np.zeros((7, 7))
for body, angles in enumerate(((0,), (0, 1), (2,), (3, 4), (4,), (5, 6), (6,))):
    TURNS[body, list(angles)] = 1.0

# Every point is a sum of arms, each turning with one body: (body, arm in m).
TO_E = ((0, 7e-3), (1, -28e-3))
CENTRES = (
    ((0, 0.92e-3),),
    ((0, 7e-3), (1, -11.5e-3)),
    ((2, complex(10.43e-3, -18.74e-3)),),
    (*TO_E, (3, 14.21e-3j)),
    ((4, complex(23.08e-3, 9.16e-3)),),
    (*TO_E, (5, -14.21e-3)),
    ((6, complex(-4.49e-3, -12.28e-3)),),
)
SPRING_END = ((2, complex(20e-3, -18e-3)),)
LOOPS = (  # arms that sum up to a constant
    ((*TO_E, (2, 35e-3j)), B),
    ((*TO_E, (3, 20e-3j), (4, -40e-3)), A),
    ((*TO_E, (5, -20e-3), (6, 40e-3j)), A),
)


def turned(arms, theta, rate):
    """Sum of arms, its derivative by the angles (7,), and its acceleration at constant rates."""
    by = np.zeros(7, complex)
    place = away = 0j
    for body, arm in arms:
        now = arm * np.exp(1j * theta[body])
        place, away = place + now, away - now * rate[body] ** 2
        by[body] += 1j * now
    return place, by, away


def accelerations(q, v, stiffness):
    """Angular accelerations (7,) rad/s^2 of the test set's angles, and multipliers (6,) N."""
    theta, rate = TURNS @ q, TURNS @ v
    M, f = TURNS.T @ np.diag(INERTIAS) @ TURNS, np.zeros(7)
    f[0] = 0.033
    for mass, arms in zip(MASSES, CENTRES, strict=True):
        _, by, away = turned(arms, theta, rate)
        by = by @ TURNS
        M += mass * (by[:, None] * by.conj()).real
        f -= mass * (by.conj() * away).real
    end, by, _ = turned(SPRING_END, theta, rate)
    spring = C - B - end
    pull = stiffness * (abs(spring) - 77.85e-3) * spring / abs(spring)
    f += ((by @ TURNS).conj() * pull).real
    G, bias = np.zeros((6, 7)), np.zeros(6)
    for i, (arms, _) in enumerate(LOOPS):
        _, by, away = turned(arms, theta, rate)
        by = by @ TURNS
        G[2 * i : 2 * i + 2] = by.real, by.imag
        bias[2 * i : 2 * i + 2] = away.real, away.imag
    whole = np.block([[M, G.T], [G, np.zeros((6, 6))]])
    found = np.linalg.solve(whole, np.concatenate((f, -bias)))
    return found[:7], found[7:]


def open_by(q):
    """Largest gap in the loops, m."""
    return max(abs(turned(arms, TURNS @ q, q)[0] - there) for arms, there in LOOPS)


def test_the_transcription_has_the_published_accelerations():
    assert open_by(START) < 1e-15
    found, multipliers = accelerations(START, np.zeros(7), 4530.0)
    np.testing.assert_allclose(found[:2], (14222.4439199541, -10666.8329399656), rtol=1e-11)
    np.testing.assert_allclose(
        np.abs(multipliers), (98.5668703962411, 6.12268834425567, 0, 0, 0, 0), atol=1e-9
    )


@pytest.fixture(scope="module")
def truth():
    """Angles of the bodies (7,) rad at any time of the run, to 1e-10 rad."""
    solved = solve_ivp(
        lambda _, y: np.concatenate((y[7:], accelerations(y[:7], y[7:], 4530.0)[0])),
        (0.0, 0.03),
        np.concatenate((START, np.zeros(7))),
        method="DOP853",
        rtol=1e-13,
        atol=1e-13,
        dense_output=True,
    )
    assert open_by(solved.y[:7, -1]) < 1e-12
    np.testing.assert_allclose(solved.y[:7, -1], END, rtol=1e-9)
    return solved.sol


@pytest.mark.parametrize("tolerance", [1e-3, 1e-8])
def test_every_angle_keeps_the_tolerance(truth, tolerance):
    """Of the longest arm, 42 mm, whose ends move by the error of its angle."""
    result = simulate(load_scene(MODEL, [f"accuracy.tolerance={tolerance}"]), measure=False)
    assert result.outcome.completed
    angles = result.poses[:, [result.part_names.index(name) for name in NAMES], 2]
    exact = truth(result.time)[:7].T @ TURNS.T
    assert np.abs(angles - exact).max() * 0.042 < tolerance
