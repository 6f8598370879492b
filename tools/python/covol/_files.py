"""Writes arrays as files for the program covol, and reads its output files as arrays."""
import gzip
import io
import re

import numpy as np

from ._errors import Error

_NRRD_TYPES = {"uint8": "uint8", "int8": "int8", "uint16": "uint16", "int16": "int16", "uint32": "uint32", "int32": "int32",
               "float32": "float", "float64": "double"}
_PLY_TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4", "double": "f8"}


def write_nrrd(path, image):
    """Writes an image (array, spacing, origin, direction, unit) as a file from which covol reads identical values."""
    array = np.ascontiguousarray(image.array)
    if array.dtype == bool:
        array = array.astype(np.uint8)
    if array.dtype.name not in _NRRD_TYPES:
        array = array.astype(np.float32)
    axes = np.asarray(image.direction) * np.asarray(image.spacing)
    vectors = " ".join("(" + ",".join(repr(float(x)) for x in axes[:, a]) + ")" for a in range(3))
    head = ["NRRD0004", f"type: {_NRRD_TYPES[array.dtype.name]}", "dimension: 3", "space dimension: 3",
            "sizes: " + " ".join(map(str, array.shape[::-1])), f"space directions: {vectors}", "endian: little", "encoding: raw",
            "space origin: (" + ",".join(repr(float(x)) for x in image.origin) + ")"]
    if image.unit:
        head.insert(4, "space units: " + " ".join([f'"{image.unit}"'] * 3))
    with open(path, "wb") as file:
        file.write(("\n".join(head) + "\n\n").encode())
        file.write(array.astype(array.dtype.newbyteorder("<"), copy=False).tobytes())


def read_nrrd(path):
    """The voxels of a three-dimensional NRRD file written by covol: array of shape (nz, ny, nx)."""
    with open(path, "rb") as file:
        fields = {}
        for line in iter(lambda: file.readline().decode("utf-8", "replace").rstrip("\r\n"), ""):
            name, colon, value = line.partition(": ")
            if colon:
                fields[name] = value
        names = {value: key for key, value in _NRRD_TYPES.items()}
        names.update({"unsigned char": "uint8", "signed char": "int8", "unsigned short": "uint16", "short": "int16", "unsigned int": "uint32",
                      "int": "int32"})
        if fields.get("type") not in names or fields.get("encoding") not in ("raw", "gzip"):
            raise Error(f"{path}: expected a NRRD file as covol writes it, got type {fields.get('type')}, "
                        f"encoding {fields.get('encoding')}", "io")
        data = gzip.decompress(file.read()) if fields["encoding"] == "gzip" else file.read()
    shape = tuple(int(n) for n in reversed(fields["sizes"].split()))
    values = np.frombuffer(data, np.dtype(names[fields["type"]]).newbyteorder("<" if fields.get("endian") != "big" else ">"))
    return values.reshape(shape).astype(names[fields["type"]], copy=False)


def read_ply(path):
    """Reads a binary PLY file of triangles: (vertex attributes by name, faces of shape (m, 3))."""
    with open(path, "rb") as file:
        head = []
        for line in iter(file.readline, b""):
            head.append(line.decode("ascii", "replace").strip())
            if head[-1] == "end_header":
                break
        if "format binary_little_endian 1.0" not in head:
            raise Error(f"{path}: expected a binary PLY file as covol writes it", "io")
        counts = {m[1]: int(m[2]) for m in (re.match(r"element (\w+) (\d+)", line) for line in head) if m}
        columns = [(m[2], "<" + _PLY_TYPES[m[1]]) for m in (re.match(r"property (\w+) (\w+)$", line) for line in head) if m]
        vertices = np.frombuffer(file.read(counts["vertex"] * np.dtype(columns).itemsize), columns)
        faces = np.frombuffer(file.read(), [("count", "u1"), ("corners", "<u4", 3)], counts["face"])
    return {name: vertices[name].copy() for name, _ in columns}, faces["corners"].copy()


def write_ply(path, vertices, faces=None, normals=None):
    """Writes positions, as doubles, with normals or triangles, as a binary PLY file."""
    columns = [(name, "<f8") for name in ("x", "y", "z")]
    values = [np.asarray(vertices, float)]
    if normals is not None:
        columns += [(name, "<f4") for name in ("nx", "ny", "nz")]
        values.append(np.asarray(normals, float))
    table = np.zeros(len(values[0]), columns)
    for (name, _), column in zip(columns, np.concatenate(values, axis=1).T):
        table[name] = column
    types = {"<f8": "double", "<f4": "float"}
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(table)}",
            *(f"property {types[kind]} {name}" for name, kind in columns)]
    if faces is not None:
        head += [f"element face {len(faces)}", "property list uchar uint vertex_indices"]
    with open(path, "wb") as file:
        file.write(("\n".join([*head, "end_header"]) + "\n").encode())
        file.write(table.tobytes())
        if faces is not None:
            rows = np.zeros(len(faces), [("count", "u1"), ("corners", "<u4", 3)])
            rows["count"], rows["corners"] = 3, faces
            file.write(rows.tobytes())


def write_positions(path, positions, lines=None):
    """Writes world positions as a table; each element of `lines`, a list of positions, becomes an ordered line in it."""
    text = io.StringIO()
    if lines is None:
        np.savetxt(text, np.asarray(positions, float).reshape(-1, 3), "%.17g", ",", header="x,y,z", comments="")
    else:
        text.write("x,y,z,contour\n")
        for n, line in enumerate(lines):
            for x, y, z in np.asarray(line, float).reshape(-1, 3):
                text.write(f"{x:.17g},{y:.17g},{z:.17g},{n}\n")
    with open(path, "w", encoding="ascii") as file:
        file.write(text.getvalue())


def read_positions(path):
    """(n, 3) from a table x, y, z written by covol; comment lines begin with #."""
    with open(path, encoding="utf-8") as file:
        rows = [line for line in file if line[:1] not in "#\n" and line[0] in "+-.0123456789"]
    return np.array([[float(word) for word in row.split(",")[:3]] for row in rows]).reshape(-1, 3)
