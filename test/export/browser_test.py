#!/usr/bin/env python3
"""An exported page in headless Chromium, from the disk: what is drawn, picked and read is what the map says."""
import json
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import time
import unittest

try:
    from selenium import webdriver
except ImportError:
    webdriver = None
CHROMIUM, DRIVER = shutil.which('chromium'), shutil.which('chromedriver')
if webdriver is None or CHROMIUM is None or DRIVER is None:
    print('SKIPPED: needs the packages of scripts/dependencies.browser.txt', file=sys.stderr)
    sys.exit(77)
if not os.path.exists('/usr/share/javascript/three/three.min.js'):
    print('SKIPPED: needs libjs-three', file=sys.stderr)
    sys.exit(77)

BIN = os.environ['BKI_MAPPING_BIN']
HOSTILE = '</script><script>alert(1)'
SWITCHES = ('--headless', '--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-quic', '--no-first-run',
            '--disable-background-networking', '--disable-component-update', '--disable-sync', '--disable-dev-shm-usage')
CLASSES = """name: hostile
classes:
  - {{id: 0, name: unlabelled, color: [0, 0, 0], raw: any, flags: [unlabelled]}}
  - {{id: 3, name: car, color: [100, 150, 245], raw: [10, 252], flags: [dynamic]}}
  - {{id: 9, name: "{}", color: [255, 0, 255], raw: [40, 60], flags: [ground]}}
  - {{id: 253, name: building, color: [255, 200, 0], raw: [50]}}
  - {{id: 17, name: terrain, color: [150, 240, 80], raw: [72, 48], flags: [ground]}}
"""
PROPERTIES = ('x', 'y', 'z', 'red', 'green', 'blue', 'label', 'state', 'probability', 'occupancy', 'class_probability', 'variance',
              'entropy', 'evidence')


