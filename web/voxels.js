// Draws voxels, and finds those under the pointer. Scene units are voxels; `middle` of the map is the origin.
//
// Each tile is one draw call a state. Occupied voxels are cubes, of which only the three faces that look to the eye are drawn:
// seven corners, each with the voxel's eight bytes, and six triangles. Instances would need less memory, but take ten times as
// long where the processor draws, and waste the small ones of many graphics cards. Faces between occupied voxels are dropped, and
// so are voxels without a free face, unless a cut or a hidden class can lay them open. Free and occluded voxels are points:
// between them one sees what lies behind. What is shown, how it is coloured and where it is cut are uniforms and textures of 256
// colours: changing them builds nothing.
'use strict';

const kCommonShader = `#version 300 es
precision highp float;
uniform mat4 modelViewMatrix, projectionMatrix;
uniform vec3 u_origin;      // of the tile
uniform int u_mode;         // what is coloured, see kModes
uniform vec2 u_heights;     // of the ramp of heights
uniform vec2 u_layers;      // lowest and highest that are shown
uniform vec3 u_wall;        // the vertical plane: shown is where dot(u_wall.xy, centre.xy) <= u_wall.z
uniform sampler2D u_shown;  // by label
uniform sampler2D u_ramp;   // by value
in vec4 position;           // place in the tile, and the covered faces
in vec4 a_value;            // label, occupancy, class probability, drive

const vec4 kNowhere = vec4(2.0, 2.0, 2.0, 1.0);

bool isShown(vec3 at) {
  return texelFetch(u_shown, ivec2(int(a_value.x + 0.5), 0), 0).r > 0.5 && at.z > u_layers.x && at.z < u_layers.y &&
         dot(u_wall.xy, at.xy) <= u_wall.z;
}

vec3 colorAt(vec3 at) {
  float value = a_value.x;
  if (u_mode == 1) value = a_value.y;
  if (u_mode == 2) value = a_value.z;
  if (u_mode == 3) value = 255.0 * clamp((at.z - u_heights.x) / (u_heights.y - u_heights.x), 0.0, 1.0);
  if (u_mode == 4) value = a_value.w;
  return texelFetch(u_ramp, ivec2(int(value + 0.5), 0), 0).rgb;
}
`;

const kCubeShader = `${kCommonShader}
uniform vec3 u_eye;
uniform bool u_whole;  // nothing is cut or hidden: covered faces cannot be seen
flat out vec3 v_color;
flat out vec3 v_axis;
out vec3 v_corner;

// Of a cube whose corner (1, 1, 1) is the nearest to the eye. Those with a single 1 belong to one face each, and colour it.
const vec3 kCorners[7] = vec3[7](vec3(1, 1, 1), vec3(0, 1, 1), vec3(1, 0, 1), vec3(1, 1, 0), vec3(1, 0, 0), vec3(0, 1, 0), vec3(0, 0, 1));

void main() {
  vec3 centre = position.xyz + 0.5, at = centre + u_origin;
  if (!isShown(at)) {
    gl_Position = kNowhere;
    return;
  }
  vec3 side = mix(vec3(-1.0), vec3(1.0), greaterThan(u_eye, at)), corner = kCorners[gl_VertexID % 7];
  v_axis = corner;
  if (corner.x + corner.y + corner.z == 1.0) {
    vec3 bits = mix(vec3(2.0, 8.0, 32.0), vec3(1.0, 4.0, 16.0), greaterThan(side, vec3(0.0)));
    float light = dot(corner, mix(vec3(0.62, 0.74, 0.50), vec3(0.82, 0.68, 1.0), greaterThan(side, vec3(0.0))));
    // Neighbours of one class differ a little, and black is not so dark that its faces look alike.
    float grain = fract(sin(dot(mod(position.xyz, 32.0), vec3(12.99, 78.23, 37.72))) * 43758.5);
    v_color = (0.07 + 0.93 * colorAt(at)) * (light - 0.07 * grain);
    if (u_whole && (int(position.w + 0.5) & int(dot(corner, bits) + 0.5)) != 0) corner = vec3(1.0);  // a face without area
  }
  v_corner = corner;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(centre + side * (corner - 0.5), 1.0);
}`;

