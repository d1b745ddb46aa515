"""Reads the files that mpfe writes into arrays of numpy, and compares runs.

  read_table(path)           .his .ero .frag .csv   {column: array}
  read_sta(path)             .sta                   {column: array}, which attempts were cut, exit code
  read_dat(path)             .dat                   list of tables
  read_chk(path)             .chk                   list of checks
  frames(job, kind)          times and files of the frames
  read_frame(path)           .vtk .vtu .pvtu        mesh and fields
  compare(a, b)              two tables             {column: Difference}

doc/python.md has the columns and worked examples. Errors are raised as FileError.
"""
import base64
import collections
import io
import json
import os
import re
import xml.etree.ElementTree

import numpy as np


class FileError(ValueError):
    """A file that is not what it should be."""


def open_text(path):
    """A file of text; a folder, a binary file or one that is missing is a FileError."""
    try:
        with open(path) as f:
            return io.StringIO(f.read())
    except (OSError, UnicodeDecodeError) as e:
        raise FileError("%s: %s" % (path, getattr(e, "strerror", None) or "not a file of text")) from e


def numbers_of(path, words):
    try:
        return [float(w) for w in words]
    except ValueError as e:
        raise FileError("%s: '%s' is no row of numbers" % (path, " ".join(words)[:60])) from e


# ---- tables -----------------------------------------------------------------------------------------------------

class Table(dict):
    """{column: array}; names in any case of letters."""

    def __init__(self, columns, path="table"):
        super().__init__(columns)
        self.path = path

    def key(self, name):
        """The name as the file has it, None when there is no such column."""
        return next((key for key in self if key.lower() == str(name).lower()), None)

    def __contains__(self, name):
        return self.key(name) is not None

    def get(self, name, default=None):
        return self[name] if name in self else default

    def __missing__(self, name):
        key = self.key(name)
        if key is None:
            raise FileError("%s: no column '%s'; there are: %s" % (self.path, name, " ".join(self)))
        return self[key]


def read_table(path):
    """Columns of .his, .ero, .frag or of a .csv file: {name: array}, in the order of the file. A table without rows
    has empty columns."""
    with open(path) as f:
        lines = [line.strip() for line in f]
    comma = path.endswith(".csv") or any("," in line for line in lines[:1] if not line.startswith("#"))
    names, rows = None, []
    for line in lines:
        if not line:
            continue
        words = [w.strip() for w in line.lstrip("# ").split("," if comma else None)]
        try:
            if line.startswith("#"):
                raise ValueError
            rows.append([float(w) if w else np.nan for w in words])
        except ValueError:
            if not rows:
                names = words          # the last line before the numbers
    if not rows and names is None:
        raise FileError("%s: no rows" % path)
    width = max((len(r) for r in rows), default=len(names or []))
    data = np.array([r + [np.nan] * (width - len(r)) for r in rows]).reshape(-1, width)
    if names is None or len(names) != width:
        names = ["c%d" % (i + 1) for i in range(width)]
    return Table({name: data[:, i] for i, name in enumerate(names)}, path)


def as_array(table):
    """The columns of a table side by side, [rows, columns]."""
    return np.column_stack(list(table.values()))


STA_COLUMNS = ("step", "inc", "att", "iters", "total_time", "step_time", "dt", "broken", "points", "wall")


def read_sta(path):
    """JOB.sta: table, cut, code. Columns step inc att iters total_time step_time dt broken points wall; cut: the attempts that were cut
    (1U in the file); exit code of the run, None while it runs or when it was killed. Of a run that was continued the rows after its
    restart file are left out."""
    rows, cut, code, fresh, known = [], [], None, False, False
    with open_text(path) as f:
        for line in f:
            words = line.split()
            if line.startswith("#"):
                known = known or "SUMMARY OF JOB" in line
                fresh = fresh or words[:1] == ["#STEP"]
                code = None if "SUMMARY OF JOB" in line else code
                if "(exit code " in line:
                    code = int(line.split("(exit code ")[1].split(")")[0])
                continue
            if len(words) != len(STA_COLUMNS):
                continue                   # the last line of a run that was killed
            row = numbers_of(path, [w.rstrip("U") for w in words])
            while fresh and rows and rows[-1][4] >= row[4]:
                rows.pop()
                cut.pop()
            fresh = False
            rows.append(row)
            cut.append(words[2].endswith("U"))
    if not known:
        raise FileError("%s: not a .sta file of mpfe, which begins with '# SUMMARY OF JOB INFORMATION'" % path)
    data = np.array(rows).reshape(-1, len(STA_COLUMNS))
    return Table({name: data[:, i] for i, name in enumerate(STA_COLUMNS)}, path), np.array(cut, dtype=bool), code


REAL = re.compile(r"[-+]?\d*\.\d+E[-+]\d+")


