"""What queries must answer, worked out voxel by voxel from the topic `occupancy`: slow, obvious, and independent of the
mapper's code."""
import itertools
import math

from bki_mapping.msg import OccupancyMap

UNKNOWN, FREE, OCCUPIED, OCCLUDED = (getattr(OccupancyMap, name) for name in ('UNKNOWN', 'FREE', 'OCCUPIED', 'OCCLUDED'))


class MapReference:
    """A map, as {(i, j, k): value} of the voxels of its blocks."""

    def __init__(self, message):
        self.resolution = message.resolution
        self.names = {c.id: c.name for c in message.classes}
        self.state, self.label, self.posterior = {}, {}, {}
        for block in message.blocks:
            states, labels = bytes(block.state), bytes(block.label)
            for v in range(512):
                voxel = (8 * block.x + v % 8, 8 * block.y + v // 8 % 8, 8 * block.z + v // 64)
                self.state[voxel], self.label[voxel] = states[v], labels[v]
                self.posterior[voxel] = (block.occupancy[v], block.class_probability[v], block.probability[v])

    def voxel_at(self, point):
        return tuple(math.floor(c / self.resolution) for c in point)

    def centre(self, voxel):
        return tuple((i + 0.5) * self.resolution for i in voxel)

    def state_of(self, voxel):
        return self.state.get(voxel, UNKNOWN)

    def is_known(self, voxel):
        return self.state_of(voxel) in (FREE, OCCUPIED)

    def class_of(self, voxel):
        """The name of an occupied voxel's class; '' for any other voxel."""
        return self.names[self.label[voxel]] if self.state_of(voxel) == OCCUPIED else ''

    def occupied(self, classes):
        return [voxel for voxel in self.state if self.class_of(voxel) in classes]

    def along(self, origin, direction, length):
        """The voxels of a ray, and where it enters them: between two crossings of faces, it is in one voxel."""
        norm = math.sqrt(sum(d * d for d in direction))
        unit = [d / norm for d in direction]
        crossings = {0.0, length}
        for o, d in zip(origin, unit):
            if d == 0.0:
                continue
            first, last = sorted((o / self.resolution, (o + length * d) / self.resolution))
            for face in range(math.ceil(first), math.floor(last) + 1):
                crossings.add(min(max((face * self.resolution - o) / d, 0.0), length))
        for begin, end in zip(sorted(crossings), sorted(crossings)[1:]):
            middle = 0.5 * (begin + end)
            yield self.voxel_at([o + middle * d for o, d in zip(origin, unit)]), begin

    def cast(self, origin, direction, length, classes, stop_at_unknown):
        """(what the ray meets, class, length, first unknown, voxel)"""
        first_unknown = math.inf
        for voxel, entered in self.along(origin, direction, length):
            if not self.is_known(voxel):
                first_unknown = min(first_unknown, entered)
                if stop_at_unknown:
                    return 2, '', entered, first_unknown, voxel
            elif self.class_of(voxel) in classes:
                return 1, self.class_of(voxel), entered, first_unknown, voxel
        return 0, '', length, first_unknown, None

    def content(self, voxels):
        """(number of free, of occupied, of unknown voxels, names of classes)"""
        states = [self.state_of(voxel) for voxel in voxels]
        free, occupied = states.count(FREE), states.count(OCCUPIED)
        return free, occupied, len(states) - free - occupied, {self.class_of(voxel) for voxel in voxels} - {''}

    def around(self, centre, reach):
        ranges = [range(math.floor((c - reach) / self.resolution), math.floor((c + reach) / self.resolution) + 1)
                  for c in centre]
        return itertools.product(*ranges)

    def in_sphere(self, centre, radius):
        def distance(voxel):
            beyond = [max(0.0, i * self.resolution - c, c - (i + 1) * self.resolution) for i, c in zip(voxel, centre)]
            return math.sqrt(sum(b * b for b in beyond))
        return [voxel for voxel in self.around(centre, radius) if distance(voxel) < radius]

    def in_turned_box(self, centre, yaw, size):
        """The voxels that overlap a box that is turned about z: whose square, cut to the box, has an area."""
        c, s, half = math.cos(yaw), math.sin(yaw), [0.5 * edge for edge in size]
        found = []
        for voxel in self.around(centre, math.sqrt(sum(h * h for h in half))):
            low, high = voxel[2] * self.resolution, (voxel[2] + 1) * self.resolution
            if low >= centre[2] + half[2] or high <= centre[2] - half[2]:
                continue
            corners = [((voxel[0] + i) * self.resolution - centre[0], (voxel[1] + j) * self.resolution - centre[1])
                       for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]
            polygon = [(c * x + s * y, c * y - s * x) for x, y in corners]  # in the box's frame
            for axis, sign in ((0, 1), (0, -1), (1, 1), (1, -1)):
                polygon = cut(polygon, axis, sign, half[axis])
            if area(polygon) > 1e-9:
                found.append(voxel)
        return found

    def nearest(self, point, voxels):
        """Distances to the centres of voxels, with the voxels, the nearest first."""
        return sorted((math.dist(point, self.centre(voxel)), voxel) for voxel in voxels)

    def frontiers(self, counts=lambda voxel: True):
        """Sets of voxels, the largest first. `counts`: whether a voxel counts."""
        sides = [tuple(sign * (axis == a) for a in range(3)) for axis in range(3) for sign in (1, -1)]
        left = {voxel for voxel, state in self.state.items() if state == FREE and counts(voxel) and
                any(not self.is_known(tuple(a + b for a, b in zip(voxel, side))) for side in sides)}
        clusters = []
        while left:
            cluster, new = set(), [left.pop()]
            while new:
                voxel = new.pop()
                cluster.add(voxel)
                for step in itertools.product((-1, 0, 1), repeat=3):
                    beside = tuple(a + b for a, b in zip(voxel, step))
                    if beside in left:
                        left.remove(beside)
                        new.append(beside)
            clusters.append(cluster)
        return sorted(clusters, key=len, reverse=True)


def cut(polygon, axis, sign, limit):
    """The part of a convex polygon where sign * coordinate <= limit."""
    kept = []
    for a, b in zip(polygon, polygon[1:] + polygon[:1]):
        inside_a, inside_b = sign * a[axis] <= limit, sign * b[axis] <= limit
        if inside_a:
            kept.append(a)
        if inside_a != inside_b:
            share = (sign * limit - a[axis]) / (b[axis] - a[axis])
            kept.append(tuple(p + share * (q - p) for p, q in zip(a, b)))
    return kept


def area(polygon):
    return 0.5 * abs(sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(polygon, polygon[1:] + polygon[:1])))
