"""Bags as drives: their clouds and tf are written once as a sequence in SemanticKITTI's layout, which is then mapped like any
other. Needs rosbag and tf2_ros of ROS, but no running ROS."""
import json
import os
import pathlib
import warnings

import numpy

from bki_mapping.city.description import Bag, CityError

NUMBERS = {1: 'i1', 2: 'u1', 3: 'i2', 4: 'u2', 5: 'i4', 6: 'u4', 7: 'f4', 8: 'f8'}  # of sensor_msgs/PointField


def _frame_name(text):
    """The name of a frame without one leading slash, as tf2 requires it."""
    return text[1:] if text.startswith('/') else text


def extract(bag: Bag, folder):
    """Writes the sequence into a folder. Clouds without a transform at their time are left out. Returns the number of clouds
    written and of those left out. Raises CityError about the bag, ImportError without ROS."""
    import rosbag
    import rospy
    import tf2_ros
    folder = pathlib.Path(folder)
    for name in ('velodyne', 'labels'):
        (folder / name).mkdir(parents=True)
    poses, times, first, missing, reason = [], [], None, 0, ''
    try:
        with warnings.catch_warnings(), rosbag.Bag(str(bag.path)) as opened:
            warnings.simplefilter('ignore')  # tf2 warns that a bag has classes of its own for the parts of transforms
            topics = opened.get_type_and_topic_info().topics
            clouds = sorted(name for name, info in topics.items() if info.msg_type == 'sensor_msgs/PointCloud2')
            if bag.cloud_topic not in clouds:
                raise CityError(f'{bag.path} has no clouds at {bag.cloud_topic}; it has clouds at: '
                                + (', '.join(clouds) or 'no topic'))
            frames = tf2_ros.BufferCore(rospy.Duration(10 ** 9))
            for topic, message, _ in opened.read_messages(['/tf', '/tf_static']):
                for each in message.transforms:
                    (frames.set_transform_static if topic == '/tf_static' else frames.set_transform)(each, 'bag')
            for _, cloud, _ in opened.read_messages([bag.cloud_topic]):
                try:
                    found = frames.lookup_transform_core(_frame_name(bag.frame), _frame_name(cloud.header.frame_id),
                                                         cloud.header.stamp).transform
                except tf2_ros.TransformException as error:
                    missing, reason = missing + 1, reason or ' '.join(str(error).split())
                    continue
                points, labels = read_cloud(cloud, bag)
                stamp = cloud.header.stamp.to_nsec()
                first = stamp if first is None else first
                if stamp < first:
                    raise CityError(f'{bag.path} has a cloud that is older than the first one; record it in the order of '
                                    'its stamps')
                number = f'{len(poses):06d}'
                points.tofile(str(folder / 'velodyne' / (number + '.bin')))
                labels.tofile(str(folder / 'labels' / (number + '.label')))
                poses.append(' '.join(map(repr, matrix_of(found))))
                times.append(f'{(stamp - first) // 10 ** 9}.{(stamp - first) % 10 ** 9:09d}')
    except rosbag.ROSBagUnindexedException:
        raise CityError(f'{bag.path} has no index because its recording was interrupted; run: rosbag reindex '
                        f"'{bag.path}'") from None
    except rosbag.ROSBagException as error:
        raise CityError(f'{bag.path} cannot be read: {" ".join(str(error).split())}') from None
    except OSError as error:
        if error.filename != str(bag.path):
            raise
        raise CityError(f'{bag.path} cannot be read: {error.strerror}') from None
    except (CityError, MemoryError):
        raise
    except Exception as error:  # rosbag lets many kinds through when bytes are wrong
        raise CityError(f'{bag.path} cannot be read: {type(error).__name__}: {" ".join(str(error).split())}') from None
    if not poses:
        raise CityError(f"{bag.path}: no cloud of {bag.cloud_topic} has a transform to '{bag.frame}' "
                        f"({reason or 'there is no cloud'}); record tf with the clouds, or give another frame")
    (folder / 'poses.txt').write_text('\n'.join(poses) + '\n')
    (folder / 'times.txt').write_text('\n'.join(times) + '\n')
    (folder / 'calib.txt').write_text('Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n')
    (folder / 'bag.json').write_text(json.dumps({'bag': str(bag.path), 'clouds': len(poses), 'without_pose': missing}) + '\n')
    stamp = os.stat(bag.path).st_mtime_ns  # so that a sequence that is written again makes the same pieces
    for path in folder.rglob('*'):
        if path.is_file():
            os.utime(path, ns=(stamp, stamp))
            with open(path, 'rb') as file:
                os.fsync(file.fileno())  # the name of the folder says that all of it is there
    return len(poses), missing


def read_cloud(cloud, bag: Bag):
    """The points of a cloud with their remission, (N, 4) as float32, and their labels as uint32."""
    fields = {field.name: field for field in cloud.fields}
    wanted = ['x', 'y', 'z'] + ([bag.label_field] if bag.labelled else []) + (['intensity'] if 'intensity' in fields else [])
    for name in wanted:
        if name not in fields:
            raise CityError(f"{bag.path}: the clouds of {bag.cloud_topic} have no field '{name}', but "
                            + ', '.join(sorted(fields))
                            + ('; give label_field, or labelled: false' if name == bag.label_field else ''))
        if fields[name].datatype not in NUMBERS or fields[name].count > 1:
            raise CityError(f"{bag.path}: the field '{name}' of {bag.cloud_topic} is no number")
    order = '>' if cloud.is_bigendian else '<'
    kind = numpy.dtype({'names': wanted, 'formats': [order + NUMBERS[fields[name].datatype] for name in wanted],
                        'offsets': [fields[name].offset for name in wanted], 'itemsize': cloud.point_step})
    if cloud.row_step < cloud.width * cloud.point_step or len(cloud.data) < cloud.height * cloud.row_step:
        raise CityError(f'{bag.path}: a cloud of {bag.cloud_topic} is shorter than its width and height say')
    rows = numpy.frombuffer(cloud.data, numpy.uint8, cloud.height * cloud.row_step).reshape(cloud.height, cloud.row_step)
    values = numpy.ascontiguousarray(rows[:, :cloud.width * cloud.point_step]).reshape(-1).view(kind)
    points = numpy.zeros((len(values), 4), '<f4')
    for column, name in enumerate(['x', 'y', 'z', 'intensity']):
        if name in wanted:
            points[:, column] = values[name]
    return points, labels_of(values[bag.label_field]) if bag.labelled else numpy.zeros(len(values), '<u4')


def labels_of(values):
    """Labels as the node reads them: all 32 bits, of negative numbers in two's complement; -1 for what is no label, and for what
    single precision may have rounded to the label of another class."""
    values_read = values.astype(float)
    numbers = numpy.trunc(values_read)
    with numpy.errstate(invalid='ignore'):
        numbers += numpy.copysign(numpy.abs(values_read - numbers) >= 0.5, values_read)  # halves away from zero
    is_single = values.dtype.kind == 'f' and values.dtype.itemsize == 4
    least, greatest = (-2.0**24, 2.0**24) if is_single else (-2.0**31, 2.0**32 - 1)
    return numpy.where((numbers >= least) & (numbers <= greatest), numbers, -1).astype(numpy.int64).astype('<u4')


def matrix_of(transform):
    """The rows of a transform, 3 x 4, as 12 numbers."""
    q, t = transform.rotation, transform.translation
    x, y, z, w = q.x, q.y, q.z, q.w
    return [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), t.x,
            2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), t.y,
            2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), t.z]
