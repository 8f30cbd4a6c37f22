"""Pictures of the study show the committed rows."""

import pytest

from benchmarks import figures


@pytest.mark.parametrize("picture", figures.pictures(), ids=lambda picture: picture.path.name)
def test_each_picture_shows_its_committed_rows(picture):
    assert picture.is_current(), "python -m benchmarks.figures draws it"
