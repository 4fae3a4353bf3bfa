"""Small meshes for the project's scenes, in pure Python: surfaces of revolution, tubes, rounded boxes, PLY and OBJ files.

A mesh is a `Mesh`: positions, unit normals and texture coordinates per vertex, and triangles. Units are metres, z is up.
"""

import math
import struct


class Mesh:
    """Vertices (position, normal, uv) and triangles that index them, counter-clockwise from outside."""

    def __init__(self):
        self.positions, self.normals, self.uvs, self.triangles = [], [], [], []

    def add_vertex(self, position, normal, uv=(0.0, 0.0)):
        self.positions.append(tuple(position))
        self.normals.append(normalize(normal))
        self.uvs.append(tuple(uv))
        return len(self.positions) - 1

    def add_quad(self, a, b, c, d):
        self.triangles += [(a, b, c), (a, c, d)]

    def merged(self, *others):
        """This mesh and others as one."""
        result = Mesh()
        for mesh in (self, *others):
            offset = len(result.positions)
            result.positions += mesh.positions
            result.normals += mesh.normals
            result.uvs += mesh.uvs
            result.triangles += [tuple(i + offset for i in t) for t in mesh.triangles]
        return result

    def moved(self, x=0.0, y=0.0, z=0.0):
        result = Mesh()
        result.positions = [(p[0] + x, p[1] + y, p[2] + z) for p in self.positions]
        result.normals, result.uvs, result.triangles = self.normals, self.uvs, self.triangles
        return result

    def rotated(self, axis, degrees):
        """Turned about the x, y or z axis (0, 1, 2)."""
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        i, j = (axis + 1) % 3, (axis + 2) % 3

        def turn(v):
            w = list(v)
            w[i], w[j] = c * v[i] - s * v[j], s * v[i] + c * v[j]
            return tuple(w)

        result = Mesh()
        result.positions = [turn(p) for p in self.positions]
        result.normals = [turn(n) for n in self.normals]
        result.uvs, result.triangles = self.uvs, self.triangles
        return result


def normalize(v):
    length = math.sqrt(sum(c * c for c in v))
    return tuple(c / length for c in v) if length > 0 else (0.0, 0.0, 1.0)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def spline(points, steps):
    """Centripetal Catmull-Rom curve through `points` (tuples of any length), `steps` segments between two of them."""

    def at(p0, p1, p2, p3, t):
        def knot(a, b):
            return max(math.dist(a, b), 1e-9) ** 0.5

        t0, t1 = 0.0, knot(p0, p1)
        t2 = t1 + knot(p1, p2)
        t3 = t2 + knot(p2, p3)
        t = t1 + t * (t2 - t1)

        def mix(a, b, ta, tb):
            return tuple((x * (tb - t) + y * (t - ta)) / (tb - ta) for x, y in zip(a, b))

        a1, a2, a3 = mix(p0, p1, t0, t1), mix(p1, p2, t1, t2), mix(p2, p3, t2, t3)
        return mix(mix(a1, a2, t0, t2), mix(a2, a3, t1, t3), t1, t2)

    def reflect(a, b):
        return tuple(2 * x - y for x, y in zip(a, b))

    padded = [reflect(points[0], points[1]), *points, reflect(points[-1], points[-2])]
    curve = [at(*padded[i : i + 4], k / steps) for i in range(len(points) - 1) for k in range(steps)]
    return curve + [tuple(points[-1])]


def revolve(profiles, segments=40):
    """Surface of revolution around z. `profiles`: smooth polylines of (radius, height); normals break between two of them.

    Walking along a profile, the outside is on the right: upwards is an outer wall, downwards an inner one.
    """
    mesh = Mesh()
    for profile in profiles:
        rings = []
        for i, (r, z) in enumerate(profile):
            before, after = profile[max(i - 1, 0)], profile[min(i + 1, len(profile) - 1)]
            dr, dz = after[0] - before[0], after[1] - before[1]
            if r < 1e-9:  # on the axis, where the slope towards the neighbour counts as flat
                dr, dz = (1.0, 0.0) if i == 0 else (-1.0, 0.0)
            ring = []
            for k in range(segments + 1):
                phi = 2 * math.pi * k / segments
                c, s = math.cos(phi), math.sin(phi)
                uv = (k / segments, i / (len(profile) - 1))
                ring.append(mesh.add_vertex((r * c, r * s, z), (dz * c, dz * s, -dr), uv))
            rings.append((r, ring))
        for (r0, a), (r1, b) in zip(rings, rings[1:]):
            for k in range(segments):
                if r0 >= 1e-9:
                    mesh.triangles.append((a[k], a[k + 1], b[k + 1]))
                if r1 >= 1e-9:
                    mesh.triangles.append((a[k], b[k + 1], b[k]))
    return mesh


def tube(path, radii, segments=12, flatten=1.0):
    """Tube along `path` (points); `radii` per point; `flatten` scales it sideways. Capped with flat ends."""
    mesh = Mesh()
    rings = []
    side = None
    for i, p in enumerate(path):
        a, b = path[max(i - 1, 0)], path[min(i + 1, len(path) - 1)]
        t = normalize([y - x for x, y in zip(a, b)])
        if side is None:
            side = normalize(cross(t, (0.0, 1.0, 0.0) if abs(t[1]) < 0.9 else (1.0, 0.0, 0.0)))
        side = normalize([s - t[k] * sum(u * v for u, v in zip(side, t)) for k, s in enumerate(side)])
        up = cross(t, side)
        ring = []
        for k in range(segments + 1):
            phi = 2 * math.pi * k / segments
            c, s = math.cos(phi), math.sin(phi)
            offset = [radii[i] * (c * side[m] + flatten * s * up[m]) for m in range(3)]
            normal = [flatten * c * side[m] + s * up[m] for m in range(3)]
            ring.append(mesh.add_vertex([p[m] + offset[m] for m in range(3)], normal, (k / segments, i / (len(path) - 1))))
        rings.append((ring, t))
    for (a, _), (b, _) in zip(rings, rings[1:]):
        for k in range(segments):
            mesh.add_quad(a[k], a[k + 1], b[k + 1], b[k])
    for (ring, t), sign in ((rings[0], -1), (rings[-1], 1)):
        cap = [mesh.add_vertex(mesh.positions[v], [sign * c for c in t]) for v in ring[:-1]]
        for k in range(1, len(cap) - 1):
            mesh.triangles.append((cap[0], cap[k], cap[k + 1]) if sign > 0 else (cap[0], cap[k + 1], cap[k]))
    return mesh


