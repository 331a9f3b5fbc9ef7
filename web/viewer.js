// The page: what its controls do.
'use strict';

const kViridis = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];
const kHeights = [[40, 60, 140], [40, 150, 200], [110, 200, 130], [240, 210, 80], [210, 70, 50]];
const kDriveColors = [[128, 128, 128], [31, 119, 180], [255, 127, 14], [44, 160, 44], [214, 39, 40], [148, 103, 189], [140, 86, 75],
                      [227, 119, 194], [188, 189, 34], [23, 190, 207]];
const kFreeColor = [150, 200, 235], kOccludedColor = [110, 110, 125], kTrajectoryColor = [255, 255, 255];
const kModeNames = {class: 'Class', occupancy: 'Occupancy', class_probability: 'Class probability', height: 'Height', drive: 'Drive'};
const kStateNames = {[kUnknown]: 'unknown', [kFree]: 'free', [kOccupied]: 'occupied', [kOccluded]: 'occluded'};

const byId = (id) => document.getElementById(id);
const cssOf = (color) => `rgb(${color.join()})`;
const numberText = (number) => number.toLocaleString('en');

/// An element with properties and children; strings become text.
function make(name, properties = {}, ...children) {
  const element = Object.assign(document.createElement(name), properties);
  element.append(...children);
  return element;
}

function swatch(color) {
  const element = make('span', {className: 'swatch'});
  element.style.background = cssOf(color);
  return element;
}

/// The colour at a fraction of a ramp.
function rampColor(stops, fraction) {
  const at = Math.max(0, Math.min(1, fraction)) * (stops.length - 1), i = Math.min(stops.length - 2, Math.floor(at));
  return stops[i].map((low, c) => Math.round(low + (at - i) * (stops[i + 1][c] - low)));
}

/// The values below which 1 % and 99 % of what a histogram counts lie.
function usualRange(histogram) {
  const all = histogram.reduce((sum, n) => sum + n, 0);
  let below = 0, low = 0, high = histogram.length - 1;
  histogram.forEach((n, value) => {
    if (below <= 0.01 * all) low = value;
    if (below < 0.99 * all) high = value;
    below += n;
  });
  return [low, Math.max(high, low + 1)];
}

/// Says how far the work is, and lets the browser draw, but not so often that it takes longer.
function progressOn(bar) {
  let last = performance.now();
  return async (fraction) => {
    if (performance.now() - last < 60) return;
    bar.value = fraction;
    await new Promise((resume) => setTimeout(resume));
    last = performance.now();
  };
}

class Viewer {
  constructor(map) {
    this.map = map;
    this.header = map.header;
    this.canvas = byId('view');
    const context = this.canvas.getContext('webgl2', {antialias: true, alpha: false});
    if (!context) throw new Error('this browser has no WebGL 2, or has it switched off; allow hardware acceleration, or take another browser');
    this.renderer = new THREE.WebGLRenderer({canvas: this.canvas, context});
    this.scene = new THREE.Scene();
    this.scene.autoUpdate = false;
    this.voxels = new VoxelScene(map);
    this.scene.add(this.voxels.group);
    this.orbit = new OrbitCamera(this.canvas, () => this.draw(), (x, y) => this.pickAt(x, y));
    this.mode = 'class';
    this.frames = 0;  // drawn so far
    this.asked = 0;  // how often a voxel was asked for, or closed
    this.times = {};  // [ms]
    this.canvas.addEventListener('webglcontextrestored', () => location.reload());
  }

  async open() {
    await this.voxels.build(kOccupied, progressOn(byId('loading-bar')));
    this.readRanges();
    this.addTrajectories();
    this.addHighlight();
    this.fillPanel();
    this.listen();
    this.setTheme(!matchMedia('(prefers-color-scheme: light)').matches);
    document.body.classList.toggle('closed', innerWidth <= 640);
    this.setMode('class');
    this.resize();
    this.reset();
  }

  // Drawing.

  draw() {
    if (this.drawing) return;
    this.drawing = true;
    requestAnimationFrame(() => {
      this.drawing = false;
      this.drawNow();
    });
  }