def call(program, *arguments):
    done = subprocess.run([os.path.join(BIN, program), *arguments], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr


def vertices(path):
    """The voxels of a PLY file, as dictionaries."""
    with open(path, 'rb') as file:
        data = file.read()
    begin = data.index(b'end_header\n') + len(b'end_header\n')
    return [dict(zip(PROPERTIES, values)) for values in struct.iter_unpack('<fffBBBHBffffff', data[begin:])]


class Browser(unittest.TestCase):
    FAR = (499200, 3998400, 38.4)  # a place in UTM coordinates [m], a whole number of tiles away, so that these are the same

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp()
        drive, table, bkm = cls.path('drive'), cls.path('classes.yaml'), cls.path('map.bkm')
        with open(table, 'w') as file:
            file.write(CLASSES.format(HOSTILE))
        call('simulate_drive', '--output', drive, '--scans', '4', '--beams', '32', '--columns', '600')
        call('map_sequence', '--sequence', drive, '--classes', table, '--output', bkm, '--drive', HOSTILE)
        call('export_map', bkm, '--html', cls.path('map.html'), '--trajectory', drive)
        call('export_map', bkm, '--output', cls.path('map.ply'), '--include', 'occupied,free')
        call('merge_maps', bkm, '--transform', f'{bkm}={",".join(map(str, cls.FAR))},0', '--output', cls.path('far.bkm'))
        call('export_map', cls.path('far.bkm'), '--html', cls.path('far.html'))
        cls.voxels = vertices(cls.path('map.ply'))
        options = webdriver.ChromeOptions()
        options.binary_location = CHROMIUM
        for switch in (*SWITCHES, '--user-data-dir=' + cls.path('profile'), '--window-size=900,700'):
            options.add_argument(switch)
        options.set_capability('goog:loggingPrefs', {'browser': 'ALL'})
        cls.browser = webdriver.Chrome(options=options, service=webdriver.chrome.service.Service(DRIVER))
        cls.browser.set_script_timeout(120)

    @classmethod
    def tearDownClass(cls):
        cls.browser.quit()
        shutil.rmtree(cls.folder)

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder, name)

    def setUp(self):
        self.open_page()

    def open_page(self, width=900, height=700, mobile=False, before='', name='map.html'):
        self.command('Emulation.setDeviceMetricsOverride', width=width, height=height, deviceScaleFactor=1, mobile=mobile)
        self.command('Emulation.setTouchEmulationEnabled', enabled=mobile)
        script = self.command('Page.addScriptToEvaluateOnNewDocument', source=before)['identifier']
        self.browser.get_log('browser')  # forgets those of the page before
        self.browser.get('file://' + self.path(name))
        self.command('Page.removeScriptToEvaluateOnNewDocument', identifier=script)
        end = time.monotonic() + 120
        while self.js('return document.documentElement.dataset.ready') is None:
            self.assertLess(time.monotonic(), end, 'the page does not become ready')
            time.sleep(0.05)
        self.assertEqual(self.js('return document.documentElement.dataset.ready'), 'yes', self.text('loading-text'))

    def command(self, name, **parameters):
        return self.browser.execute_cdp_cmd(name, parameters)

    def js(self, script, *arguments):
        return self.browser.execute_script(script, *arguments)

    def wait(self, promise):
        """The value of a promise, given as an expression."""
        found = self.browser.execute_async_script(
            f'const done = arguments[0]; ({promise}).then((value) => done([value]), (error) => done(String(error)))')
        self.assertIsInstance(found, list, found)
        return found[0]

    def wait_for_voxel(self):
        """Waits until the page says what a voxel holds, for which it reads the evidence of a tile. Before, it must show none."""
        end = time.monotonic() + 60
        while self.hidden('voxel'):
            self.assertLess(time.monotonic(), end, 'no voxel is shown')
            time.sleep(0.02)

    def text(self, name):
        return self.js('return document.getElementById(arguments[0]).innerText', name)

    def hidden(self, name):
        return self.js('return document.getElementById(arguments[0]).hidden', name)

    def click(self, name):
        self.browser.find_element('id', name).click()

    def key(self, key, code=0, modifiers=0):
        for kind in ('rawKeyDown', 'keyUp'):
            self.command('Input.dispatchKeyEvent', type=kind, key=key, windowsVirtualKeyCode=code, modifiers=modifiers)

    def slide(self, name, value):
        self.js('const input = document.getElementById(arguments[0]); input.value = arguments[1];'
                'input.dispatchEvent(new Event("input"))', name, value)

    def camera(self):
        return self.js('const o = viewer.orbit; return [o.azimuth, o.elevation, o.distance, ...o.target.toArray()]')

    def disagreements(self):
        """Pixels where the picture has a voxel and picking finds none, or the other way round. Pixels at an edge do not count.

        @return (disagreements, pixels with a voxel, pixels without)."""
        return self.js('''
          viewer.drawNow();
          const gl = viewer.renderer.getContext(), w = gl.drawingBufferWidth, h = gl.drawingBufferHeight;
          const pixels = new Uint8Array(4 * w * h);
          gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
          const sky = pixels.slice(0, 3), isSky = (x, y) => [0, 1, 2].every((c) => pixels[4 * (x + w * y) + c] === sky[c]);
          let wrong = 0, voxels = 0, none = 0;
          for (let y = 3; y < h - 3; y += 5) {
            for (let x = 3; x < w - 3; x += 5) {
              const empty = isSky(x, y);
              let same = true;
              for (let dy = -2; dy <= 2; ++dy) for (let dx = -2; dx <= 2; ++dx) same = same && isSky(x + dx, y + dy) === empty;
              if (!same) continue;
              const found = viewer.voxels.pick(viewer.orbit.ray(x + 0.5, h - y - 0.5), viewer.orbit.camera);
              if (!found !== empty) ++wrong;
              if (empty) ++none; else ++voxels;
            }
          }
          return [wrong, voxels, none]''')

    def assert_drawn_as_picked(self, least=300, wrong_in=1000):
        wrong, voxels, none = self.disagreements()
        self.assertGreater(voxels, least)
        self.assertGreater(none, 500)
        self.assertLessEqual(wrong, (voxels + none) // wrong_in, 'what is drawn is what can be picked')
        return voxels

    def test_opens_from_the_disk_and_loads_nothing_else(self):
        self.assertEqual(self.browser.title, 'map')
        self.assertEqual(self.js('return performance.getEntriesByType("resource").length'), 0)
        self.assertEqual([entry for entry in self.browser.get_log('browser') if entry['level'] == 'SEVERE'], [])
        occupied = sum(voxel['state'] == 2 for voxel in self.voxels)
        self.assertIn(f'{occupied:,} occupied', self.text('summary'))

    def test_text_of_the_map_stays_text(self):
        self.assertIn(HOSTILE, self.text('classes'))
        self.assertEqual(self.js('return document.scripts.length'),
                         self.js('return 8 + document.querySelectorAll("script.evidence").length'), 'none was added')
        road = next(voxel for voxel in self.voxels if voxel['label'] == 9)
        self.show(road)
        self.assertEqual(self.text('voxel-title'), HOSTILE)
        facts = self.text('voxel-facts')
        self.assertEqual(facts.count(HOSTILE), 2, 'the class and the drive: ' + facts)

    @staticmethod
    def index_of(voxel):
        return [int(voxel[axis] // 0.3) for axis in 'xyz']

    def show(self, voxel):
        self.wait(f'viewer.showVoxel({", ".join(map(str, self.index_of(voxel)))})')

    def test_says_of_voxels_what_the_map_says(self):
        step = len(self.voxels) // 400
        sample = self.voxels[::step]
        self.assertGreater(sum(voxel['state'] == 2 for voxel in sample), 30)
        indices = [self.index_of(voxel) for voxel in sample]
        found = self.wait(f'Promise.all({json.dumps(indices)}.reduce((all, i) => [...all, all.length ? '
                          'all[all.length - 1].then(() => describeVoxel(viewer.map, ...i)) : describeVoxel(viewer.map, ...i)], []))')
        self.assertEqual(len(found), len(sample))
        for voxel, said in zip(sample, found):
            self.assertEqual((said['state'], said['label']), (voxel['state'], voxel['label']), voxel)
            for axis in range(3):
                self.assertAlmostEqual(said['centre'][axis], voxel['xyz'[axis]], places=3)
            for name, error in (('occupancy', 0.0021), ('variance', 1e-6)):
                self.assertAlmostEqual(said[name], voxel[name], delta=error, msg=voxel)
            if voxel['state'] == 2:
                self.assertAlmostEqual(said['class_probability'], voxel['class_probability'], delta=0.0021)
            self.assertAlmostEqual(said['p'], voxel['probability'], delta=1e-6)
            self.assertAlmostEqual(said['evidence'], voxel['evidence'], delta=1e-6 * (1 + voxel['evidence']))
            self.assertAlmostEqual(sum(entry['p'] for entry in said['probabilities']), 1.0)
            self.assertEqual(len(said['probabilities']), 6)

    def test_a_click_reads_the_voxel_under_it(self):
        self.browser.find_element('id', 'from-top').click()
        x, y = self.js('return [(innerWidth + viewer.orbit.insets.left) / 2, innerHeight / 2]')
        for kind in ('mousePressed', 'mouseReleased'):
            self.command('Input.dispatchMouseEvent', type=kind, x=x, y=y, button='left', clickCount=1)
        self.wait_for_voxel()
        facts = self.text('voxel-facts')
        centre = [float(number) for number in re.search(r'Centre\s+(\S+), (\S+), (\S+) m', facts).groups()]
        column = [voxel for voxel in self.voxels if voxel['state'] == 2 and abs(voxel['x'] - centre[0]) < 0.01 and
                  abs(voxel['y'] - centre[1]) < 0.01]
        highest = max(column, key=lambda voxel: voxel['z'])
        self.assertAlmostEqual(centre[2], highest['z'], places=2, msg='seen from above')
        self.assertIn('State\noccupied', facts)
        self.assertIn(f"(id {highest['label']})", facts)
        self.assertIn(f"Occupancy\n{round(255 * highest['occupancy']) / 255:.2f}", facts)
        shown = self.text('voxel-classes')
        self.assertIn(f"{highest['probability']:.3f}", shown)
        self.key('Escape', 27)
        self.assertTrue(self.hidden('voxel'))

    def test_the_last_voxel_asked_for_is_shown(self):
        first, second = self.index_of(self.voxels[0]), self.index_of(self.voxels[-1])
        # Each first reading ends when it is released.
        self.js('const read = describeVoxel; window.hold = () => { let held; describeVoxel = async (...asked) => { const first = !held;'
                'if (first) held = new Promise((release) => { window.release = release; }); const found = await read(...asked);'
                'if (first) await held; return found; }; }')
        self.js('hold(); window.first = viewer.showVoxel(...arguments[0])', first)
        self.wait(f'viewer.showVoxel({", ".join(map(str, second))})')
        shown = self.text('voxel-facts')
        self.assertIn(', '.join(map(str, second)), shown)
        self.wait('(window.release(), window.first)')
        self.assertEqual(self.text('voxel-facts'), shown, 'the one that was asked for last')
        self.js('hold(); window.first = viewer.showVoxel(...arguments[0])', first)
        self.key('Escape', 27)
        self.wait('(window.release(), window.first)')
        self.assertTrue(self.hidden('voxel'), 'it was closed')
        self.assertFalse(self.js('return viewer.highlight.visible'))

    def test_what_is_drawn_is_what_is_there(self):
        self.js('viewer.trajectories.visible = false')
        all_of_it = self.assert_drawn_as_picked()
        self.click('class-9')
        without_road = self.assert_drawn_as_picked()
        self.assertLess(without_road, all_of_it)
        self.click('no-classes')
        self.assertEqual(self.disagreements()[:2], [0, 0])
        self.click('all-classes')
        self.assertEqual(self.assert_drawn_as_picked(), all_of_it)
        self.slide('top', -3)
        self.assertLess(self.assert_drawn_as_picked(), all_of_it)
        self.click('wall')
        self.assert_drawn_as_picked(100)
        self.wait('viewer.showState(1, true)')
        self.assert_drawn_as_picked(100, 200)  # the sizes of points are rounded to pixels
        self.click('uncut')
        self.wait('viewer.showState(1, false)')
        self.js('viewer.orbit.zoom(0.5)')
        self.assert_drawn_as_picked()

    def pixels(self):
        """The picture, as (width, height, colours of all pixels from the bottom left)."""
        width, height, data = self.js('''
          viewer.drawNow();
          const gl = viewer.renderer.getContext(), w = gl.drawingBufferWidth, h = gl.drawingBufferHeight, pixels = new Uint8Array(4 * w * h);
          gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
          return [w, h, Array.from(pixels.filter((byte, i) => i % 4 < 3), (byte) => String.fromCharCode(byte)).join("")]''')
        return width, height, [tuple(map(ord, data[i:i + 3])) for i in range(0, len(data), 3)]

    def trajectory_pixels(self):
        """How many pixels the trajectory changes, and how many of them are of its own colour."""
        self.js('viewer.trajectories.visible = true')
        shown = self.pixels()[2]
        self.js('viewer.trajectories.visible = false')
        hidden = self.pixels()[2]
        changed = [one for one, other in zip(shown, hidden) if one != other]
        return len(changed), changed.count((255, 255, 255))

    def test_the_trajectory_is_seen_from_any_distance(self):
        length = 'const p = viewer.header.trajectories[0].points.map((point) => new THREE.Vector3(...point.map((m, a) => m / ' \
                 'viewer.header.resolution - viewer.voxels.middle[a])).project(viewer.orbit.camera)), a = p[0], b = p[p.length - 1]; ' \
                 'return Math.hypot((a.x - b.x) * innerWidth / 2, (a.y - b.y) * innerHeight / 2)'
        self.click('from-top')
        for zoom in (1.0, 2.0, 2.0, 2.0):
            self.js('viewer.orbit.zoom(arguments[0])', zoom)
            changed, white = self.trajectory_pixels()
            pixels = self.js(length)
            self.assertGreater(white, 3.0 * pixels, 'as wide as it should be')
            self.assertLess(changed, 14.0 * (pixels + 14.0), 'and no wider than it and its edge')
        self.slide('top', 1000)
        self.click('reset')
        self.click('theme')
        self.assertGreater(self.trajectory_pixels()[1], 50, 'in front of the other background')

    def test_the_trajectory_shines_through(self):
        self.js('viewer.orbit.elevation = -0.5; viewer.orbit.update()')  # from below the ground
        changed, white = self.trajectory_pixels()
        self.assertGreater(changed, 50)
        self.assertLess(white, changed / 20, 'only through gaps in the ground')

    def test_the_scale(self):
        lengths = set()
        for zoom in (1.0, 1.5, 1.5, 0.05, 0.2, 20.0):
            self.js('viewer.orbit.zoom(arguments[0]); viewer.drawNow()', zoom)
            number, unit = self.text('scale-text').split(' ')
            metres = float(number) * {'cm': 0.01, 'm': 1.0, 'km': 1000.0}[unit]
            self.assertIn(number.rstrip('0').replace('.', '').lstrip('0'), ('1', '2', '5'), number)
            # The same length at the target, across the view, as the camera sees it.
            pixels = self.js('''
              const {camera, target} = viewer.orbit, right = new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, 0);
              const end = target.clone().addScaledVector(right, arguments[0] / viewer.header.resolution).project(camera);
              return (end.x - target.clone().project(camera).x) * innerWidth / 2''', metres)
            width = self.js('return document.getElementById("scale-bar").getBoundingClientRect().width')
            self.assertAlmostEqual(width, pixels, delta=1.0, msg=self.text('scale-text'))
            self.assertTrue(40 < width <= 110, width)
            lengths.add(metres)
        self.assertGreater(len(lengths), 3)
        self.open_page(390, 844, mobile=True)
        self.assertTrue(self.js('''
          const box = document.getElementById('scale').getBoundingClientRect(), bar = document.getElementById('bar').getBoundingClientRect();
          return box.bottom < bar.top && box.right < innerWidth'''), 'above the buttons of a phone')

    def test_colours(self):
        def ramp(value):
            return self.js('return [...viewer.voxels.ramp.image.data.slice(4 * arguments[0], 4 * arguments[0] + 3)]', value)
        self.assertEqual(ramp(253), [255, 200, 0])
        self.assertEqual(ramp(0), [140, 140, 140], 'unlabelled is grey, although the table says black')
        before = self.picture()
        for mode in ('occupancy', 'class_probability', 'height'):
            self.js('document.getElementById("mode-" + arguments[0]).click()', mode)
            self.assertFalse(self.hidden('ramp'))
            self.assertNotEqual(self.picture(), before, mode)
        self.js('document.getElementById("mode-class").click()')
        self.assertEqual(self.picture(), before)

    def picture(self):
        """A sum over the pixels."""
        return self.js('''
          viewer.drawNow();
          const gl = viewer.renderer.getContext(), w = gl.drawingBufferWidth, h = gl.drawingBufferHeight, pixels = new Uint8Array(4 * w * h);
          gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
          return pixels.reduce((sum, byte, i) => (31 * sum + byte * (i % 4 + 1)) % 1000000007, 0)''')

    def test_keys(self):
        self.js('document.getElementById("view").focus()')
        first = self.camera()
        self.key('ArrowLeft', 37)
        self.assertNotEqual(self.camera()[0], first[0])
        self.key('ArrowUp', 38, modifiers=8)
        self.assertNotEqual(self.camera()[3:], first[3:], 'Shift moves')
        self.key('+', 107)
        self.assertLess(self.camera()[2], first[2])
        self.key('r', 82)
        self.assertEqual(self.camera(), first)
        self.key('3', 51)
        self.assertEqual(self.js('return viewer.mode'), 'class_probability')
        self.key('PageDown', 34)
        self.assertLess(self.js('return viewer.voxels.layers[1]'), 1e8)
        self.key('a', 65)
        self.assertGreater(self.js('return viewer.voxels.layers[1]'), 1e8)
        self.assertTrue(self.hidden('voxel'))
        self.key('Enter', 13)
        self.wait_for_voxel()
        self.key('h', 72)
        self.assertTrue(self.js('return document.getElementById("help").open'))

    def test_every_key_is_in_the_help(self):
        with open(os.path.join(os.environ['BKI_MAPPING_SOURCE_DIR'], 'web', 'viewer.js')) as file:
            press = file.read().split('const ofView')[1].split('const in_view')[0]
        keys = set(re.findall(r"(?:^|[\s{])'?(\S+?)'?: \(\)", press, re.MULTILINE)) - {'='}
        self.assertGreater(len(keys), 14)
        help_text = self.js('return [...document.querySelectorAll("#help td")].map((cell) => cell.textContent).join(" ")')
        written = {'ArrowLeft': 'arrow keys', 'ArrowRight': 'arrow keys', 'ArrowUp': 'arrow keys', 'ArrowDown': 'arrow keys',
                   'PageUp': 'Page Up', 'PageDown': 'Page Down', 'Escape': 'Esc', '-': '−'}
        for key in keys:
            words = written.get(key, key.upper() if len(key) == 1 else key)
            self.assertRegex(help_text, r'(?<![A-Za-z])' + re.escape(words) + r'(?![A-Za-z])', key)

    def touch(self, kind, *points):
        self.command('Input.dispatchTouchEvent', type=kind, touchPoints=[{'x': x, 'y': y, 'id': n} for n, (x, y) in enumerate(points)])

    def test_fingers_on_a_phone(self):
        self.open_page(390, 844, mobile=True)
        self.assertTrue(self.js('return document.body.classList.contains("closed")'), 'the map comes first')
        self.assertLessEqual(self.js('return document.documentElement.scrollWidth'), 390)
        first = self.camera()
        self.touch('touchStart', (150, 400))
        self.touch('touchMove', (200, 400))
        self.touch('touchMove', (250, 400))
        self.touch('touchEnd')
        turned = self.camera()
        self.assertNotEqual(turned[0], first[0])
        self.assertEqual(turned[2:], first[2:])
        self.touch('touchStart', (150, 400), (250, 400))
        self.touch('touchMove', (120, 400), (280, 400))
        self.touch('touchMove', (100, 400), (300, 400))
        self.touch('touchEnd')
        self.assertAlmostEqual(self.camera()[2], turned[2] / 2, delta=0.05 * turned[2], msg='pinched to half the distance')
        self.click('reset')
        self.assertTrue(self.hidden('voxel'), 'no gesture was a tap')
        x, y = 195, 390
        self.touch('touchStart', (x, y))
        self.touch('touchEnd')
        self.wait_for_voxel()
        self.click('menu')
        self.assertLessEqual(self.js('return document.documentElement.scrollWidth'), 390)
        small = self.js('return [...document.querySelectorAll("#bar button")].filter((b) => b.getBoundingClientRect().height < 40).length')
        self.assertEqual(small, 0, 'buttons are large enough for fingers')

    def test_text_is_readable_dark_and_light(self):
        for _ in range(2):
            ratios = self.js('''
              const rgb = (text) => text.match(/[\\d.]+/g).slice(0, 3).map(Number);
              const light = (c) => rgb(c).map((v) => v / 255).map((v) => v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
                  .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
              const ratio = (a, b) => (Math.max(light(a), light(b)) + 0.05) / (Math.min(light(a), light(b)) + 0.05);
              const panel = getComputedStyle(document.getElementById('panel')).backgroundColor;
              return ['summary', 'title', 'classes'].map((id) => ratio(getComputedStyle(document.getElementById(id)).color, panel))''')
            self.assertGreater(min(ratios), 4.5, 'the contrast that WCAG asks for')
            self.click('theme')

    def test_every_control_has_a_name(self):
        unnamed = self.js('''return [...document.querySelectorAll('button, input')].filter((e) =>
          !(e.textContent.trim() || e.getAttribute('aria-label') || (e.labels && e.labels.length && e.labels[0].textContent.trim()))).map((e) => e.id)''')
        self.assertEqual(unnamed, [])

    def test_a_map_far_from_the_origin_looks_the_same(self):
        self.js('viewer.trajectories.visible = false')
        near = self.pixels()[2]
        self.assertIsNone(self.js('return document.getElementById("no-trajectory")'))
        self.open_page(name='far.html')
        self.assertIn('export_map --trajectory', self.text('no-trajectory'))
        far = self.pixels()[2]
        self.assertLess(sum(one != other for one, other in zip(near, far)), 1e-3 * len(near))
        voxel = self.voxels[0]
        centre = [voxel[axis] + shift for axis, shift in zip('xyz', self.FAR)]
        index = [i + round(shift / 0.3) for i, shift in zip(self.index_of(voxel), self.FAR)]
        found = self.wait(f'describeVoxel(viewer.map, {", ".join(map(str, index))})')
        self.assertEqual((found['state'], found['label']), (voxel['state'], voxel['label']))
        for axis in range(3):
            self.assertAlmostEqual(found['centre'][axis], centre[axis], places=4)

    def test_a_browser_without_decompression_stream(self):
        road = next(voxel for voxel in self.voxels if voxel['label'] == 9)
        self.show(road)
        expected, picture = self.text('voxel-facts'), self.picture()
        self.open_page(before='delete window.DecompressionStream')
        self.assertEqual(self.js('return typeof DecompressionStream'), 'undefined')
        self.show(road)
        self.assertEqual(self.text('voxel-facts'), expected)
        self.assertEqual(self.picture(), picture)

    def test_a_browser_without_webgl_says_so(self):
        with self.assertRaises(AssertionError) as failed:
            self.open_page(before='HTMLCanvasElement.prototype.getContext = () => null')
        self.assertIn('has no WebGL 2', str(failed.exception))


if __name__ == '__main__':
    unittest.main()
