#!/usr/bin/env python3
"""Every command of README.md and docs, word for word, in a copy of the source tree, on stand-in data.

Those of the first pages (README.md, docs/install.md, docs/start.md) are for the build of scripts/demo, so they are typed where
nothing else is built; those of other pages are for all targets.
A block of commands is what a user types: what does not end by itself (roslaunch, rviz) goes on in a terminal of its own
until the block's last command has ended. Launch files must map what is played to them.
"""
import http.client
import importlib
import os
import random
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest
import xmlrpc.client

SOURCE = os.environ['BKI_MAPPING_SOURCE_DIR']
DEVEL = os.environ['BKI_MAPPING_DEVEL']
DEMO_TARGETS = os.environ['BKI_MAPPING_DEMO_TARGETS'].split()  # of cmake/demo.cmake
PROGRAM_FOLDER, PACKAGE = 'lib/bki_mapping', 'lib/python3/dist-packages/bki_mapping'
# What targets other than programs make, as beginnings of paths in DEVEL. What programs are linked with is built with them.
MADE_BY = {
    f'{PACKAGE}/msg/': 'bki_mapping_generate_messages_py',
    f'{PACKAGE}/srv/': 'bki_mapping_generate_messages_py',
    f'{PACKAGE}/cfg/': 'bki_mapping_gencfg',
    f'{PACKAGE}/_core': 'bki_mapping_python',
    'lib/libbki_mapping_nodelets': 'bki_mapping_nodelets',
}
FIRST_PAGES = ['README.md', 'docs/install.md', 'docs/start.md']  # for the build of scripts/demo
PAGES = [f'docs/{name}' for name in sorted(os.listdir(f'{SOURCE}/docs')) if name.endswith('.md')]
DOCUMENTS = [*FIRST_PAGES, *(page for page in PAGES if page not in FIRST_PAGES)]
OF_DASK = {'docs/city.md'}  # Debian 11's python3-distributed lacks tornado
TIMEOUT = 60.0  # maximum duration of a command, and of waiting for an event [s]
SCANS = 6