  drawNow() {
    const {common} = this.voxels, {camera} = this.orbit;
    common.u_eye.value.copy(camera.position);
    common.u_size.value = kPointEdge * camera.projectionMatrix.elements[5] * this.canvas.height / 2;
    this.lines.u_view.value.set(this.canvas.width, this.canvas.height);
    this.lines.u_near.value = camera.near;
    this.lines.u_ratio.value = this.renderer.getPixelRatio();
    this.renderer.render(this.scene, this.orbit.camera);
    this.drawScale();
    ++this.frames;
  }

  /// Draws a bar of a round length, as long as it is in the middle of the view.
  drawScale() {
    const most = 110, metres = this.header.resolution * this.orbit.unitsPerPixel() * most;  // of a bar of `most` pixels
    const power = 10 ** Math.floor(Math.log10(metres)), length = [5, 2, 1].find((n) => n * power <= metres) * power;
    byId('scale-bar').style.width = `${most * length / metres}px`;
    byId('scale-text').textContent = length >= 1000 ? `${length / 1000} km` : length >= 1 ? `${length} m` : `${Math.round(100 * length)} cm`;
  }

  resize() {
    const closed = document.body.classList.contains('closed'), narrow = innerWidth <= 640;
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.renderer.setSize(innerWidth, innerHeight, false);
    this.orbit.resize({left: closed || narrow ? 0 : 324, bottom: !narrow ? 0 : closed ? 57 : 57 + 0.46 * innerHeight});
    byId('menu').setAttribute('aria-expanded', String(!closed));
  }

  /// The box [scene] that holds most of the occupied voxels, and the ranges of what colours show.
  readRanges() {
    const {middle} = this.voxels, {min, max} = this.header.bounds, heights = new Array(max[2] - min[2] + 1).fill(0);
    const blocks = [[], [], []], values = {occupancy: new Array(256).fill(0), class_probability: new Array(256).fill(0)};
    for (const tile of this.map.tiles) {
      for (let b = 0; b < tile.blocks; ++b) {
        const number = tile.number[b], at = [number & 7, number >> 3 & 7, number >> 6].map((n, a) => kTileEdge * tile.index[a] + 8 * n);
        let count = 0;
        for (let v = 0, offset = kBlockVoxels * b; v < kBlockVoxels; ++v, ++offset) {
          if (tile.state[offset] !== kOccupied) continue;
          ++count;
          ++heights[at[2] + (v >> 6) - min[2]];
          ++values.occupancy[tile.occupancy[offset]];
          ++values.class_probability[tile.class_probability[offset]];
        }
        if (count > 0) at.forEach((place, a) => blocks[a].push([place, count]));
      }
    }
    const low = [...min], high = max.map((m) => m + 1);
    blocks.forEach((places, a) => {
      places.sort((one, other) => one[0] - other[0]);
      const all = places.reduce((sum, [, count]) => sum + count, 0);
      let below = 0;
      for (const [place, count] of places) {
        if (below <= 0.04 * all) low[a] = place;
        if (below < 0.96 * all) high[a] = place + 8;
        below += count;
      }
    });
    this.usual = new THREE.Box3(new THREE.Vector3(...low.map((l, a) => l - middle[a])), new THREE.Vector3(...high.map((h, a) => h - middle[a])));
    const [lowest, highest] = usualRange(heights);
    this.ranges = {
      height: [min[2] + lowest, min[2] + highest + 1],  // [voxels]
      occupancy: usualRange(values.occupancy), class_probability: usualRange(values.class_probability),
    };
    this.orbit.reach = Math.hypot(...max.map((m, a) => (m + 1 - min[a]) / 2)) + 10;
  }

