import numpy as np
import pytest

from climber_uk.mechanics.waypoint_file import read_waypoints

POINTS = [[0.0, 1.5], [2.0, -3.25], [1e-3, 4.0]]

GOOD = {
    "blanks": "0 1.5\n2 -3.25\n1e-3 4\n",
    "tabs": "0\t1.5\n2\t-3.25\n1e-3\t4\n",
    "many blanks": "  0   1.5 \n 2 \t -3.25\n1e-3 4",
    "commas": "0,1.5\n2,-3.25\n1e-3,4\n",
    "commas and blanks": "0, 1.5\n2, -3.25\n1e-3,\t4\n",
    "semicolons": "0;1.5\n2;-3.25\n1e-3;4\n",
    "decimal commas": "0;1,5\n2;-3,25\n0,001;4\n",
    "decimal commas after a header": "x;y\r\n0;1,5\r\n2;-3,25\r\n0,001;4\r\n",
    "decimal commas between tabs": "0\t1,5\n2\t-3,25\n0,001\t4\n",
    "decimal commas in quotes": 'x,y\n0,"1,5"\n2,"-3,25"\n"0,001",4\n',
    "a separator in quotes": 'tag,x,y\n"a, # b",0,1.5\n"c",2,-3.25\n,1e-3,4\n',
    "header": "x,y\n0,1.5\n2,-3.25\n1e-3,4\n",
    "capitals, units and quotes": '"X [m]";"Y (m)"\n0;1.5\n2;-3.25\n1e-3;4\n',
    "other order": "y,x\n1.5,0\n-3.25,2\n4,1e-3\n",
    "more columns": "t,x,theta,y\n0,0,9,1.5\n1,2,9,-3.25\n2,1e-3,,4\n",
    "names in other columns": "name x y\nstart 0 1.5\nmiddle 2 -3.25\nend 1e-3 4\n",
    "header in a comment": "# t x y\n0 0 1.5\n1 2 -3.25\n2 1e-3 4\n",
    "header in a comment, separated otherwise": "# y, x\n1.5 0\n-3.25 2\n4 1e-3\n",
    "units behind underscores": "t_s,x_m,y_m\n0,0,1.5\n1,2,-3.25\n2,1e-3,4\n",
    "a separator told to Excel": "sep=;\nx;y\n0;1,5\n2;-3,25\n0,001;4\n",
    "a tab told to Excel": "sep=\t\nx\ty\n0\t1,5\n2\t-3,25\n0,001\t4\n",
    "units apart": "y [m] x [m]\n1.5 0\n-3.25 2\n4 1e-3\n",
    "trailing separators": "x,y,\n0,1.5,\n2,-3.25,\n1e-3,4,\n",
    "comments": "# a path\n0 1.5 # start\n\n// on\n2 -3.25\n   \n% end\n1e-3 4\n",
    "units in a comment": "# units: m\n% units in metres, not mm\n0 1.5\n2 -3.25\n1e-3 4\n",
    "byte order mark": "\ufeff0 1.5\n2 -3.25\n1e-3 4\n",
    "byte order mark and header": "\ufeffx,y\n0,1.5\n2,-3.25\n1e-3,4\n",
    "DOS": "0 1.5\r\n2 -3.25\r\n1e-3 4\r\n",
    "old Mac": "0 1.5\r2 -3.25\r1e-3 4\r",
    "blank lines": "\n\n0 1.5\n\n2 -3.25\n1e-3 4\n\n",
}


@pytest.mark.parametrize("text", GOOD.values(), ids=GOOD)
def test_points_are_read_however_they_are_written(tmp_path, text):
    file = tmp_path / "points.csv"
    file.write_bytes(text.encode())
    np.testing.assert_array_equal(read_waypoints(str(file))[0], POINTS)


def test_a_file_in_utf_16_is_read(tmp_path):
    file = tmp_path / "points.txt"
    file.write_text(GOOD["header"], encoding="utf-16")
    np.testing.assert_array_equal(read_waypoints(str(file))[0], POINTS)