# Commands that are not run, and why.
LEFT_OUT = {
    'catkin build': 'builds a whole workspace, for minutes',
    'catkin_make_isolated --install': 'the same',
    'cmake --build build -j2': 'builds everything',
    **dict.fromkeys(("sudo apt-get install --no-install-recommends $(grep -v '^#' scripts/dependencies.debian.txt)",
                     'mkdir -p ~/catkin_ws/src', 'git clone . ~/catkin_ws/src/bki_mapping', 'cd ~/catkin_ws',
                     'catkin_make -DCMAKE_BUILD_TYPE=Release', 'source devel/setup.bash'), 'the same'),
    'scripts/demo': 'installs packages and builds; continuous integration runs it by itself',
    'scripts/test': 'runs this test; continuous integration runs it by itself',
    'scripts/demo --headless --scans 12': 'the same',
    'scripts/test --fast': 'the same',
    **dict.fromkeys(('scripts/test_on bookworm', 'scripts/test_on trixie', 'CXX=g++-9 scripts/test_on bullseye',
                     'scripts/test_on --arm64 trixie', 'scripts/test_on --package bookworm'),
                    'installs and builds in a chroot, for many minutes'),
    'scripts/package': 'installs packages and builds; `scripts/test_on --package` runs it',
    'sudo apt-get install ./build-package/*.deb': 'the same',
    'scripts/fuzz --seconds 14400 --seed 7': 'builds with sanitizers; scripts/test runs hostile_test',
    'scripts/fuzz --seed 7 --settings two_lidars': 'the same',
    'scripts/fuzz --target map_file --seconds 14400': 'builds with Clang and runs for hours; ctest runs the fixed inputs',
    'scripts/fuzz --target tile_codec --seconds 14400': 'the same',
    'roslaunch bki_mapping mapping.launch body_box:="-0.6 -0.4 -0.5 0.6 0.4 0.3" body_frame:=base_link':
        'needs the frames of a robot, which body_box_rostest has',
    **dict.fromkeys(('cmake -S . -B build-install -DCMAKE_BUILD_TYPE=Release -DBKI_MAPPING_ROS=OFF -DBUILD_TESTING=OFF '
                     '-DCMAKE_INSTALL_PREFIX=$HOME/bki', 'cmake --build build-install -j2 --target install',
                     'cmake -S examples -B build-examples -DCMAKE_PREFIX_PATH=$HOME/bki', 'cmake --build build-examples -j2',
                     'build-examples/map_drive street.bkm', 'build-examples/ask_map street.bkm 4 6.1 2', 'build-examples/change_map',
                     'build-examples/plan_path street.bkm semantic_kitti 4 0 0 12 1 0'),
                    'builds for minutes; scripts/test builds the examples against an installation'),
    **dict.fromkeys(('build-examples/plan_path street.bkm semantic_kitti 2 -5.3 0 48 8 0 > path.csv',
                     'python3 examples/draw_path.py street.bkm path.csv --output path.png'), 'path_test runs them'),
    **dict.fromkeys(('mkdir driven', "BKI_MAPPING_DRIVE=driven build/devel/lib/bki_mapping/navigation_test --gtest_filter='*Traffic*'",
                     'python3 examples/draw_path.py driven/driven.bkm driven/driven.csv --movers driven/movers.csv --output driven.png'),
                    'takes a minute; navigation_test drives'),
    'rosrun tf2_ros static_transform_publisher 500000 4000000 0 0 0 0 utm map': 'needs poses in a frame utm',
    'rosrun octomap_server octomap_server_node ~/street.bt _frame_id:=map': 'not in Debian',
    **dict.fromkeys(('sbatch --ntasks=64 scripts/map_city.sbatch drives/city.yaml --output city',
                     'export DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES=1000',
                     'dask-ssh --hostfile hosts.txt --nworkers 16 --nthreads 1 --remote-python '
                     '"env PYTHONPATH=$PYTHONPATH /usr/bin/python3"',
                     'scripts/map_city drives/city.yaml --output city --scheduler tcp://FIRST_HOST:8786'),
                    'needs a cluster; city_test starts a scheduler and workers'),
    'roslaunch bki_mapping mapping.launch map_file:=~/city/ classes:=semantic_kitti': 'city_rostest starts such a node',
    'PYTHONPATH=lab python3 -m figures.leave_one_out --scratch drives --sequence ~/kitti/sequences/04 --void 30 60':
        'takes long; figures_test measures a small case',
    'scripts/reproduce --scans 300': 'takes long; figures_test draws each figure on small cases',
}
# Slow parts of commands and their replacements. Everything else is run as written.
SHORTER = {
    '--scans 300': '--scans 4',
    'roslaunch bki_mapping demo.launch': f'roslaunch bki_mapping demo.launch scans:={SCANS}',
    '--scans 200': '--scans 4',
    '--scans 1000 --every 10': '--scans 50 --every 10',
    ' --curves curves': '',  # two thousand simulated scans in each mode; tools_test draws curves
}
SHORT_BENCHMARKS = {'BENCHMARK_MIN_TIME': '0.001'}  # environment of Google Benchmark
# First words of commands in a line of text; a single word is only the name of a program.
PROGRAMS = ('benchmark_', 'build/', 'catkin', 'clear_map', 'cmake', 'correct_map', 'ctest', 'dynparam', 'evaluate_map',
            'export_map', 'forget_journal', 'inspect_map', 'lab/', 'map_bag', 'map_sequence', 'merge_maps', 'migrate_map', 'play_sequence', 'query_city',
            'ros', 'rviz', 'scripts/', 'sequence_to_bag', 'simulate_city', 'simulate_drive', 'source')
