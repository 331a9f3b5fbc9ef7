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
    if application != 0x424b494d or version not in (1, 2, 3, 4, 5):
        raise ValueError(f'{file} is not a map file of version 1 to 5')
    exponent, = database.execute('SELECT unit_exponent FROM map').fetchone()
    for z, y, x, blocks, planes, content in database.execute(
            'SELECT z, y, x, blocks, planes, content FROM tile WHERE part = ? ORDER BY z, y, x', (part,)):
        lengths, position = numpy.frombuffer(content, '<u4', 6), 24

        def section(number, size):
            nonlocal position
            data = content[position:position + lengths[number]]
            position += lengths[number]
            return numpy.frombuffer(data if len(data) == size else zlib.decompress(data), numpy.uint8)
        listed = section(0, int(lengths[0]))  # in versions 3 and 4, it ends with the levels of the looks
        numbers = listed[:2 * blocks].view('<u2').astype(int)  # signed: the index of a tile may be negative
        counts, marked = listed[2 * blocks:3 * blocks], listed[3 * blocks:4 * blocks] & 1
        masks = numpy.unpackbits(section(1, 64 * (int(marked.sum()) + planes)), bitorder='little').reshape(-1, 512)
        masks = masks[int(marked.sum()):].astype(bool)
        size = int(masks.sum())
        units = numpy.zeros(masks.shape, '<i4')
        units[masks] = numpy.stack([section(byte, size) for byte in range(2, 6)], axis=1).copy().view('<i4').ravel()
        for block, label, plane in zip(numpy.repeat(numbers, counts), listed[4 * blocks:], units):
            index = 8 * x + block % 8, 8 * y + block // 8 % 8, 8 * z + block // 64
            yield tuple(map(int, index)), int(label), plane.reshape(8, 8, 8) / 2.0 ** exponent


if __name__ == '__main__':
    for block, label, evidence in read_planes(sys.argv[1]):
        print(*block, label, evidence.sum())