def read_dat(path):
    """JOB.dat: a list of {what, set, time, labels [n], values [n, columns]}; labels of elements have the number of the
    integration point as a second column, a total has no labels."""
    tables, number = [], 0
    with open_text(path) as f:
        for number, line in enumerate(f, 1):
            words = line.split()
            if " for set " in line and " and time " in line:
                what, rest = line.strip().split(" for set ")
                name, time = rest.rsplit(" and time ", 1)
                tables.append({"what": what, "set": name, "time": numbers_of(path, [time])[0], "labels": [], "values": []})
            elif words:
                values, labels = REAL.findall(line), REAL.sub(" ", line).split()
                if not tables or not values or not all(w.isdigit() for w in labels):
                    raise FileError("%s line %d: not a .dat file of mpfe, which has tables 'WHAT for set NAME and time T' with rows of "
                                    "labels and numbers" % (path, number))
                tables[-1]["labels"].append([int(w) for w in labels])
                tables[-1]["values"].append([float(w) for w in values])
    if number and not tables:
        raise FileError("%s: not a .dat file of mpfe: there is no table" % path)
    for t in tables:
        labels = np.array(t["labels"], dtype=int)
        t["labels"] = labels[:, 0] if labels.ndim == 2 and labels.shape[1] == 1 else labels
        t["values"] = np.array(t["values"])
    return tables


def read_chk(path):
    """JOB.chk: a list of {good, name, value, target, difference, tolerance, source}."""
    out = []
    with open_text(path) as f:
        for line in f:
            words = line.split("#")[0].split()
            if words and (words[0] not in ("PASS", "FAIL") or len(words) < 6):
                raise FileError("%s: not a .chk file of mpfe, whose lines begin with PASS or FAIL: '%s'" % (path, line.strip()[:60]))
            if words:
                numbers = dict(zip(("value", "target", "difference", "tolerance"), numbers_of(path, words[2:6])))
                out.append(dict(numbers, good=words[0] == "PASS", name=words[1], source=words[6] if len(words) > 6 else ""))
    return out


# ---- two runs ---------------------------------------------------------------------------------------------------

# largest difference, where on the axis, the largest value of b, their ratio, where the columns first part (nan: nowhere)
Difference = collections.namedtuple("Difference", "largest at scale relative parts")


def compare_columns(ta, va, tb, vb, rel=1e-9, absolute=0.0):
    """The column va over ta beside vb over tb, at the points of b that a covers, linear in between."""
    slack = 1e-9 * max(abs(ta[-1]), abs(tb[-1]))
    inside = (tb >= ta[0] - slack) & (tb <= ta[-1] + slack)
    if not inside.any():
        return Difference(np.nan, np.nan, 0.0, np.nan, np.nan)
    same = len(ta) == len(tb) and np.allclose(ta, tb, rtol=1e-12, atol=0.0)
    gap = np.where(inside, np.abs((va if same else np.interp(tb, ta, va)) - vb), 0.0)
    gap = np.where(np.isnan(gap), np.inf, gap)
    where, scale = int(np.argmax(gap)), float(np.nanmax(np.abs(vb)))
    apart = np.nonzero(gap > max(absolute, rel * scale))[0]
    relative = gap[where] / scale if scale > 0 else (0.0 if gap[where] == 0 else np.inf)
    return Difference(gap[where], tb[where], scale, relative, tb[apart[0]] if len(apart) else np.nan)


def compare(a, b, columns=None, axis="time", rel=1e-9, absolute=0.0):
    """Two tables: {column: Difference} for all columns that both have, or for those asked for. A column parts where the
    difference exceeds absolute and rel times the largest value of b."""
    known = {name.lower() for name in b}
    names = columns or [name for name in a if name.lower() in known and name.lower() != axis.lower()]
    return {name: compare_columns(a[axis], a[name], b[axis], b[name], rel, absolute) for name in names}


# ---- frames -----------------------------------------------------------------------------------------------------

def frames(job, kind="fe"):
    """[(time, path)] of the frames of a run, in the order of time. kind: fe, mp, bond or grid."""
    for ending in (".vtk.series", ".vtu.series", ".pvtu.series"):
        path = "%s_%s%s" % (job, kind, ending)
        if os.path.exists(path):
            with open(path) as f:
                listed = json.load(f)["files"]
            return [(x["time"], os.path.join(os.path.dirname(path), x["name"])) for x in listed]
    return []


class VtkReader:
    """Takes lines, words and numbers from a legacy VTK file one after the other."""

    def __init__(self, path):
        with open(path, "rb") as f:
            self.data = f.read()
        self.at = 0
        self.binary = False

    def line(self):
        end = self.data.find(b"\n", self.at)
        if end < 0:
            end = len(self.data)
        text = self.data[self.at:end].decode("ascii", "replace")
        self.at = end + 1
        return text

    def next_line(self):
        """The next line that is not empty, None at the end."""
        while self.at < len(self.data):
            text = self.line().strip()
            if text:
                return text
        return None

    def numbers(self, count, kind):
        if self.binary:
            size = np.dtype(kind).itemsize
            out = np.frombuffer(self.data, dtype=">" + kind, count=count, offset=self.at)
            self.at += size * count
            return out.astype(kind)
        words = []
        while len(words) < count:
            words += self.line().split()
        return np.array(words, dtype=kind)


VTK_KIND = {"float": "f4", "double": "f8", "int": "i4", "long": "i8"}