  addTrajectories() {
    this.trajectories = new THREE.Group();
    this.lines = {u_view: {value: new THREE.Vector2()}, u_near: {value: 1}, u_ratio: {value: 1}};
    this.header.trajectories.forEach((trajectory, n) => {
      const places = trajectory.points.map((p) => new THREE.Vector3(...p.map((m, a) => m / this.header.resolution - this.voxels.middle[a])));
      if (places.length < 2) return;
      const color = this.header.trajectories.length === 1 ? kTrajectoryColor : kDriveColors[1 + n % 9];
      this.trajectories.add(trajectoryLine(places, color, this.lines));
    });
    this.trajectories.visible = this.trajectories.children.length > 0;
    this.scene.add(this.trajectories);
  }

  addHighlight() {
    const edges = new THREE.EdgesGeometry(new THREE.BoxBufferGeometry(1.05, 1.05, 1.05));
    this.highlight = new THREE.LineSegments(edges, new THREE.LineBasicMaterial({color: 0xff2fa0, depthTest: false}));
    this.highlight.renderOrder = 1;  // over all others
    this.highlight.visible = false;
    this.scene.add(this.highlight);
  }

  reset() {
    const size = this.usual.getSize(new THREE.Vector3()), wide = innerWidth >= innerHeight;
    // The longer side across a wide window, and up a tall one.
    const from_south = size.x >= size.y === wide;
    this.orbit.frame(this.usual, (from_south ? -Math.PI / 2 : Math.PI) - 0.3, wide ? 0.66 : 0.8);
  }

  // The panel.

  fillPanel() {
    const {header} = this, counts = header.voxels;
    document.title = byId('title').textContent = header.name || 'Map';
    byId('summary').textContent = `${numberText(counts.occupied)} occupied, ${numberText(counts.free)} free voxels of ${header.resolution} m` +
        (header.frame ? `, in frame ${header.frame}` : '');
    for (const mode of kModes) {
      if (mode === 'drive' && header.planes < kPlanes.length) continue;
      const input = make('input', {type: 'radio', name: 'mode', value: mode, id: `mode-${mode}`, checked: mode === 'class'});
      input.addEventListener('change', () => this.setMode(mode));
      byId('modes').append(make('label', {className: 'mode'}, input, make('span', {}, kModeNames[mode])));
    }
    const addState = (id, text, count, color, checked, change) => {
      const input = make('input', {type: 'checkbox', id, checked});
      input.addEventListener('change', () => change(input.checked));
      byId('states').append(make('label', {className: 'check'}, input, ...(color ? [swatch(color)] : []), make('span', {className: 'name'}, text),
                                 make('span', {className: 'count'}, count)));
    };
    addState('show-occupied', 'Occupied', numberText(counts.occupied), undefined, true, (on) => this.showState(kOccupied, on));
    if (counts.free > 0) addState('show-free', 'Free space', numberText(counts.free), kFreeColor, false, (on) => this.showState(kFree, on));
    if (counts.occluded > 0) {
      addState('show-occluded', 'Occluded', numberText(counts.occluded), kOccludedColor, false, (on) => this.showState(kOccluded, on));
    }
    if (this.trajectories.visible) {
      addState('show-trajectory', 'Trajectory', '', kTrajectoryColor, true, (on) => {
        this.trajectories.visible = on;
        this.draw();
      });
    } else {
      byId('states').append(make('p', {id: 'no-trajectory'}, 'No trajectory: map files hold none; give export_map --trajectory.'));
    }
    for (const c of [...header.classes].filter((one) => one.voxels > 0).sort((a, b) => b.voxels - a.voxels)) {
      const input = make('input', {type: 'checkbox', checked: true, id: `class-${c.id}`, className: 'class'});
      input.addEventListener('change', () => this.showClasses([[c.id, input.checked]]));
      byId('classes').append(make('li', {title: c.name}, make('label', {className: 'check'}, input, swatch(c.color), make('span', {className: 'name'}, c.name),
                                                           make('span', {className: 'count'}, numberText(c.voxels)))));
    }
    header.drives.forEach((drive, i) => {
      byId('drives').append(make('li', {title: drive.name}, swatch(this.driveColor(i + 1)), make('span', {className: 'name'}, drive.id)));
    });
    byId('drives').append(make('li', {}, swatch(kDriveColors[0]), make('span', {className: 'name'}, 'several, or not known')));
    const metres = (layer) => layer * header.resolution, lowest = header.bounds.min[2], highest = header.bounds.max[2] + 1;
    for (const id of ['top', 'bottom']) {
      Object.assign(byId(id), {min: lowest, max: highest, step: 1, value: id === 'top' ? highest : lowest});
      byId(id).addEventListener('input', () => this.cut());
    }
    this.heightText = (layer) => `${metres(layer).toFixed(2)} m`;
    const reach = Math.ceil(this.orbit.reach);
    Object.assign(byId('wall-place'), {min: -reach, max: reach, step: 0.5, value: 0});
    this.cut();
  }

