// Draws voxels, and finds those under the pointer. Scene units are voxels; `middle` of the map is the origin.
//
// Each tile is one draw call a state, with an instance of eight bytes for each voxel. Of a cube, only the three faces
// that look to the eye are drawn: seven corners, six triangles. Faces between occupied voxels are dropped, and so are voxels
// without a free face, unless a section or a hidden class can lay them open. What is shown, how it is coloured and where it is
// cut are uniforms and textures of 256 colours: changing them builds nothing.
'use strict';

const kVertexShader = `#version 300 es
precision highp float;
uniform mat4 modelViewMatrix, projectionMatrix;
uniform vec3 u_origin;      // of the tile
uniform vec3 u_eye;
uniform float u_edge;       // of a drawn cube
uniform bool u_whole;       // nothing is cut or hidden: covered faces cannot be seen
uniform int u_mode;         // what is coloured, see kModes
uniform vec2 u_heights;     // of the ramp of heights
uniform vec2 u_layers;      // lowest and highest that are shown
uniform vec3 u_wall;        // the vertical plane: shown is where dot(u_wall.xy, centre.xy) <= u_wall.z
uniform sampler2D u_shown;  // by label
uniform sampler2D u_ramp;   // by value
in vec3 position;           // corner of a cube; (1, 1, 1) is the nearest to the eye
in vec4 a_cell;             // place in the tile, and the covered faces
in vec4 a_value;            // label, occupancy, class probability, drive
flat out vec3 v_color;
flat out vec3 v_axis;
out vec3 v_corner;

void main() {
  vec3 centre = a_cell.xyz + 0.5, at = centre + u_origin;
  int label = int(a_value.x + 0.5);
  bool shown = texelFetch(u_shown, ivec2(label, 0), 0).r > 0.5 && at.z > u_layers.x && at.z < u_layers.y && dot(u_wall.xy, at.xy) <= u_wall.z;
  if (!shown) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    return;
  }
  vec3 side = mix(vec3(-1.0), vec3(1.0), greaterThan(u_eye, at));
  // The corners with a single 1 belong to one face each, and colour it.
  v_axis = position;
  vec3 corner = position;
  if (position.x + position.y + position.z == 1.0) {
    vec3 bits = mix(vec3(2.0, 8.0, 32.0), vec3(1.0, 4.0, 16.0), greaterThan(side, vec3(0.0)));
    int bit = int(dot(position, bits) + 0.5);
    if (u_whole && (int(a_cell.w + 0.5) & bit) != 0) corner = vec3(1.0);  // a face without area
    float value = a_value.x;
    if (u_mode == 1) value = a_value.y;
    if (u_mode == 2) value = a_value.z;
    if (u_mode == 3) value = 255.0 * clamp((at.z - u_heights.x) / (u_heights.y - u_heights.x), 0.0, 1.0);
    if (u_mode == 4) value = a_value.w;
    vec3 color = texelFetch(u_ramp, ivec2(int(value + 0.5), 0), 0).rgb;
    float light = dot(position, mix(vec3(0.62, 0.74, 0.50), vec3(0.82, 0.68, 1.0), greaterThan(side, vec3(0.0))));
    // Neighbours of one class differ a little, and black is not so dark that its faces look alike.
    float grain = fract(sin(dot(mod(a_cell.xyz, 32.0), vec3(12.99, 78.23, 37.72))) * 43758.5);
    v_color = (0.07 + 0.93 * color) * (light - 0.07 * grain);
  }
  v_corner = corner;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(centre + u_edge * side * (corner - 0.5), 1.0);
}`;

