"""A short run of the loader's fuzzing, and what the long ones found."""

import pytest
from fuzzing.inputs import INPUTS
from fuzzing.trying import loads
from hypothesis import HealthCheck, Phase, given, settings

from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.source import SceneError

CLEARANCE = "models/clearance.yaml"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fuzzing")


@settings(
    max_examples=60,
    deadline=None,
    derandomize=True,
    database=None,
    phases=(Phase.generate,),
    suppress_health_check=list(HealthCheck),
)
@given(given_input=INPUTS)
def test_whatever_is_given_a_scene_or_a_mistake_comes_out(given_input, folder):
    loads(given_input, folder)


# --- found by fuzzing ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        # Their product was 0: no section.
        ("bodies.link.section.width=1e-300", "must be 1e-30 or greater in SI units"),
        # Squares of distances were inf, with a warning of numpy's.
        ("curves.ellipse.centre=[1.4e154, 0]", "must not exceed 1e+20 in SI units"),
        ("curves.egg.pieces.0.centre=[0, -1e200]", "must not exceed 1e+20 in SI units"),
    ],
)
def test_numbers_beyond_all_bounds_are_refused(setting, words, request):
    model = request.config.rootpath / CLEARANCE
    with pytest.raises(SceneError, match=words.replace("+", r"\+")):
        load_scene(model, [setting])


def test_two_hundred_rods_with_clearance_are_checked(request):
    """It took 20 s: a mass matrix was factorised for every node of the link."""
    scene = load_scene(request.config.rootpath / CLEARANCE, ["bodies.link.rods=200"])
    assert scene.bodies["link"].rods == 200