  driveColor(code) {
    return code === 0 ? kDriveColors[0] : kDriveColors[1 + (code - 1) % (kDriveColors.length - 1)];
  }

  setMode(mode) {
    this.mode = mode;
    byId(`mode-${mode}`).checked = true;
    const {voxels, ranges, header} = this, colors = voxels.ramp.image.data, scalar = ['occupancy', 'class_probability', 'height'].includes(mode);
    const stops = mode === 'height' ? kHeights : kViridis;
    for (let value = 0; value < 256; ++value) {
      let color = [160, 160, 160];
      if (mode === 'class') {
        const known = this.map.classes.get(value);
        color = value === kFreeLabel ? kFreeColor : value === kOccludedLabel ? kOccludedColor : known ? known.color : color;
      } else if (mode === 'drive') {
        color = this.driveColor(value);
      } else if (mode === 'height') {
        color = rampColor(stops, value / 255);
      } else {
        const [low, high] = ranges[mode];
        color = rampColor(stops, (value - low) / (high - low));
      }
      colors.set(color, 4 * value);
    }
    voxels.ramp.needsUpdate = true;
    voxels.common.u_mode.value = kModes.indexOf(mode);
    voxels.common.u_heights.value.set(ranges.height[0] - voxels.middle[2], ranges.height[1] - voxels.middle[2]);
    byId('ramp').hidden = !scalar;
    byId('drives').hidden = mode !== 'drive';
    if (scalar) {
      byId('gradient').style.background = `linear-gradient(to right, ${stops.map(cssOf).join()})`;
      const text = mode === 'height' ? (value) => `${(value * header.resolution).toFixed(1)} m` : (value) => (value / 255).toFixed(2);
      byId('ramp-low').textContent = `≤ ${text(ranges[mode][0])}`;
      byId('ramp-high').textContent = `≥ ${text(ranges[mode][1])}`;
    }
    this.draw();
  }

  async showState(state, on) {
    if (on && !this.voxels.states[state]) {
      byId('loading-text').textContent = 'Adding voxels …';
      byId('loading').hidden = false;
      await this.voxels.build(state, progressOn(byId('loading-bar')));
      byId('loading').hidden = true;
    }
    if (this.voxels.states[state]) this.voxels.states[state].visible = on;
    this.voxels.apply();
    this.draw();
  }

  /// @param changes pairs of a class id and whether it is shown.
  showClasses(changes) {
    const data = this.voxels.shown.image.data;
    for (const [id, on] of changes) data[4 * id] = on ? 255 : 0;
    this.voxels.shown.needsUpdate = true;
    this.voxels.all_shown = this.header.classes.every((c) => data[4 * c.id] > 0);
    this.voxels.apply();
    this.draw();
  }

  showAllClasses(on) {
    document.querySelectorAll('input.class').forEach((input) => { input.checked = on; });
    this.showClasses(this.header.classes.map((c) => [c.id, on]));
  }

