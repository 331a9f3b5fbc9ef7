#!/usr/bin/env python3
"""Reads a map file (.bkm) with only SQLite and NumPy: an example of a reader, and a test of docs/map_file.md."""
import pathlib
import sqlite3
import sys
import zlib

import numpy


def read_planes(file, part=0):
    """Yields for each plane the index of its block, the id of its class (255: free), and its evidence, without the prior,
    as an array [z, y, x]."""
    database = sqlite3.connect(pathlib.Path(file).absolute().as_uri() + '?mode=ro', uri=True)
    (application,), (version,) = (database.execute(f'PRAGMA {name}').fetchone() for name in ('application_id', 'user_version'))
    if application != 0x424b494d or version not in (1, 2, 3, 4, 5, 6):
        raise ValueError(f'{file} is not a map file of version 1 to 6')
    exponent, = database.execute('SELECT unit_exponent FROM map').fetchone()
    for z, y, x, blocks, planes, content in database.execute(
            'SELECT z, y, x, blocks, planes, content FROM tile WHERE part = ? ORDER BY z, y, x', (part,)):
        lengths, position = list(numpy.frombuffer(content, '<u4', 6)), 24
        steps, sections = (0,) * 4, [[8, 9, 10, 11], []]  # before version 6, all evidence is what is left, of one kind of planes
        if version >= 6:
            head = numpy.frombuffer(content, '<u4', 7)
            steps, present = head[2:6], [n for n in range(24) if head[6] >> n & 1]
            sections = [n for n in present if n < 12], [n - 12 for n in present if n >= 12]
            lengths, position = [*head[:2], *numpy.frombuffer(content, '<u4', len(present), 28)], 28 + 4 * len(present)

        def section(size=None):
            nonlocal position
            begin, position = position, position + int(lengths.pop(0))
            data = content[begin:position]
            return numpy.frombuffer(data if len(data) == (size or len(data)) else zlib.decompress(data), numpy.uint8)

        listed = section()  # in versions 3 and 4, it ends with the levels of the looks
        numbers = listed[:2 * blocks].view('<u2').astype(int)  # signed: the index of a tile may be negative
        counts, marked = listed[2 * blocks:3 * blocks], listed[3 * blocks:4 * blocks] & 1
        labels = listed[4 * blocks:4 * blocks + planes]
        masks = numpy.unpackbits(section(64 * (int(marked.sum()) + planes)), bitorder='little').reshape(-1, 512)
        masks = masks[int(marked.sum()):].astype(bool)
        units = numpy.zeros(masks.shape, '<u4')
        for kind, of_kind in enumerate(((labels == 255) | (version < 6), (labels != 255) & (version >= 6))):
            voxels = masks & of_kind[:, None]
            for n in sections[kind]:
                data, step = section(int(voxels.sum())), 1
                if n < 8:  # differences of a multiple of a step
                    data, step = numpy.cumsum(data, dtype='u1'), int(steps[2 * kind + n // 4])
                units[voxels] += numpy.uint32((step << 8 * (n % 4)) % 2 ** 32) * data.astype('<u4')
        units = units.view('<i4')
        for block, label, plane in zip(numpy.repeat(numbers, counts), labels, units):
            index = 8 * x + block % 8, 8 * y + block // 8 % 8, 8 * z + block // 64
            yield tuple(map(int, index)), int(label), plane.reshape(8, 8, 8) / 2.0 ** exponent


if __name__ == '__main__':
    for block, label, evidence in read_planes(sys.argv[1]):
        print(*block, label, evidence.sum())