def rounded_box(size, bevel, texture_scale=1.0):
    """Box around the origin with edges that catch the light: flat faces, normals that turn across the bevels.

    Texture coordinates are the position in metres times `texture_scale`, on each face in its own plane.
    """
    mesh = Mesh()
    half = [s / 2 for s in size]
    corner = {}
    for signs in [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]:
        for axis in range(3):
            p = [s * (h - (0 if a == axis else bevel)) for a, (s, h) in enumerate(zip(signs, half))]
            n = [s if a == axis else 0 for a, s in enumerate(signs)]
            u, v = [p[a] for a in range(3) if a != axis]
            corner[signs, axis] = mesh.add_vertex(p, n, (u * texture_scale, v * texture_scale))

    def add(*indices):  # a convex polygon, turned so that it faces outwards
        a, b, c = (mesh.positions[i] for i in indices[:3])
        n = cross([y - x for x, y in zip(a, b)], [y - x for x, y in zip(a, c)])
        if sum(x * y for x, y in zip(n, a)) < 0:
            indices = indices[::-1]
        for k in range(1, len(indices) - 1):
            mesh.triangles.append((indices[0], indices[k], indices[k + 1]))

    def signs_of(fixed):
        free = [a for a in range(3) if a not in fixed]
        if not free:
            yield tuple(fixed[a] for a in range(3))
            return
        for s in (-1, 1):
            yield from signs_of({**fixed, free[0]: s})

    for axis in range(3):
        for s in (-1, 1):
            q = list(signs_of({axis: s}))
            add(corner[q[0], axis], corner[q[1], axis], corner[q[3], axis], corner[q[2], axis])
    for a, b in ((0, 1), (1, 2), (0, 2)):
        for sa in (-1, 1):
            for sb in (-1, 1):
                p, q = signs_of({a: sa, b: sb})
                add(corner[p, a], corner[q, a], corner[q, b], corner[p, b])
    for signs in signs_of({}):
        add(*(corner[signs, axis] for axis in range(3)))
    return mesh


def height_sheet(width, height, depth, columns, rows):
    """Sheet in the xz plane, facing -y, that `depth(u, v)` pushes towards +y; u along x and v along z in [0, 1]."""
    mesh = Mesh()
    grid = []
    for j in range(rows + 1):
        row = []
        for i in range(columns + 1):
            u, v, e = i / columns, j / rows, 1e-3
            du = (depth(u + e, v) - depth(u - e, v)) / (2 * e * width)
            dv = (depth(u, v + e) - depth(u, v - e)) / (2 * e * height)
            row.append(mesh.add_vertex(((u - 0.5) * width, depth(u, v), v * height), (du, -1.0, dv), (u, v)))
        grid.append(row)
    for a, b in zip(grid, grid[1:]):
        for i in range(columns):
            mesh.add_quad(a[i], a[i + 1], b[i + 1], b[i])
    return mesh


def write_ply(path, mesh, normals=True, uvs=False, ascii=False):
    """PLY of `mesh`: little-endian binary, or text."""
    names = ["x", "y", "z"] + (["nx", "ny", "nz"] if normals else []) + (["u", "v"] if uvs else [])
    header = ["ply", f"format {'ascii' if ascii else 'binary_little_endian'} 1.0", f"element vertex {len(mesh.positions)}"]
    header += [f"property float {n}" for n in names]
    header += [f"element face {len(mesh.triangles)}", "property list uchar int vertex_indices", "end_header"]
    rows = [
        [*p, *(n if normals else ()), *(t if uvs else ())] for p, n, t in zip(mesh.positions, mesh.normals, mesh.uvs)
    ]
    with open(path, "wb") as out:
        out.write(("\n".join(header) + "\n").encode())
        if ascii:
            out.write("".join(" ".join(f"{c:.6g}" for c in row) + "\n" for row in rows).encode())
            out.write("".join(f"3 {a} {b} {c}\n" for a, b, c in mesh.triangles).encode())
        else:
            out.write(b"".join(struct.pack(f"<{len(row)}f", *row) for row in rows))
            out.write(b"".join(struct.pack("<B3i", 3, *t) for t in mesh.triangles))


def write_obj(path, mesh, normals=True, uvs=True):
    """Wavefront OBJ of `mesh`."""
    with open(path, "w", encoding="ascii") as out:
        out.writelines("v {:.6g} {:.6g} {:.6g}\n".format(*p) for p in mesh.positions)
        if uvs:
            out.writelines("vt {:.6g} {:.6g}\n".format(*t) for t in mesh.uvs)
        if normals:
            out.writelines("vn {:.5g} {:.5g} {:.5g}\n".format(*n) for n in mesh.normals)
        for t in mesh.triangles:
            out.write("f " + " ".join(f"{i + 1}/{i + 1 if uvs else ''}/{i + 1}" if normals else
                                      (f"{i + 1}/{i + 1}" if uvs else f"{i + 1}") for i in t) + "\n")