const kFragmentShader = `#version 300 es
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

const kModes = ['class', 'occupancy', 'class_probability', 'height', 'drive'];
/// The edge at which voxels of a state are drawn: through free space one sees what is behind.
const kEdges = {[kFree]: 0.4, [kOccupied]: 1, [kOccluded]: 0.4};

/// A texture of 256 colours.
function palette() {
  const texture = new THREE.DataTexture(new Uint8Array(4 * 256).fill(255), 256, 1, THREE.RGBAFormat);
  texture.needsUpdate = true;
  return texture;
}

/// The three faces of a cube that look to the eye.
function nearCorner() {
  const corners = [1, 1, 1, 0, 1, 1, 1, 0, 1, 1, 1, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1];
  const faces = [0, 2, 4, 3, 0, 4, 0, 1, 5, 3, 0, 5, 0, 1, 6, 2, 0, 6];  // the last corner of each triangle colours it
  return [new THREE.BufferAttribute(new Float32Array(corners), 3), new THREE.BufferAttribute(new Uint16Array(faces), 1)];
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

/// The voxels of a tile and a state: eight bytes each, those with a free face first. A face is covered beside a voxel of the
/// same state. @param states memory for readStatesAround().
function instancesOf(map, tile, state, states) {
  let count = 0;
  for (const s of tile.state) count += s === state;
  const cells = new Uint8Array(4 * count), values = new Uint8Array(4 * count);
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
      const i = 4 * (mask === 63 ? --back : front++);
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
  return {cells, values, count, outside: front};
}

/// All voxels in the scene, and what is shown of them.
class VoxelScene {
  constructor(map) {
    this.map = map;
    const {min, max} = map.header.bounds;  // [voxels], both included
    this.middle = [0, 1, 2].map((a) => Math.round((min[a] + max[a] + 1) / 2));
    this.group = new THREE.Group();
    this.corner = nearCorner();
    this.meshes = [];
    this.states = {};  // of those that have been built: {visible}
    this.shown = palette();
    this.ramp = palette();
    this.layers = [-1e9, 1e9];
    this.wall = {on: false, angle: 0, distance: 0};
    this.all_shown = true;
    this.common = {
      u_eye: {value: new THREE.Vector3()}, u_mode: {value: 0}, u_heights: {value: new THREE.Vector2(0, 1)},
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
    this.apply();
  }

  addTile(tile, state, around) {
    const {cells, values, count, outside} = instancesOf(this.map, tile, state, around);
    if (count === 0) return;
    const geometry = new THREE.InstancedBufferGeometry(), origin = tile.index.map((i, a) => kTileEdge * i - this.middle[a]);
    geometry.setAttribute('position', this.corner[0]);
    geometry.setIndex(this.corner[1]);
    geometry.setAttribute('a_cell', new THREE.InstancedBufferAttribute(cells, 4));
    geometry.setAttribute('a_value', new THREE.InstancedBufferAttribute(values, 4));
    geometry.boundingSphere = new THREE.Sphere(new THREE.Vector3(32, 32, 32), 56);
    const material = new THREE.RawShaderMaterial({
      uniforms: {...this.common, u_origin: {value: new THREE.Vector3(...origin)}, u_edge: {value: kEdges[state]}},
      vertexShader: kVertexShader, fragmentShader: kFragmentShader, side: THREE.DoubleSide,
    });
    const mesh = new THREE.Mesh(geometry, material);
    mesh.position.set(...origin);
    mesh.updateMatrixWorld();
    mesh.matrixAutoUpdate = false;
    mesh.userData = {state, count, outside};
    this.meshes.push(mesh);
    this.group.add(mesh);
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
      mesh.geometry.maxInstancedCount = drawn;
      mesh.geometry.instanceCount = drawn;  // its name in later versions of three.js
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
  pick(origin, direction) {
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
      if (offset >= 0 && this.shows(tile, offset, x, y, z) && this.meets(start, step, voxel, kEdges[tile.state[offset]])) return voxel;
      const axis = next[0] <= next[1] && next[0] <= next[2] ? 0 : next[1] <= next[2] ? 1 : 2;
      if (next[axis] > far) return undefined;
      voxel[axis] += Math.sign(step[axis]);
      next[axis] += Math.abs(1 / step[axis]);
    }
  }

  /// Whether a ray meets the cube that is drawn for a voxel.
  meets(start, step, voxel, edge) {
    let near = 0, far = Infinity;
    for (let a = 0; a < 3; ++a) {
      const one = (voxel[a] + 0.5 - edge / 2 - start[a]) / step[a], other = (voxel[a] + 0.5 + edge / 2 - start[a]) / step[a];
      near = Math.max(near, Math.min(one, other));
      far = Math.min(far, Math.max(one, other));
    }
    return edge === 1 || near <= far;
  }
}