def read_vtk(path):
    """A file of ours: {time, points [n,3], cells (list of index arrays), types, point, cell (data by name)}."""
    r = VtkReader(path)
    if not r.line().startswith("# vtk DataFile"):
        raise FileError("%s: not a legacy VTK file" % path)
    out = {"title": r.line(), "time": 0.0, "points": None, "cells": [], "types": None, "point": {}, "cell": {}}
    r.binary = r.line().strip() == "BINARY"
    data, count = None, 0
    while True:
        text = r.next_line()
        if text is None:
            return out
        word = text.split()
        if word[0] == "FIELD":
            for _ in range(int(word[2])):
                name, size, tuples, kind = r.next_line().split()
                value = r.numbers(int(size) * int(tuples), VTK_KIND[kind])
                if name == "TIME":
                    out["time"] = float(value[0])
        elif word[0] == "POINTS":
            out["points"] = r.numbers(3 * int(word[1]), VTK_KIND[word[2]]).reshape(-1, 3)
        elif word[0] == "CELLS":
            flat, at = r.numbers(int(word[2]), "i4"), 0
            for _ in range(int(word[1])):
                out["cells"].append(flat[at + 1:at + 1 + flat[at]])
                at += 1 + flat[at]
        elif word[0] == "CELL_TYPES":
            out["types"] = r.numbers(int(word[1]), "i4")
        elif word[0] in ("POINT_DATA", "CELL_DATA"):
            data, count = out["point" if word[0] == "POINT_DATA" else "cell"], int(word[1])
        elif word[0] == "SCALARS":
            r.next_line()          # LOOKUP_TABLE default
            data[word[1]] = r.numbers(count, VTK_KIND[word[2]])
        elif word[0] == "VECTORS":
            data[word[1]] = r.numbers(3 * count, VTK_KIND[word[2]]).reshape(-1, 3)
        elif word[0] != "DATASET":
            raise FileError("%s: cannot read '%s'" % (path, text[:60]))


VTU_KIND = {"Float32": "f4", "Float64": "f8", "Int32": "i4", "Int64": "i8", "UInt8": "u1"}


def vtu_array(node, order, header="UInt32"):
    kind, size = VTU_KIND[node.get("type")], int(node.get("NumberOfComponents", "1"))
    text = (node.text or "").strip()
    if node.get("format") == "ascii":
        value = np.array(text.split(), dtype=kind)
    else:
        raw = base64.b64decode(text)
        value = np.frombuffer(raw, dtype=order + kind, offset=8 if header == "UInt64" else 4).astype(kind)      # the length
    return value.reshape(-1, size) if size > 1 else value


def read_vtu(path):
    """A .vtu file of ours, in the form of read_vtk."""
    root = xml.etree.ElementTree.parse(path).getroot()
    header = root.get("header_type", "UInt32")
    order = "<" if root.get("byte_order") == "LittleEndian" else ">"
    grid = root.find("UnstructuredGrid")
    piece = grid.find("Piece")
    take = lambda where: {a.get("Name"): vtu_array(a, order, header) for a in (piece.find(where) if piece.find(where) is not None else [])}
    cells = take("Cells")
    ends = cells["offsets"]
    starts = np.concatenate([[0], ends[:-1]]) if len(ends) else []
    out = {"title": os.path.basename(path), "time": 0.0, "points": vtu_array(piece.find("Points")[0], order, header),
           "cells": [cells["connectivity"][a:b] for a, b in zip(starts, ends)], "types": cells["types"].astype("i4"),
           "point": take("PointData"), "cell": take("CellData")}
    for a in grid.find("FieldData") if grid.find("FieldData") is not None else []:
        if a.get("Name") in ("TIME", "TimeValue"):
            out["time"] = float(np.ravel(vtu_array(a, order))[0])
    return out


def read_pvtu(path):
    """A .pvtu file of ours: its pieces as one mesh, in which a node that several pieces have stands once."""
    root = xml.etree.ElementTree.parse(path).getroot()
    folder = os.path.dirname(path)
    parts = [read_vtu(os.path.join(folder, p.get("Source"))) for p in root.iter("Piece")]
    first = np.cumsum([0] + [len(p["points"]) for p in parts])
    join = lambda of: np.concatenate([of(p) for p in parts])
    fields = lambda where: {key: join(lambda p: p[where][key]) for key in parts[0][where]}
    out = {"title": os.path.basename(path), "time": parts[0]["time"], "points": join(lambda p: p["points"]),
           "cells": [cell + at for p, at in zip(parts, first) for cell in p["cells"]], "types": join(lambda p: p["types"]),
           "point": fields("point"), "cell": fields("cell")}
    label = out["point"].get("node_label")
    if label is None:
        return out
    _, keep, number = np.unique(label, return_index=True, return_inverse=True)
    out["points"], out["cells"] = out["points"][keep], [number[cell] for cell in out["cells"]]
    out["point"] = {key: value[keep] for key, value in out["point"].items()}
    return out


def read_frame(path):
    """A frame, legacy or XML by its ending."""
    return read_pvtu(path) if path.endswith(".pvtu") else read_vtu(path) if path.endswith(".vtu") else read_vtk(path)
