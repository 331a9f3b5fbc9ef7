// Draws trajectories as lines that are as wide on the screen from any distance. Scene units are voxels.
'use strict';

const kTrajectoryPixels = 4, kOutlinePixels = 2;  // the line, and the dark edge on each side of it

const kTrajectoryShader = `#version 300 es
precision highp float;
uniform mat4 modelViewMatrix, projectionMatrix;
uniform vec2 u_view;   // size of the view [pixels]
uniform float u_half;  // half of the line's width [pixels]
uniform float u_near;  // of the camera
in vec3 position, a_other;  // this end of a segment, and the other one
in vec2 a_corner;           // along the segment and across it: -1 or 1

void main() {
  vec4 here = modelViewMatrix * vec4(position, 1.0), there = modelViewMatrix * vec4(a_other, 1.0);
  if (here.z > -u_near && there.z < -u_near) here = mix(there, here, (there.z + u_near) / (there.z - here.z));
  if (there.z > -u_near && here.z < -u_near) there = mix(here, there, (here.z + u_near) / (here.z - there.z));
  vec4 place = projectionMatrix * here, other = projectionMatrix * there;
  vec2 along = (other.xy / other.w - place.xy / place.w) * u_view * a_corner.x;
  along = dot(along, along) > 1e-6 ? normalize(along) : vec2(1.0, 0.0);
  // The ends reach beyond the segment, so that there are no gaps where the line bends.
  vec2 shift = u_half * (vec2(-along.y, along.x) * a_corner.y - along * a_corner.x);
  gl_Position = place + vec4(2.0 * shift / u_view * place.w, 0.0, 0.0);
}`;

const kPlainShader = `#version 300 es
precision highp float;
uniform vec4 u_color;
out vec4 color;
void main() { color = u_color; }`;

/// The segments between places as quads. @param places of THREE.Vector3.
function segmentGeometry(places) {
  const segments = places.length - 1, here = new Float32Array(12 * segments), there = new Float32Array(12 * segments);
  const corners = new Float32Array(8 * segments), triangles = new Uint32Array(6 * segments);
  for (let s = 0; s < segments; ++s) {
    for (let v = 0; v < 4; ++v) {
      const end = v >> 1, side = v & 1 ? 1 : -1;
      places[s + end].toArray(here, 12 * s + 3 * v);
      places[s + 1 - end].toArray(there, 12 * s + 3 * v);
      corners.set([end ? -1 : 1, side], 8 * s + 2 * v);
    }
    triangles.set([0, 1, 2, 2, 1, 3].map((v) => 4 * s + v), 6 * s);
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(here, 3));
  geometry.setAttribute('a_other', new THREE.BufferAttribute(there, 3));
  geometry.setAttribute('a_corner', new THREE.BufferAttribute(corners, 2));
  geometry.setIndex(new THREE.BufferAttribute(triangles, 1));
  return geometry;
}

/// A trajectory with a dark edge; where voxels hide it, it shines through. @param common uniforms of all lines: u_view, u_near,
/// u_ratio, the pixels of the view for each of the page.
function trajectoryLine(places, color, common) {
  const line = new THREE.Group(), geometry = segmentGeometry(places);
  const add = (rgb, alpha, pixels, hidden, order) => {
    const material = new THREE.RawShaderMaterial({
      uniforms: {...common, u_color: {value: new THREE.Vector4(...rgb.map((c) => c / 255), alpha)}, u_half: {value: 1}},
      vertexShader: kTrajectoryShader, fragmentShader: kPlainShader, side: THREE.DoubleSide, depthWrite: false, transparent: true,
      depthFunc: hidden ? THREE.GreaterDepth : THREE.LessEqualDepth,
    });
    const mesh = new THREE.Mesh(geometry, material);
    mesh.frustumCulled = false;
    mesh.renderOrder = order;
    mesh.onBeforeRender = () => { material.uniforms.u_half.value = 0.5 * pixels * common.u_ratio.value; };
    line.add(mesh);
  };
  for (const hidden of [true, false]) {
    add([16, 20, 26], hidden ? 0.3 : 1, kTrajectoryPixels + 2 * kOutlinePixels, hidden, hidden ? 1 : 3);
    add(color, hidden ? 0.4 : 1, kTrajectoryPixels, hidden, hidden ? 2 : 4);
  }
  return line;
}