  /// Takes over the cut from its controls.
  cut() {
    const {voxels} = this, {min, max} = this.header.bounds, top = Number(byId('top').value), bottom = Number(byId('bottom').value);
    voxels.layers = [bottom <= min[2] ? -1e9 : bottom, top >= max[2] + 1 ? 1e9 : top];
    const place = Number(byId('wall-place').value), degrees = Number(byId('wall-angle').value);
    voxels.wall = {on: byId('wall').checked, angle: degrees * Math.PI / 180, distance: place};
    byId('wall-controls').hidden = !voxels.wall.on;
    byId('top-value').textContent = this.heightText(top);
    byId('bottom-value').textContent = this.heightText(bottom);
    byId('wall-place-value').textContent = `${(place * this.header.resolution).toFixed(1)} m`;
    byId('wall-angle-value').textContent = `${degrees}°`;
    voxels.apply();
    this.draw();
  }

  /// Puts the vertical plane through the middle of the view, and takes away what is before it.
  placeWall() {
    const degrees = 5 * Math.round(this.orbit.azimuth * 36 / Math.PI), angle = degrees * Math.PI / 180, {target} = this.orbit;
    byId('wall-angle').value = String((degrees % 360 + 540) % 360 - 180);
    byId('wall-place').value = String(target.x * Math.cos(angle) + target.y * Math.sin(angle));
  }

  uncut() {
    byId('top').value = byId('top').max;
    byId('bottom').value = byId('bottom').min;
    byId('wall').checked = false;
    this.cut();
  }

  setTheme(dark) {
    document.documentElement.classList.toggle('dark', dark);
    this.renderer.setClearColor(new THREE.Color(getComputedStyle(document.documentElement).getPropertyValue('--sky').trim()));
    this.draw();
  }

  // A voxel.

  async pickAt(x, y) {
    const voxel = this.voxels.pick(this.orbit.ray(x, y), this.orbit.camera);
    if (voxel) await this.showVoxel(...voxel);
    else this.closeVoxel();
  }

  closeVoxel() {
    ++this.asked;
    byId('voxel').hidden = true;
    this.highlight.visible = false;
    this.draw();
  }

  async showVoxel(x, y, z) {
    const asked = ++this.asked, voxel = await describeVoxel(this.map, x, y, z), {header} = this;
    if (!voxel || asked !== this.asked) return;  // while this one was read, another was asked for, or it was closed
    const known = this.map.classes.get(voxel.label), nameOf = (id) => id === kFreeLabel ? 'free' : this.map.classes.get(id).name;
    const colorOf = (id) => id === kFreeLabel ? kFreeColor : this.map.classes.get(id).color;
    const occupied = voxel.state === kOccupied && known, title = occupied ? known.name : kStateNames[voxel.state];
    byId('voxel-title').replaceChildren(swatch(occupied ? known.color : voxel.state === kFree ? kFreeColor : kOccludedColor), title);
    const drive = header.drives[header.drives.length === 1 ? 0 : voxel.drive - 1];
    const facts = [
      ['State', kStateNames[voxel.state]],
      ...(occupied ? [['Class', `${known.name} (id ${known.id})`]] : []),
      ['Centre', `${voxel.centre.map((m) => m.toFixed(2)).join(', ')} m`],
      ['Index', voxel.index.join(', ')],
      ['Occupancy', voxel.occupancy.toFixed(2)],
      ...(occupied ? [['Class probability', voxel.class_probability.toFixed(2)]] : []),
      ['Variance', voxel.variance.toPrecision(3)],
      ['Evidence', voxel.evidence.toPrecision(4)],
      ...(drive ? [['Drive', drive.id]] : []),
    ];
    byId('voxel-facts').replaceChildren(...facts.flatMap(([name, value]) => [make('dt', {}, name), make('dd', {}, value)]));
    // The likeliest, and what is left for the others.
    const listed = voxel.probabilities.filter((entry, n) => n < 6 && (n < 1 || entry.p >= 0.005));
    const rest = 1 - listed.reduce((sum, entry) => sum + entry.p, 0), others = voxel.probabilities.length - listed.length;
    const row = (name, p, color) => {
      const bar = make('span', {className: 'bar'});
      bar.style.cssText = `width: ${(100 * p).toFixed(1)}%; background: ${cssOf(color)}`;
      return make('tr', {}, make('td', {title: name}, name), make('td', {}, bar), make('td', {}, p.toFixed(3)));
    };
    byId('voxel-classes').replaceChildren(...listed.map((entry) => row(nameOf(entry.id), entry.p, colorOf(entry.id))),
                                          ...(others > 0 ? [row(`${others} others`, Math.max(0, rest), [128, 128, 128])] : []));
    byId('voxel').hidden = false;
    this.highlight.position.set(...[x, y, z].map((v, a) => v + 0.5 - this.voxels.middle[a]));
    this.highlight.updateMatrixWorld();
    this.highlight.visible = true;
    this.draw();
  }

