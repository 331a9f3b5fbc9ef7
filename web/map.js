// The map of this page: voxels as html_export.cpp has written them, and the evidence of the tile that is asked.
'use strict';

const kUnknown = 0, kFree = 1, kOccupied = 2, kOccluded = 3;  // states
const kFreeLabel = 255, kOccludedLabel = 254;                 // where a label is a colour; classes have 0 to 253
const kTileEdge = 64, kBlockVoxels = 512;                     // [voxels]
const kPlanes = ['state', 'label', 'occupancy', 'class_probability', 'drive'];

function bytesOfBase64(text) {
  const characters = atob(text), bytes = new Uint8Array(characters.length);
  for (let i = 0; i < bytes.length; ++i) bytes[i] = characters.charCodeAt(i);
  return bytes;
}

/// A cube of 64 x 64 x 64 voxels: up to 512 blocks of 512 voxels, x fastest.
class Tile {
  /// @param listed the tile's entry in the header. @param views the voxels, see decodeMap().
  constructor(listed, views, planes, evidence_element) {
    this.index = listed.index;
    this.blocks = listed.blocks;
    this.listed = listed;
    this.evidence_element = evidence_element;
    this.number = new Uint16Array(this.blocks);
    this.position = new Int16Array(512).fill(-1);  // of each block of the tile; -1: it has none
    for (let b = 0; b < this.blocks; ++b) {
      this.number[b] = views[2 * b] | views[2 * b + 1] << 8;
      this.position[this.number[b]] = b;
    }
    const size = kBlockVoxels * this.blocks;
    for (let p = 0; p < planes; ++p) this[kPlanes[p]] = views.subarray(2 * this.blocks + p * size, 2 * this.blocks + (p + 1) * size);
  }
  /// Where the planes have a voxel, given in the tile; -1: the block is missing.
  offset(x, y, z) {
    const block = this.position[(x >> 3) + 8 * (y >> 3) + 64 * (z >> 3)];
    return block < 0 ? -1 : kBlockVoxels * block + (x & 7) + 8 * (y & 7) + 64 * (z & 7);
  }
}

/// All tiles and what the header says.
class VoxelMap {
  constructor(header) {
    this.header = header;
    this.tiles = [];
    this.by_index = new Map();
    this.classes = new Map(header.classes.map((c) => [c.id, c]));
  }
  add(tile) {
    this.tiles.push(tile);
    this.by_index.set(tile.index.join(), tile);
  }
  tileOf(x, y, z) {
    return this.by_index.get(`${x >> 6},${y >> 6},${z >> 6}`);
  }
  /// @return {tile, offset}, or undefined where the map has no block.
  find(x, y, z) {
    const tile = this.tileOf(x, y, z);
    const offset = tile ? tile.offset(x & 63, y & 63, z & 63) : -1;
    return offset < 0 ? undefined : {tile, offset};
  }
}

/// Reads the header and all tiles of the page. @param progress called with the fraction that is done.
async function decodeMap(progress) {
  const header = JSON.parse(document.getElementById('map').textContent);
  const map = new VoxelMap(header), voxels = document.querySelectorAll('script.voxels'),
        evidence = document.querySelectorAll('script.evidence');
  for (let t = 0; t < header.tiles.length; ++t) {
    const listed = header.tiles[t], size = listed.blocks * (2 + header.planes * kBlockVoxels);
    map.add(new Tile(listed, await inflate(bytesOfBase64(voxels[t].textContent), size), header.planes, evidence[t]));
    voxels[t].remove();
    await progress((t + 1) / header.tiles.length);
  }
  return map;
}

function bitsSet(byte) {
  byte -= byte >> 1 & 0x55;
  byte = (byte & 0x33) + (byte >> 2 & 0x33);
  return byte + (byte >> 4) & 0x0f;
}