const kFaceShader = `#version 300 es
precision highp float;
flat in vec3 v_color;
flat in vec3 v_axis;
in vec3 v_corner;
out vec4 color;

void main() {
  // Darker edges, where voxels are large enough to show them.
  vec3 inside = min(v_corner, 1.0 - v_corner) + v_axis;
  float edge = min(inside.x, min(inside.y, inside.z)), pixel = max(fwidth(edge), 1e-4);
  float line = (1.0 - smoothstep(0.5, 1.5, edge / pixel)) * clamp(1.2 - 8.0 * pixel, 0.0, 1.0);
  color = vec4(v_color * (1.0 - 0.3 * line), 1.0);
}`;

const kPointShader = `${kCommonShader}
uniform float u_size;  // of a point at distance 1 [pixels]
out vec3 v_color;

void main() {
  vec3 centre = position.xyz + 0.5, at = centre + u_origin;
  gl_Position = isShown(at) ? projectionMatrix * modelViewMatrix * vec4(centre, 1.0) : kNowhere;
  gl_PointSize = max(1.0, u_size / gl_Position.w);
  v_color = colorAt(at);
}`;

const kSquareShader = `#version 300 es
precision highp float;
in vec3 v_color;
out vec4 color;

void main() {
  vec2 inside = min(gl_PointCoord, 1.0 - gl_PointCoord);
  color = vec4(v_color * (min(inside.x, inside.y) < 0.1 ? 0.8 : 1.0), 1.0);
}`;

const kModes = ['class', 'occupancy', 'class_probability', 'height', 'drive'];
/// The edge of the squares that stand for free and occluded voxels [voxels].
const kPointEdge = 0.4;
const kCornersOfCube = 7;

/// A texture of 256 colours.
function palette() {
  const texture = new THREE.DataTexture(new Uint8Array(4 * 256).fill(255), 256, 1, THREE.RGBAFormat);
  texture.needsUpdate = true;
  return texture;
}

/// The triangles of a number of cubes: of each, the three faces that look to the eye.
function cubeTriangles(count) {
  const faces = [0, 2, 4, 3, 0, 4, 0, 1, 5, 3, 0, 5, 0, 1, 6, 2, 0, 6];  // the last corner of each triangle colours it
  const index = new Uint32Array(faces.length * count);
  for (let i = 0; i < index.length; ++i) index[i] = kCornersOfCube * Math.floor(i / faces.length) + faces[i % faces.length];
  return new THREE.BufferAttribute(index, 1);
}

/// Four bytes of each vertex. They are in the graphics card once they have been drawn, and not in two places.
function byteAttribute(bytes) {
  return new THREE.BufferAttribute(bytes, 4).onUpload(function() { this.array = null; });
}

const kAround = kTileEdge + 2, kAroundLayer = kAround * kAround;

/// Where the states around a tile have a voxel, given in the tile: -1 and 64 are in its neighbours.
function around(x, y, z) {
  return x + 1 + kAround * (y + 1) + kAroundLayer * (z + 1);
}

/// The states of the voxels of a tile, and of those beside it. @param states 66 x 66 x 66 values, which are overwritten.
function readStatesAround(map, tile, states) {
  states.fill(kUnknown);
  for (let b = 0; b < tile.blocks; ++b) {
    const number = tile.number[b], begin = around(8 * (number & 7), 8 * (number >> 3 & 7), 8 * (number >> 6));
    for (let row = 0; row < 64; ++row) {
      const from = kBlockVoxels * b + 8 * row, to = begin + kAround * (row & 7) + kAroundLayer * (row >> 3);
      for (let x = 0; x < 8; ++x) states[to + x] = tile.state[from + x];
    }
  }
  for (let axis = 0; axis < 3; ++axis) {
    for (const step of [-1, 1]) {
      const beside = map.by_index.get(tile.index.map((i, a) => a === axis ? i + step : i).join());
      if (!beside) continue;
      const at = [0, 0, 0], u = (axis + 1) % 3, v = (axis + 2) % 3;
      for (at[u] = 0; at[u] < kTileEdge; ++at[u]) {
        for (at[v] = 0; at[v] < kTileEdge; ++at[v]) {
          at[axis] = step > 0 ? 0 : kTileEdge - 1;
          const offset = beside.offset(at[0], at[1], at[2]);
          if (offset < 0) continue;
          at[axis] = step > 0 ? kTileEdge : -1;
          states[around(at[0], at[1], at[2])] = beside.state[offset];
        }
      }
    }
  }
}

