"""Objects of another class than the one that is needed get one sentence, not an AttributeError."""

import numpy as np
import pytest

import jointfrf as jf

FREQ = np.arange(1.0, 6.0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda h: jf.virtual_points(h, h), "side_j must be a VirtualPoint, not ndarray"),
        (lambda h: jf.virtual_interface(None, h), "side_j must be a VirtualPoint, not NoneType"),
        (lambda h: jf.multi_point_stiffness(h, "j", "k"), "side_j must be a VirtualPoint, not str"),
        (lambda h: jf.multi_point_compliance(h, "j", "k"), "side_j must be a VirtualPoint, not str"),
        (lambda h: jf.sensor_consistency(h, h), "point must be a VirtualPoint, not ndarray"),
        (lambda h: jf.impact_consistency(h, h), "point must be a VirtualPoint, not ndarray"),
        (lambda h: jf.channel_geometry(h, {}), "channel must be a str, not ndarray"),
        (lambda h: jf.elastic_centre(h), "joint must be a Joint, not ndarray"),
        (lambda h: jf.as_bands(None, ["x"], None), "freq_hz must hold real numbers, not object"),
    ],
)
def test_the_argument_is_named(random_lines, call, message):
    with pytest.raises(TypeError, match=f"^{message}$"):
        call(random_lines(5, 2))