/// The evidence of a tile, packed as in map files: docs/map_file.md has the format.
class TileEvidence {
  static async read(tile) {
    const bytes = bytesOfBase64(tile.evidence_element.textContent);
    const lengths = new Uint32Array(bytes.slice(0, 24).buffer);
    let begin = 24;
    const section = async (s, size) => {
      const stored = bytes.subarray(begin, begin += lengths[s]);
      return stored.length < size ? inflate(stored, size) : stored;
    };
    const {evidence_blocks: blocks, evidence_planes: planes} = tile.listed;
    const evidence = new TileEvidence();
    const list = await section(0, 4 * blocks + planes);
    const counts = list.subarray(2 * blocks, 3 * blocks), marked = list.subarray(3 * blocks, 4 * blocks);
    const marks = marked.reduce((sum, mark) => sum + mark, 0);
    evidence.classes = list.subarray(4 * blocks);
    evidence.first_plane = new Map();  // by number of the block: [its first plane, and the one after its last]
    for (let b = 0, plane = 0; b < blocks; plane += counts[b++]) {
      evidence.first_plane.set(list[2 * b] | list[2 * b + 1] << 8, [plane, plane + counts[b]]);
    }
    evidence.masks = (await section(1, 64 * (marks + planes))).subarray(64 * marks);
    evidence.begin = new Uint32Array(planes + 1);  // the first value of each plane
    for (let p = 0; p < planes; ++p) {
      let count = 0;
      for (let i = 64 * p; i < 64 * p + 64; ++i) count += bitsSet(evidence.masks[i]);
      evidence.begin[p + 1] = evidence.begin[p] + count;
    }
    evidence.bytes = [];
    for (let s = 2; s < 6; ++s) evidence.bytes.push(await section(s, evidence.begin[planes]));
    return evidence;
  }
  /// The units of evidence that a voxel has, by class id; 255: free.
  /// @param number of the block in its tile. @param voxel in its block.
  unitsOf(number, voxel) {
    const units = new Map(), [first, last] = this.first_plane.get(number) || [0, 0];
    for (let p = first; p < last; ++p) {
      const mask = this.masks.subarray(64 * p, 64 * p + 64), byte = voxel >> 3, bit = voxel & 7;
      if ((mask[byte] >> bit & 1) === 0) continue;
      let value = this.begin[p] + bitsSet(mask[byte] & ((1 << bit) - 1));
      for (let i = 0; i < byte; ++i) value += bitsSet(mask[i]);
      const [a, b, c, d] = this.bytes;
      units.set(this.classes[p], Math.max(0, a[value] | b[value] << 8 | c[value] << 16 | d[value] << 24));
    }
    return units;
  }
}

/// What the map says of a voxel. Probabilities are those of docs/method.md, Equation 10.
/// @return undefined where it says nothing.
async function describeVoxel(map, x, y, z) {
  const found = map.find(x, y, z);
  if (!found || found.tile.state[found.offset] === kUnknown) return undefined;
  const {tile, offset} = found, header = map.header;
  if (map.evidence_tile !== tile) {
    map.evidence = await TileEvidence.read(tile);
    map.evidence_tile = tile;
  }
  const units = map.evidence.unitsOf(tile.number[offset >> 9], offset & 511);
  const unit = 2 ** -header.unit_exponent;
  let evidence = 0;
  for (const value of units.values()) evidence += unit * value;
  const sum = evidence + header.prior * (header.classes.length + 1);
  const probabilities = [...header.classes.map((c) => c.id), kFreeLabel].map((id) => ({id, p: (header.prior + unit * (units.get(id) || 0)) / sum}));
  const state = tile.state[offset], label = state === kOccupied ? tile.label[offset] : kFreeLabel;
  const p = probabilities.find((entry) => entry.id === label).p;
  return {
    index: [x, y, z], centre: [x, y, z].map((i) => (i + 0.5) * header.resolution), state, label, evidence, p,
    variance: p * (1 - p) / (sum + 1), occupancy: tile.occupancy[offset] / 255,
    class_probability: tile.class_probability[offset] / 255, drive: tile.drive ? tile.drive[offset] : 0,
    probabilities: probabilities.sort((a, b) => b.p - a.p),
  };
}
