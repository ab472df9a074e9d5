#!/usr/bin/env python3
"""Converts a mesh (OBJ, PLY or OFF; plain, .gz or .zst) to a plain triangulated OBJ.

    convert.py SOURCE TARGET.obj.gz

Only `v` and `f` lines are written: coordinates as the shortest decimals that read back as the same
32-bit float, faces fanned from their first vertex, nothing merged or reordered. The target appears
only when it is whole. Prints the SHA-256 of the OBJ text and the number of triangles.
"""
import gzip
import hashlib
import os
import shutil
import struct
import subprocess
import sys
from decimal import Decimal

FLOAT = struct.Struct("<f")
PLY_TYPES = {"char": "b", "int8": "b", "uchar": "B", "uint8": "B", "short": "h", "int16": "h",
             "ushort": "H", "uint16": "H", "int": "i", "int32": "i", "uint": "I", "uint32": "I",
             "float": "f", "float32": "f", "double": "d", "float64": "d"}


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    source, target = sys.argv[1:]
    text, triangles = obj_text(*read(source))
    partial = target + ".partial"
    # No name and no time in the header: the same mesh gives the same bytes.
    with open(partial, "wb") as raw, gzip.GzipFile("", "wb", 9, raw, 0) as packed:
        packed.write(text)
    os.replace(partial, target)
    print(hashlib.sha256(text).hexdigest(), triangles)


def read(source):
    """Vertices (triples of floats) and faces (lists of indices from 0) of a mesh file."""
    name = source
    with open(source, "rb") as file:
        data = file.read()
    if name.endswith(".gz"):
        name, data = name[:-3], gzip.decompress(data)
    elif name.endswith(".zst"):
        if not shutil.which("zstd"):
            sys.exit(f"{source}: needs the command zstd; install the package zstd")
        name = name[:-4]
        data = subprocess.run(["zstd", "-dcq", source], check=True, stdout=subprocess.PIPE).stdout
    kind = name.rsplit(".", 1)[-1].lower()
    readers = {"obj": read_obj, "ply": read_ply, "off": read_off}
    if kind not in readers:
        sys.exit(f"{source}: unknown kind of mesh '.{kind}'; use OBJ, PLY or OFF")
    return readers[kind](data)


def read_obj(data):
    vertices, faces = [], []
    for line in data.decode("utf-8", "replace").splitlines():
        words = line.split("#")[0].split()
        if words[:1] == ["v"]:
            vertices.append(tuple(map(float, words[1:4])))
        elif words[:1] == ["f"]:
            corners = [int(word.split("/")[0]) for word in words[1:]]
            faces.append([c - 1 if c > 0 else len(vertices) + c for c in corners])
    return vertices, faces


def read_off(data):
    words = b"\n".join(line.split(b"#")[0] for line in data.splitlines()).split()
    vertex_count, face_count = int(words[1]), int(words[2])
    numbers = list(map(float, words[4:4 + 3 * vertex_count]))
    vertices = list(zip(numbers[0::3], numbers[1::3], numbers[2::3]))
    faces, at = [], 4 + 3 * vertex_count
    for _ in range(face_count):
        corners = int(words[at])
        faces.append(list(map(int, words[at + 1:at + 1 + corners])))
        at += 1 + corners
    return vertices, faces


def read_ply(data):
    header, body = data.split(b"end_header", 1)
    body = body[body.index(b"\n") + 1:]
    elements, form = [], None
    for words in (line.split() for line in header.decode("ascii", "replace").splitlines()):
        if words[:1] == ["format"]:
            form = words[1]
        elif words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            elements[-1][2].append(words[1:])
    if form == "ascii":
        take = ascii_values(body)
    elif form in ("binary_little_endian", "binary_big_endian"):
        take = binary_values(body, "<" if "little" in form else ">")
    else:
        sys.exit(f"unknown PLY format '{form}'")
    vertices, faces = [], []
    for name, count, properties in elements:
        for _ in range(count):
            row = {}
            for prop in properties:
                if prop[0] == "list":
                    row[prop[3]] = [take(prop[2]) for _ in range(int(take(prop[1])))]
                else:
                    row[prop[1]] = take(prop[0])
            if name == "vertex":
                vertices.append((row["x"], row["y"], row["z"]))
            elif name == "face":
                corners = row["vertex_indices"] if "vertex_indices" in row else row["vertex_index"]
                faces.append(list(map(int, corners)))
    return vertices, faces


def ascii_values(body):
    words = iter(body.split())
    return lambda kind: float(next(words)) if PLY_TYPES[kind] in "fd" else int(next(words))


def binary_values(body, order):
    codes = {kind: struct.Struct(order + code) for kind, code in PLY_TYPES.items()}
    at = 0

    def take(kind):
        nonlocal at
        code = codes[kind]
        at += code.size
        return code.unpack_from(body, at - code.size)[0]
    return take


def obj_text(vertices, faces):
    lines = [f"v {decimal(x)} {decimal(y)} {decimal(z)}" for x, y, z in vertices]
    triangles = 0
    for face in faces:
        for second, third in zip(face[1:], face[2:]):
            lines.append(f"f {face[0] + 1} {second + 1} {third + 1}")
            triangles += 1
    lines.append("")
    return "\n".join(lines).encode("ascii"), triangles


def decimal(value):
    """The shortest decimal that reads back as the 32-bit float nearest to value."""
    exact, = FLOAT.unpack(FLOAT.pack(value))
    for digits in range(6, 10):
        text = f"{exact:.{digits}g}"
        if FLOAT.unpack(FLOAT.pack(float(text)))[0] == exact:
            break
    # An exponent only below 1e-5, as most programs write it.
    return format(Decimal(text), "f") if text.endswith("e-05") else text


if __name__ == "__main__":
    main()