BAD = {
    "empty": ("", "no points in it"),
    "only comments": ("# x y\n\n", "no points in it"),
    "only a header": ("x,y\n", "0 point(s), want >= 2"),
    "one point": ("1 2\n", "1 point(s), want >= 2"),
    "nan": ("1 2\n\n3 nan\n", "line 3: point 2 is not finite"),
    "infinite": ("1 2\n-inf 3\n", "line 2: point 2 is not finite"),
    "too large": ("1 2\n1e999 3\n", "line 2: point 2 is not finite"),
    "far away": ("1 2\n3 1e300\n", "line 2: point 2 at (3, 1e+300) m is beyond 1e+06 m"),
    "a word": ("1 2\nthree 4\n", "line 2: 'three' must be a number"),
    "a gap": ("x,y\n1,2\n3,\n", "line 3: '' must be a number"),
    "a digit's underscore": ("1 2\n1_0 4\n", "line 2: '1_0' must be a number"),
    "three columns": ("1 2 3\n4 5 6\n", "line 1: 3 columns without a header: want two columns"),
    "one column": ("1\n2\n", "line 1: 1 column(s), want 2"),
    "a short line": ("1 2\n3\n", "line 2: 1 column(s), want 2"),
    "a long line": ("x,y\n1,2\n3,4,5\n", "line 3: 3 column(s), want 2"),
    "other names": ("a,b\n1,2\n3,4\n", "line 1: want one column x and one y, found a, b"),
    "twice x": ("x,x,y\n1,2,3\n3,4,5\n", "line 1: want one column x and one y"),
    "millimetres": ("x [mm],y [mm]\n1,2\n3,4\n", "line 1: column 'x [mm]' must be in m"),
    "millimetres behind underscores": ("x_mm,y_mm\n1,2\n3,4\n", "'x_mm' must be in m"),
    "millimetres apart": ("# x [mm] y [mm]\n1 2\n3 4\n", "column 'x[mm]' must be in m"),
    "millimetres in a comment": ("# units: mm\n1 2\n3 4\n", "line 1: units of mm must be m"),
    "in words": ("1 2\n% all units are in Millimetres\n3 4\n", "line 2: units of Millimetres"),
    "not computed": ("x,y\n1,2\n#N/A,3\n4,5\n", "line 3: #N/A is a cell that a spreadsheet"),
    "not computed behind x": ("1;2\n3;#DIV/0!\n4;5\n", "line 2: #DIV/0! is a cell"),
    "not computed in German": ("1;2\n#WERT!;#BEZUG!\n4;5\n", "line 2: #WERT! is a cell"),
    "decimal commas between blanks": ("1,0 2,0\n3,0 4,0\n", "line 1"),
    "decimal commas between commas": ("0,5,1,5\n0,7,1,9\n", "line 1: 4 columns"),
    "decimal commas and points": ("1,5;2\n3.5;4\n", "line 2: '3.5' has a decimal point"),
    "thousands": ("1,000.5;2\n3;4\n", "line 1: '1,000.5' has a decimal point"),
    "two commas": ("1,000,5;2\n3;4\n", "line 1: '1,000,5' must be a number"),
    "no speed": ("x,y,speed\n1,2,0\n3,4,\n", "line 2: speed 0 must be > 0"),
    "back in time": ("x,y,dwell\n1,2,\n3,4,-1\n", "line 3: dwell -1 must be >= 0"),
    "for ever": ("x,y,dwell\n1,2,\n3,4,inf\n", "line 3: dwell inf must be >= 0, and finite"),
    "a speed in words": ("x,y,speed\n1,2,slow\n3,4,\n", "line 2: 'slow' must be a number"),
    "kilometres an hour": (
        "x,y,speed [km/h]\n1,2,1\n3,4,\n",
        "column 'speed [km/h]' must be in m/s",
    ),
    "twice a tag": ("x,y,tag,tag\n1,2,a,b\n3,4,,\n", "line 1: two columns tag"),
    "binary": ("\0\1\2", "is not a text file"),
}


@pytest.mark.parametrize(("text", "wrong"), BAD.values(), ids=BAD)
def test_a_bad_file_is_named_with_the_line_and_what_was_wanted(tmp_path, text, wrong):
    file = tmp_path / "bad.txt"
    file.write_text(text)
    with pytest.raises(ValueError) as error:  # noqa: PT011 - the text is what is compared
        read_waypoints(str(file))
    said = str(error.value)
    assert said.startswith(f"file={str(file)!r}: ")
    assert wrong in said
    assert "\n" not in said


def test_what_is_no_file_is_said_to_be_none(tmp_path):
    files = (tmp_path / "none", "not found"), (tmp_path, "is not a file")
    for path, wrong in (*files, ("~nobody-of-this-name/x", "there is no such user")):
        with pytest.raises(ValueError, match=wrong):
            read_waypoints(str(path))
    with pytest.raises(ValueError, match="is not a file"):
        read_waypoints("")
    file = tmp_path / "latin.txt"
    file.write_bytes(b"\xe9\xe8 1\n")
    with pytest.raises(ValueError, match="is not a text file"):
        read_waypoints(str(file))


def test_speed_dwell_and_tag_of_points_are_read_and_may_be_empty(tmp_path):
    file = tmp_path / "points.csv"
    file.write_text('tag;x [m];y;speed [m/s];dwell [s]\n"photo; #1";0;0;0,5;\n;1;0;;2\n')
    _, marks = read_waypoints(str(file))
    assert marks.tags == ("photo; #1", "")
    np.testing.assert_array_equal(marks.speed, [0.5, np.inf])
    np.testing.assert_array_equal(marks.dwell, [0.0, 2.0])