/// The vertices of the voxels of a tile and a state: eight bytes each, voxels with a free face first. A face is covered beside a
/// voxel of the same state. @param copies number of vertices of a voxel. @param states memory for readStatesAround().
function verticesOf(map, tile, state, copies, states) {
  let count = 0;
  for (const s of tile.state) count += s === state;
  const cells = new Uint8Array(4 * copies * count), values = new Uint8Array(4 * copies * count);
  if (count === 0) return {cells, values, count, outside: 0};
  readStatesAround(map, tile, states);
  let front = 0, back = count;
  for (let b = 0; b < tile.blocks; ++b) {
    const number = tile.number[b], x0 = 8 * (number & 7), y0 = 8 * (number >> 3 & 7), z0 = 8 * (number >> 6);
    for (let v = 0; v < kBlockVoxels; ++v) {
      const offset = kBlockVoxels * b + v;
      if (tile.state[offset] !== state) continue;
      const x = x0 + (v & 7), y = y0 + (v >> 3 & 7), z = z0 + (v >> 6), n = around(x, y, z);
      const mask = (states[n + 1] === state) | (states[n - 1] === state) << 1 | (states[n + kAround] === state) << 2 |
                   (states[n - kAround] === state) << 3 | (states[n + kAroundLayer] === state) << 4 |
                   (states[n - kAroundLayer] === state) << 5;
      const begin = 4 * copies * (mask === 63 ? --back : front++);
      for (let i = begin; i < begin + 4 * copies; i += 4) {
        cells[i] = x;
        cells[i + 1] = y;
        cells[i + 2] = z;
        cells[i + 3] = mask;
        values[i] = state === kOccluded ? kOccludedLabel : tile.label[offset];
        values[i + 1] = tile.occupancy[offset];
        values[i + 2] = tile.class_probability[offset];
        values[i + 3] = tile.drive ? tile.drive[offset] : 0;
      }
    }
  }
  return {cells, values, count, outside: front};
}

/// All voxels in the scene, and what is shown of them.
class VoxelScene {
  constructor(map) {
    this.map = map;
    const {min, max} = map.header.bounds;  // [voxels], both included
    this.middle = [0, 1, 2].map((a) => Math.round((min[a] + max[a] + 1) / 2));
    this.group = new THREE.Group();
    this.meshes = [];
    this.states = {};  // of those that have been built: {visible}
    this.shown = palette();
    this.ramp = palette();
    this.layers = [-1e9, 1e9];
    this.wall = {on: false, angle: 0, distance: 0};
    this.all_shown = true;
    this.common = {
      u_eye: {value: new THREE.Vector3()}, u_size: {value: 1}, u_mode: {value: 0}, u_heights: {value: new THREE.Vector2(0, 1)},
      u_layers: {value: new THREE.Vector2()}, u_wall: {value: new THREE.Vector3()}, u_shown: {value: this.shown}, u_ramp: {value: this.ramp},
      u_whole: {value: true},
    };
    this.apply();
  }

  /// Makes the meshes of a state. @param progress called with the fraction that is done.
  async build(state, progress) {
    this.states[state] = {visible: true};
    const around = new Uint8Array(kAround * kAroundLayer);
    for (let t = 0; t < this.map.tiles.length; ++t) {
      this.addTile(this.map.tiles[t], state, around);
      await progress((t + 1) / this.map.tiles.length);
    }
    if (state === kOccupied) this.shareTriangles();
    this.apply();
  }

  addTile(tile, state, around) {
    const cubes = state === kOccupied, {cells, values, count, outside} = verticesOf(this.map, tile, state, cubes ? kCornersOfCube : 1, around);
    if (count === 0) return;
    const geometry = new THREE.BufferGeometry(), origin = tile.index.map((i, a) => kTileEdge * i - this.middle[a]);
    geometry.setAttribute('position', byteAttribute(cells));  // three.js draws nothing without this name
    geometry.setAttribute('a_value', byteAttribute(values));
    geometry.boundingSphere = new THREE.Sphere(new THREE.Vector3(32, 32, 32), 56);
    const material = new THREE.RawShaderMaterial({
      uniforms: {...this.common, u_origin: {value: new THREE.Vector3(...origin)}}, side: THREE.DoubleSide,
      vertexShader: cubes ? kCubeShader : kPointShader, fragmentShader: cubes ? kFaceShader : kSquareShader,
    });
    const mesh = cubes ? new THREE.Mesh(geometry, material) : new THREE.Points(geometry, material);
    mesh.position.set(...origin);
    mesh.updateMatrixWorld();
    mesh.matrixAutoUpdate = false;
    mesh.userData = {state, count, outside};
    this.meshes.push(mesh);
    this.group.add(mesh);
  }