# Not commands: fragments in a line of text, whose other arguments are up to the reader.
PARTS = {
    'benchmark_sequence --curves', 'dynparam set', 'evaluate_map --errors', 'evaluate_map --label-noise FRACTION',
    'export_map --points FILE', 'map_sequence --config NAME|FILE', 'map_sequence --journal METRES', 'map_sequence --output', 'map_sequence --points FILE.pcd',
    'map_sequence --report', 'map_sequence --report FILE.json', 'merge_maps --keep-drives',
    'map_sequence --poses FILE', 'migrate_map OLD.bkm NEW.bkm', 'rosnode kill', 'rosrun bki_mapping map_city',
    'rosrun bki_mapping map_sequence',
    'scripts/test_on SUITE',
}
GOES_ON = re.compile(r'(\w+=\S+ )*(roscore|roslaunch(?!.* --ros-args)|rosrun pcl_ros|rviz|rostopic echo)\b')
WRONG = re.compile(r'\bERROR\b|FATAL|Traceback|\b[Uu]nknown\b|has died|command not found|No such file', re.MULTILINE)
# rviz with software rendering: a shader for images, which these displays do not use. roscpp: a call to the master that
# failed once and is repeated; what must follow from the call is waited for.
HARMLESS = re.compile(r'rviz/glsl120/indexed_8bit_image|Failed to contact master at \S+\s+Retrying')


def crashed_while_drawing(process):
    """Whether this was rviz, which had started and listened before, with a fault of memory. With the software renderers of
    Mesa it has one now and then, in swrast_dri.so, libLLVM or, later, in the C library."""
    faults = signal.SIGSEGV, signal.SIGABRT
    return 'rviz' in process.command and process.returncode in {code for n in faults for code in (-n, 128 + n)}


def text_of(document):
    with open(os.path.join(SOURCE, document)) as file:
        return file.read()


def without_comment(line):
    return re.sub(r'(^|\s+)# .*', '', line).strip()


def blocks_of(document):
    """Lists of commands: one list per block, and one per command in the text."""
    text = text_of(document)
    fenced = re.findall(r'^```(?:sh|bash|shell|console)\n(.*?)^```$', text, re.MULTILINE | re.DOTALL)
    for block in fenced:
        yield [line.strip() for line in block.splitlines() if without_comment(line)]
    for span in re.findall(r'`([^`\n]+)`', re.sub(r'^```.*?^```$', '', text, flags=re.MULTILINE | re.DOTALL)):
        if ' ' in span and span.startswith(PROGRAMS) and span not in PARTS and ' [' not in span:
            yield [span]


def status_of(launch):
    """The status of the mapper that a launch file starts."""
    space = re.search(r' namespace:=(\S+)', launch)
    return f'/{space[1]}/mapping/status' if space else '/mapping/status'


def free_port():
    """A port below 32768: from there on, Linux gives ports to programs that ask for any, before the master takes one."""
    while True:
        port = random.randint(15000, 32767)
        with socket.socket() as probe:
            try:
                probe.bind(('localhost', port))
            except OSError:
                continue
            return port


def send(process, what):
    """Sends a signal to all processes of a command that still run."""
    try:
        os.killpg(process.pid, what)
    except ProcessLookupError:
        pass


def wait_until(condition, what):
    end = time.monotonic() + TIMEOUT
    while time.monotonic() < end:
        if condition():
            return
        time.sleep(0.05)
    raise AssertionError(f'{what} did not happen within {TIMEOUT} s')


def is_program(path):
    with open(path, 'rb') as file:
        return file.read(4) == b'\x7fELF'


def target_of(path):
    """The target that makes a file of DEVEL; None if configuring makes it, or it comes with what is linked with it."""
    if os.path.dirname(path) == PROGRAM_FOLDER and is_program(f'{DEVEL}/{path}'):
        return os.path.basename(path)
    return next((target for beginning, target in MADE_BY.items() if path.startswith(beginning)), None)


def link_build_of_demo(folder):
    """Makes a folder like DEVEL with what scripts/demo builds, and nothing else."""
    for parent, _, names in os.walk(DEVEL):
        for name in names:
            path = os.path.relpath(os.path.join(parent, name), DEVEL)
            if target_of(path) in (None, *DEMO_TARGETS):
                os.makedirs(os.path.dirname(f'{folder}/{path}'), exist_ok=True)
                os.symlink(f'{DEVEL}/{path}', f'{folder}/{path}')