  // Input.

  listen() {
    addEventListener('resize', () => this.resize());
    document.addEventListener('keydown', (event) => this.press(event));
    const click = (id, action) => byId(id).addEventListener('click', action);
    click('menu', () => this.toggleMenu());
    click('reset', () => this.reset());
    click('from-top', () => this.fromTop());
    click('theme', () => this.toggleTheme());
    click('help-button', () => byId('help').showModal());
    click('all-classes', () => this.showAllClasses(true));
    click('no-classes', () => this.showAllClasses(false));
    click('uncut', () => this.uncut());
    click('voxel-close', () => this.closeVoxel());
    byId('wall').addEventListener('change', () => {
      if (byId('wall').checked) this.placeWall();
      this.cut();
    });
    for (const id of ['wall-place', 'wall-angle']) byId(id).addEventListener('input', () => this.cut());
  }

  toggleMenu() {
    document.body.classList.toggle('closed');
    this.resize();
  }
  toggleTheme() {
    this.setTheme(!document.documentElement.classList.contains('dark'));
  }
  fromTop() {
    this.orbit.frame(this.usual, -Math.PI / 2, kHighest);
  }

  press(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || byId('help').open) return;
    const {orbit, canvas} = this, step = 40, move = (dx, dy) => event.shiftKey ? orbit.pan(dx, dy) : orbit.turn(dx, dy);
    const lift = (layers) => {
      byId('top').value = String(Number(byId('top').value) + layers);
      this.cut();
    };
    const click = (id) => {
      if (byId(id)) byId(id).click();
    };
    // Keys that controls use as well belong to the view only while no control has the focus.
    const ofView = {
      ArrowLeft: () => move(step, 0), ArrowRight: () => move(-step, 0), ArrowUp: () => move(0, step), ArrowDown: () => move(0, -step),
      PageUp: () => lift(1), PageDown: () => lift(-1),
      Enter: () => this.pickAt((canvas.clientWidth + orbit.insets.left) / 2, (canvas.clientHeight - orbit.insets.bottom) / 2),
    };
    const ofPage = {
      '+': () => orbit.zoom(0.8), '=': () => orbit.zoom(0.8), '-': () => orbit.zoom(1.25), h: () => byId('help').showModal(),
      '?': () => byId('help').showModal(), m: () => this.toggleMenu(), r: () => this.reset(), t: () => this.fromTop(),
      l: () => this.toggleTheme(), f: () => click('show-free'), a: () => this.uncut(), Escape: () => this.closeVoxel(),
    };
    kModes.forEach((mode, n) => { ofPage[String(n + 1)] = () => click(`mode-${mode}`); });
    const in_view = event.target === canvas || event.target === document.body;
    const action = (in_view && ofView[event.key]) || ofPage[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }
}

let viewer;  // for the browser's console
async function start() {
  const begin = performance.now();
  try {
    const map = await decodeMap(progressOn(byId('loading-bar')));
    byId('loading-text').textContent = 'Building the view …';
    const decoded = performance.now();
    viewer = new Viewer(map);
    await viewer.open();
    viewer.drawNow();
    viewer.times = {decode: decoded - begin, build: performance.now() - decoded};
    byId('loading').hidden = true;
    document.documentElement.dataset.ready = 'yes';
  } catch (error) {
    byId('loading').classList.add('failed');
    byId('loading-text').textContent = `The map cannot be shown: ${error.message}.`;
    document.documentElement.dataset.ready = 'failed';
    throw error;
  }
}
start();
