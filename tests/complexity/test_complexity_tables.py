"""Lists of reports: full precision as CSV, and the walk that all assume."""

import pytest

from hierroom.commands.complexity import main
from hierroom.complexity import analyze
from hierroom.support.errors import InputError


def test_walk_option_changes_the_list_and_csv_is_precise(capsys):
    main(["--graph", "a", "c", "--walk", "0.5", "0.4", "0.1"])
    assert "c 4 1 9 14 10.61 60.8 53.2" in " ".join(capsys.readouterr().out.split())
    main(["--graph", "a", "c", "--csv"])
    assert capsys.readouterr().out.splitlines()[1].split(",")[-2] == repr(analyze("a").expected_steps)
    with pytest.raises(InputError, match=r"must sum to 1, not 1\.3"):
        main(["--walk", "0.5", "0.4", "0.4"])