class Shell:
    """What a user types in the clone's folder, in terminals that share a ROS master."""

    def __init__(self, folder, display):
        self.folder = folder
        self.home = os.path.join(folder, 'home')
        self.clone = os.path.join(folder, 'bki_mapping')
        self.port = free_port()
        self.master = f'http://localhost:{self.port}'
        self.environment = {'HOME': self.home, 'PATH': '/usr/bin:/bin', 'LANG': 'C.UTF-8', 'TERM': 'dumb',
                            'ROS_MASTER_URI': self.master, 'ROS_HOSTNAME': 'localhost', 'DISPLAY': display,
                            'LIBGL_ALWAYS_SOFTWARE': '1', 'GALLIUM_DRIVER': 'softpipe',
                            'SOFTPIPE_DEBUG': 'no_rast,use_llvm',  # nobody looks: half the processor time of a launch
                            'XDG_RUNTIME_DIR': folder,
                            **SHORT_BENCHMARKS}
        self.running = []

    def start(self, command):
        output = tempfile.TemporaryFile('w+', errors='replace')
        lines = f'set -e\nsource build/devel/setup.bash\n{command}'
        process = subprocess.Popen(['bash', '-c', lines], cwd=self.clone, env=self.environment, stdout=output,
                                   stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, start_new_session=True)
        process.command, process.output = command, output
        self.running.append(process)
        return process

    def printed(self, process):
        process.output.seek(0)
        return process.output.read()

    def finish(self, process):
        """Waits for a command that ends by itself; returns its output."""
        try:
            process.wait(TIMEOUT)
        except subprocess.TimeoutExpired:
            printed = self.printed(process)
            raise AssertionError(f'{process.command}\ndid not end within {TIMEOUT} s:\n{printed}') from None
        if process.returncode != 0:
            raise AssertionError(f'{process.command}\nended with {process.returncode}:\n{self.printed(process)}')
        self.running.remove(process)
        with process.output:
            return self.printed(process)

    def run(self, command):
        return self.finish(self.start(command))

    def stop(self):
        """Types Control-C in all terminals, the last one first; returns the output of each command."""
        printed = {}
        for process in reversed(self.running):
            send(process, signal.SIGINT)
            try:
                process.wait(30)
            except subprocess.TimeoutExpired:
                send(process, signal.SIGKILL)
                process.wait()
            with process.output:
                printed[process.command] = self.printed(process)
        self.running = []
        return printed

    def subscribers(self, topic):
        """The subscribers of a topic according to the master; None without a master."""
        try:
            with xmlrpc.client.ServerProxy(self.master) as master:
                code, _, (_, subscribers, _) = master.getSystemState('/commands_test')
        except (OSError, http.client.HTTPException):
            return None
        return dict(subscribers).get(topic, []) if code == 1 else None

    def wait_for_status(self, topic, condition):
        """Waits until a MappingStatus m meets the condition."""
        wait_until(lambda: self.subscribers(topic) is not None, 'a ROS master')
        self.run(f'timeout {TIMEOUT:.0f} rostopic echo -n 1 --filter "{condition}" {topic}')


def can_import_dask():
    try:
        importlib.import_module('distributed')
    except ImportError:
        return False
    return True