  /// Gives all cubes the same list of triangles, as long as the longest needs it.
  shareTriangles() {
    const cubes = this.meshes.filter((mesh) => mesh.userData.state === kOccupied);
    const triangles = cubeTriangles(Math.max(0, ...cubes.map((mesh) => mesh.userData.count)));
    for (const mesh of cubes) mesh.geometry.setIndex(triangles);
  }

  /// Whether voxels of a state are shown.
  isVisible(state) {
    return Boolean(this.states[state] && this.states[state].visible);
  }

  /// Takes over what is shown, cut and coloured.
  apply() {
    const {common, wall} = this, uncut = this.layers[0] < -1e8 && this.layers[1] > 1e8 && !wall.on;
    common.u_layers.value.set(this.layers[0] - this.middle[2], this.layers[1] - this.middle[2]);
    common.u_wall.value.set(Math.cos(wall.angle), Math.sin(wall.angle), wall.distance);
    if (!wall.on) common.u_wall.value.set(0, 0, 1);
    common.u_whole.value = uncut && this.all_shown;
    for (const mesh of this.meshes) {
      const {state, count, outside} = mesh.userData, drawn = common.u_whole.value ? outside : count;
      mesh.visible = this.isVisible(state) && drawn > 0;
      mesh.geometry.setDrawRange(0, state === kOccupied ? 18 * drawn : drawn);
    }
  }

  /// Whether a voxel is drawn.
  shows(tile, offset, x, y, z) {
    const state = tile.state[offset];
    if (!this.isVisible(state)) return false;
    const label = state === kOccluded ? kOccludedLabel : tile.label[offset];
    const height = z + 0.5;
    if (!this.shown.image.data[4 * label] || height <= this.layers[0] || height >= this.layers[1]) return false;
    const {x: nx, y: ny, z: most} = this.common.u_wall.value;
    return nx * (x + 0.5 - this.middle[0]) + ny * (y + 0.5 - this.middle[1]) <= most;
  }

  /// The first drawn voxel on a ray, as [x, y, z]; undefined if there is none.
  /// @param camera that looks: points are squares that face it.
  pick({origin, direction}, camera) {
    const {min, max} = this.map.header.bounds, start = origin.toArray(), step = direction.toArray();
    let near = 0, far = Infinity;
    for (let a = 0; a < 3; ++a) {  // where the ray enters and leaves the map
      start[a] += this.middle[a];
      const one = (min[a] - start[a]) / step[a], other = (max[a] + 1 - start[a]) / step[a];
      if (step[a] === 0) {
        if (start[a] < min[a] || start[a] > max[a] + 1) return undefined;
        continue;
      }
      near = Math.max(near, Math.min(one, other));
      far = Math.min(far, Math.max(one, other));
    }
    if (near > far) return undefined;
    const voxel = start.map((s, a) => Math.max(min[a], Math.min(max[a], Math.floor(s + near * step[a]))));
    const next = voxel.map((v, a) => step[a] === 0 ? Infinity : (v + (step[a] > 0) - start[a]) / step[a]);
    let tile, key = '';
    for (;;) {
      const [x, y, z] = voxel, wanted = `${x >> 6},${y >> 6},${z >> 6}`;
      if (wanted !== key) {
        key = wanted;
        tile = this.map.by_index.get(key);
      }
      const offset = tile ? tile.offset(x & 63, y & 63, z & 63) : -1;
      if (offset >= 0 && this.shows(tile, offset, x, y, z) && (tile.state[offset] === kOccupied || this.meetsPoint(start, step, voxel, camera))) {
        return voxel;
      }
      const axis = next[0] <= next[1] && next[0] <= next[2] ? 0 : next[1] <= next[2] ? 1 : 2;
      if (next[axis] > far) return undefined;
      voxel[axis] += Math.sign(step[axis]);
      next[axis] += Math.abs(1 / step[axis]);
    }
  }

  /// Whether a ray meets the square of a point.
  meetsPoint(start, step, voxel, camera) {
    const [right, up, back] = [0, 4, 8].map((i) => camera.matrixWorld.elements.slice(i, i + 3));
    const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2], to = voxel.map((v, a) => v + 0.5 - start[a]);
    const t = dot(to, back) / dot(step, back), off = to.map((v, a) => t * step[a] - v);
    return Math.max(Math.abs(dot(off, right)), Math.abs(dot(off, up))) <= kPointEdge / 2;
  }
}
