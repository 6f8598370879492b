"""PLY files: vertices (n x 3, float64) and triangles (m x 3, int), as numpy arrays. Reads binary little-endian and ASCII."""
import numpy as np

TYPES = {"char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "<i2", "int16": "<i2", "ushort": "<u2", "uint16": "<u2",
         "int": "<i4", "int32": "<i4", "uint": "<u4", "uint32": "<u4", "float": "<f4", "float32": "<f4", "double": "<f8",
         "float64": "<f8"}


def read(path):
    """(vertices, triangles); without triangles an array with no rows. @throws ValueError if a face is not a triangle"""
    with open(path, "rb") as file:
        layout, elements = _header(file)
        data = file.read()
    if layout == "ascii":
        words = np.array(data.split(), float)
    vertices, triangles, at = np.empty((0, 3)), np.empty((0, 3), int), 0
    for name, count, properties in elements:
        if name not in ("vertex", "face"):
            continue
        fields = [(field, TYPES[kind]) if isinstance(kind, str) else (field, [("n", TYPES[kind[0]]), ("v", TYPES[kind[1]], 3)])
                  for field, kind in properties]
        if layout == "ascii":
            width = sum(1 if isinstance(kind, str) else 4 for _, kind in fields)
            table = words[at:at + count * width].reshape(count, width)
            at += count * width
            if name == "vertex":
                names = [field for field, _ in fields]
                vertices = table[:, [names.index(axis) for axis in "xyz"]]
            else:
                triangles = _only_triangles(path, table[:, 0], table[:, 1:4]).astype(int)
            continue
        table = np.frombuffer(data, np.dtype(fields), count, at)
        at += table.nbytes
        if name == "vertex":
            vertices = np.stack([table[axis] for axis in "xyz"], 1).astype(float)
        elif count:
            lists = table[next(field for field, kind in properties if not isinstance(kind, str))]
            triangles = _only_triangles(path, lists["n"], lists["v"]).astype(int)
    return vertices, triangles


def write(path, vertices, triangles=None):
    """Binary, float32; without triangles: points alone."""
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n" + \
        "".join(f"property float {axis}\n" for axis in "xyz")
    if triangles is not None:
        header += f"element face {len(triangles)}\nproperty list uchar int vertex_indices\n"
    with open(path, "wb") as file:
        file.write((header + "end_header\n").encode())
        file.write(np.ascontiguousarray(vertices, "<f4").tobytes())
        if triangles is not None:
            faces = np.empty(len(triangles), [("n", "u1"), ("v", "<i4", 3)])
            faces["n"], faces["v"] = 3, triangles
            file.write(faces.tobytes())


def _header(file):
    """(layout, [(element, count, [(property, type or (type of the count, type))])])"""
    layout, elements = None, []
    for line in iter(file.readline, b""):
        words = line.decode("ascii", "replace").split()
        if words[:1] == ["format"]:
            layout = words[1]
        elif words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            elements[-1][2].append((words[-1], tuple(words[2:4]) if words[1] == "list" else words[1]))
        elif words[:1] == ["end_header"]:
            break
    if layout not in ("ascii", "binary_little_endian"):
        raise ValueError(f"{file.name}: expected PLY, ASCII or binary little-endian, got {layout}")
    return layout, elements


def _only_triangles(path, counts, corners):
    if not np.all(counts == 3):
        raise ValueError(f"{path}: expected triangles, got a face of {int(counts[counts != 3][0])} corners")
    return corners