class Commands(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp()
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.demo_build = os.path.join(cls.folder, 'demo_build')
        link_build_of_demo(cls.demo_build)
        cls.display = cls.start_display()
        shell = Shell(cls.folder, cls.display)
        cls.copy_source(shell.clone)
        cls.use_build_of(None)
        os.makedirs(os.path.join(shell.home, 'kitti/sequences'))
        shell.run(f'{DEVEL}/lib/bki_mapping/simulate_drive --output ~/kitti/sequences/04 --scans {SCANS} --beams 16 '
                  '--columns 400')
        shell.run(f'{DEVEL}/lib/bki_mapping/sequence_to_bag --sequence ~/kitti/sequences/04 --output drive.bag')
        shell.run(f'{DEVEL}/lib/bki_mapping/map_sequence --sequence ~/kitti/sequences/04 --output map.pcd')

    @classmethod
    def start_display(cls):
        if not shutil.which('Xvfb'):
            raise AssertionError('Xvfb, in which rviz is run, is missing; install it (scripts/dependencies.debian.txt)')
        read, write = os.pipe()
        server = subprocess.Popen(['Xvfb', '-displayfd', str(write), '-screen', '0', '640x480x24'], pass_fds=[write],
                                  stderr=subprocess.DEVNULL)
        cls.addClassCleanup(server.wait)
        cls.addClassCleanup(server.terminate)
        os.close(write)
        with os.fdopen(read) as number:
            return ':' + number.readline().strip()

    @classmethod
    def copy_source(cls, clone):
        """Sets up the files of a clone and, in build/devel, the build of scripts/demo."""
        listed = subprocess.run(['git', '-C', SOURCE, 'ls-files', '-z', '--cached', '--others', '--exclude-standard'],
                                stdout=subprocess.PIPE, text=True, check=False).stdout.split('\0')
        if listed == ['']:  # an archive, not a clone
            listed = [os.path.relpath(os.path.join(folder, name), SOURCE) for folder, _, names in os.walk(SOURCE)
                      for name in names if not os.path.relpath(folder, SOURCE).startswith('build')]
        for name in listed:
            if os.path.isfile(os.path.join(SOURCE, name)):
                os.makedirs(os.path.dirname(os.path.join(clone, name)), exist_ok=True)
                shutil.copy(os.path.join(SOURCE, name), os.path.join(clone, name))
        os.mkdir(os.path.join(clone, 'build'))

    @classmethod
    def use_build_of(cls, document):
        """Puts the build that a document speaks of into the clone; without a document, that of all targets."""
        link = os.path.join(cls.folder, 'bki_mapping/build/devel')
        if os.path.lexists(link):
            os.unlink(link)
        os.symlink(cls.demo_build if document in FIRST_PAGES else DEVEL, link)

    def start_mapper(self, shell):
        """Starts the mapper of README.md if a command needs one in another terminal."""
        shell.start(next(line for block in blocks_of('README.md') for line in block if 'mapping.launch' in line))
        shell.wait_for_status('/mapping/status', 'm.received == 0')

    def type_command(self, shell, command):
        """Types one command; returns its output, or None if it keeps running."""
        for long, short in SHORTER.items():
            command = command.replace(long, short)
        if not GOES_ON.match(command):
            return shell.run(command)
        process = shell.start(f'{command} -p {shell.port}' if command == 'roscore' else command)
        if 'mapping.launch' in command:
            shell.wait_for_status(status_of(command), 'm.received == 0')
        elif command == 'roscore':
            wait_until(lambda: shell.subscribers('/rosout'), 'a ROS master')
        elif 'saved_map.rviz' in command:
            wait_until(lambda: shell.subscribers('/cloud_pcd'), f'{command}: rviz listening to /cloud_pcd')
        elif 'rviz' in command:
            space = re.match(r'ROS_NAMESPACE=(\S+)', command)
            topic = f'/{space[1]}/occupied_cells_vis_array' if space else '/occupied_cells_vis_array'
            wait_until(lambda: shell.subscribers(topic), f'{command}: rviz listening to {topic}')
        elif 'echo' in command:
            wait_until(lambda: '---' in shell.printed(process), f'a message for {command}')
        return ''

    def see_it_map(self, shell, block):
        """Waits until each mapper of a block has mapped all scans: those that the block plays, or otherwise our own."""
        launches = [command for command in block if command.startswith('roslaunch') and GOES_ON.match(command)]
        if not launches:
            return
        if not any(re.search('bag:=|sequence:=|demo.launch', command) for command in launches):
            shell.run('build/devel/lib/bki_mapping/play_sequence --sequence ~/kitti/sequences/04 --rate 0 '
                      'cloud_in:=/velodyne_points')
        for command in launches:
            shell.wait_for_status(status_of(command), f'm.integrated == {SCANS} and m.blocks > 10')
            if 'rviz:=false' not in command and 'mapping.launch' not in command:
                wait_until(lambda: shell.subscribers('/occupied_cells_vis_array'), f'{command}: rviz listening')

    def check_block(self, block):
        shell = Shell(self.folder, self.display)
        printed = {}
        try:
            if any('benchmark_publishing' in command for command in block):
                shell.start(f'roscore -p {shell.port}')
                wait_until(lambda: shell.subscribers('/rosout') is not None, 'a ROS master')
            if any('/mapping/' in command for command in block) and not any('roslaunch' in c for c in block):
                self.start_mapper(shell)
            for command in block:
                printed[command] = self.type_command(shell, command)
            self.see_it_map(shell, block)
        finally:
            ended = [process.command for process in shell.running
                     if process.poll() is not None and not crashed_while_drawing(process)]
            stopped = shell.stop()
            if sys.exc_info()[0]:
                print(*(f'{command}:\n{text}' for command, text in stopped.items()), sep='\n', file=sys.stderr)
        self.assertEqual(ended, [], stopped)
        for command, text in {**printed, **stopped}.items():
            wrong = [line for line in text.splitlines() if WRONG.search(line) and not HARMLESS.search(line)
                     and not line.lstrip().startswith('#')]  # comments of --print-config
            self.assertEqual(wrong, [], f'{command}\n{text}')

    def test_every_command(self):
        seen, count = set(), 0
        for document in DOCUMENTS:
            self.use_build_of(document)
            for block in blocks_of(document):
                seen |= {without_comment(command) for command in block}
                commands = [command for command in block if without_comment(command) not in LEFT_OUT]
                if not commands:
                    continue
                if document in OF_DASK and not can_import_dask():
                    print(f'SKIPPED, for lack of Dask: {commands}', file=sys.stderr)
                    continue
                count += 1
                with self.subTest(document=document, block=commands):
                    self.check_block(commands)
        self.assertGreaterEqual(count, 6)
        self.assertLessEqual(set(LEFT_OUT), seen, 'commands left out that no text has')

    def test_the_first_pages_name_only_programs_that_the_demo_builds(self):
        programs = {name for name in os.listdir(f'{DEVEL}/{PROGRAM_FOLDER}') if target_of(f'{PROGRAM_FOLDER}/{name}')}
        self.assertLess(set(DEMO_TARGETS) & programs, programs, 'other targets are built, too')
        for document in FIRST_PAGES:
            with self.subTest(document=document):
                self.assertLessEqual(set(re.findall(r'\w+', text_of(document))) & programs, set(DEMO_TARGETS))

    def test_python_of_the_first_pages_runs_on_the_build_of_the_demo(self):
        self.use_build_of(FIRST_PAGES[0])
        given = 'import numpy\npose = numpy.eye(4)\npoints = numpy.full((9, 3), 4.0)\nlabels = numpy.full(9, 50)\n'
        blocks = re.findall(r'^```python\n(.*?)^```$', ''.join(map(text_of, FIRST_PAGES)), re.MULTILINE | re.DOTALL)
        self.assertTrue(blocks)
        shell = Shell(self.folder, self.display)
        folder = os.path.join(shell.clone, 'of_first_pages')
        os.mkdir(folder)
        with open(os.path.join(folder, 'blocks.py'), 'w') as file:
            file.write(given + ''.join(blocks))
        shell.run('cd of_first_pages && /usr/bin/python3 blocks.py')
        self.assertIn('street.bkm', os.listdir(folder))

    def test_arguments_of_launch_files_are_explained_and_documented(self):
        rows = dict(re.findall(r'^\| `(\w+\.launch)` \|.*\| (.*) \|$', text_of('docs/ros.md'), re.MULTILINE))
        self.assertEqual(set(rows), set(os.listdir(os.path.join(SOURCE, 'launch'))))
        for launch, row in rows.items():
            arguments = re.findall(r'<arg name="(\w+)" [^>]*doc="[^"]+"/>', text_of(f'launch/{launch}'))
            self.assertEqual(len(arguments), len(re.findall(r'^  <arg ', text_of(f'launch/{launch}'), re.MULTILINE)))
            self.assertEqual(sorted(arguments), sorted(re.findall(r'`(\w+)`', row)), launch)

    def test_replacements_and_parts_are_of_the_text(self):
        texts = ''.join(text_of(document) for document in DOCUMENTS)
        for words in (*SHORTER, *(f'`{part}' for part in PARTS)):
            self.assertIn(words, texts)


if __name__ == '__main__':
    unittest.main()
