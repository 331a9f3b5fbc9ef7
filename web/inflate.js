// Decompresses zlib streams (RFC 1950 and 1951): with the browser's DecompressionStream, or, in browsers that lack it, here.
'use strict';

/// Reads bits, the lowest of each byte first.
class BitReader {
  constructor(bytes) {
    this.bytes = bytes;
    this.position = 0;
    this.held = 0;
    this.count = 0;
  }
  /// The next `n` bits as a number, the first bit lowest; n <= 16.
  take(n) {
    while (this.count < n) {
      if (this.position >= this.bytes.length) throw new Error('the compressed data ends too early');
      this.held |= this.bytes[this.position++] << this.count;
      this.count += 8;
    }
    const value = this.held & ((1 << n) - 1);
    this.held >>>= n;
    this.count -= n;
    return value;
  }
  skipToByte() {
    this.held = this.count = 0;
  }
}

/// A Huffman code, given by the length of the code of each symbol.
class HuffmanCode {
  constructor(lengths) {
    this.codes = new Uint16Array(16);  // number of codes of each length
    for (const length of lengths) ++this.codes[length];
    this.codes[0] = 0;
    const next = new Uint16Array(16);  // where the symbols of each length begin
    for (let length = 1; length < 15; ++length) next[length + 1] = next[length] + this.codes[length];
    this.symbols = new Uint16Array(lengths.length);
    lengths.forEach((length, symbol) => {
      if (length > 0) this.symbols[next[length]++] = symbol;
    });
  }
  /// The symbol of the next code.
  read(bits) {
    let code = 0, first = 0, begin = 0;
    for (let length = 1; length < 16; ++length) {
      code |= bits.take(1);
      const count = this.codes[length];
      if (code - first < count) return this.symbols[begin + code - first];
      begin += count;
      first = (first + count) << 1;
      code <<= 1;
    }
    throw new Error('the compressed data has an unknown code');
  }
}

const kLengthBase = [3, 4, 5, 6, 7, 8, 9, 10, 11, 13, 15, 17, 19, 23, 27, 31, 35, 43, 51, 59, 67, 83, 99, 115, 131, 163, 195, 227, 258];
const kLengthBits = [0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5, 0];
const kDistanceBase = [1, 2, 3, 4, 5, 7, 9, 13, 17, 25, 33, 49, 65, 97, 129, 193, 257, 385, 513, 769, 1025, 1537, 2049, 3073, 4097, 6145, 8193, 12289, 16385, 24577];
const kDistanceBits = [0, 0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7, 8, 8, 9, 9, 10, 10, 11, 11, 12, 12, 13, 13];
const kLengthOrder = [16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15];

/// The codes of a block with codes of its own.
function readCodes(bits) {
  const literals = bits.take(5) + 257, distances = bits.take(5) + 1, count = bits.take(4) + 4;
  const lengths_of_lengths = new Array(19).fill(0);
  for (let i = 0; i < count; ++i) lengths_of_lengths[kLengthOrder[i]] = bits.take(3);
  const code = new HuffmanCode(lengths_of_lengths), lengths = [];
  while (lengths.length < literals + distances) {
    const symbol = code.read(bits);
    if (symbol < 16) {
      lengths.push(symbol);
      continue;
    }
    const repeated = symbol === 16 ? lengths[lengths.length - 1] : 0;
    let times = symbol === 16 ? 3 + bits.take(2) : symbol === 17 ? 3 + bits.take(3) : 11 + bits.take(7);
    while (times-- > 0) lengths.push(repeated);
  }
  return [new HuffmanCode(lengths.slice(0, literals)), new HuffmanCode(lengths.slice(literals, literals + distances))];
}

function fixedCodes() {
  const lengths = [];
  for (let symbol = 0; symbol < 288; ++symbol) lengths.push(symbol < 144 ? 8 : symbol < 256 ? 9 : symbol < 280 ? 7 : 8);
  return [new HuffmanCode(lengths), new HuffmanCode(new Array(30).fill(5))];
}

/// @param size number of bytes that the stream decompresses to.
function inflateHere(bytes, size) {
  const bits = new BitReader(bytes.subarray(2)), out = new Uint8Array(size);
  let end = 0;
  const need = (n) => {
    if (end + n > size) throw new Error('the compressed data is longer than announced');
  };
  for (let last = false; !last;) {
    last = bits.take(1) === 1;
    const kind = bits.take(2);
    if (kind === 3) throw new Error('the compressed data has a block of an unknown kind');
    if (kind === 0) {
      bits.skipToByte();
      const length = bits.take(16);
      bits.take(16);
      need(length);
      out.set(bits.bytes.subarray(bits.position, bits.position + length), end);
      bits.position += length;
      end += length;
      continue;
    }
    const [literals, distances] = kind === 1 ? fixedCodes() : readCodes(bits);
    for (let symbol = literals.read(bits); symbol !== 256; symbol = literals.read(bits)) {
      if (symbol < 256) {
        need(1);
        out[end++] = symbol;
        continue;
      }
      let length = kLengthBase[symbol - 257] + bits.take(kLengthBits[symbol - 257]);
      const code = distances.read(bits);
      const distance = kDistanceBase[code] + bits.take(kDistanceBits[code]);
      need(length);
      for (; length > 0; --length, ++end) out[end] = out[end - distance];
    }
  }
  if (end !== size) throw new Error('the compressed data is shorter than announced');
  return out;
}

/// @param bytes a zlib stream. @param size number of bytes that it decompresses to.
async function inflate(bytes, size) {
  if (typeof DecompressionStream === 'undefined') return inflateHere(bytes, size);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  const out = new Uint8Array(await new Response(stream).arrayBuffer());
  if (out.length !== size) throw new Error('the compressed data has another length than announced');
  return out;
}
