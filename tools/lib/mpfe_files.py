"""Readers of the files that mpfe writes: history (.his), tables (.csv), VTK (legacy .vtk, .vtu and .pvtu).

Importing this module makes sure that numpy is there: when the running interpreter has none,
the script starts again under /usr/bin/python3.
"""
import base64
import os
import sys
import xml.etree.ElementTree

try:
    import numpy as np
except ImportError:
    SYSTEM_PYTHON = "/usr/bin/python3"
    if os.environ.get("MPFE_PYTHON_TRIED") or not os.path.exists(SYSTEM_PYTHON):
        sys.exit("this tool needs python3 with numpy and matplotlib (Debian: python3-numpy python3-matplotlib)")
    os.environ["MPFE_PYTHON_TRIED"] = "1"
    os.execv(SYSTEM_PYTHON, [SYSTEM_PYTHON] + sys.argv)
os.environ.pop("MPFE_PYTHON_TRIED", None)      # a script started from here looks for itself


def read_table(path):
    """Columns of a .his file or of a .csv file: {name: array}, in the order of the file."""
    with open(path) as f:
        lines = [line.strip() for line in f]
    comma = path.endswith(".csv") or any("," in line for line in lines[:3])
    names, rows = None, []
    for line in lines:
        if not line:
            continue
        head = line.startswith("#")
        words = line.lstrip("# ").split("," if comma else None)
        words = [w.strip() for w in words]
        try:
            if head:
                raise ValueError
            rows.append([float(w) if w else np.nan for w in words])
        except ValueError:
            if not rows:
                names = words          # the last line before the numbers
    if not rows:
        sys.exit("%s: no rows" % path)
    width = max(len(r) for r in rows)
    data = np.array([r + [np.nan] * (width - len(r)) for r in rows])
    if names is None or len(names) != width:
        names = ["c%d" % (i + 1) for i in range(width)]
    return {name: data[:, i] for i, name in enumerate(names)}


def column(table, name, path):
    """A column by its name, in any case of letters."""
    for key in table:
        if key.lower() == name.lower():
            return table[key]
    sys.exit("%s: no column '%s'; there are: %s" % (path, name, " ".join(table)))


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
        sys.exit("%s: not a legacy VTK file" % path)
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
            sys.exit("%s: cannot read '%s'" % (path, text[:60]))


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
