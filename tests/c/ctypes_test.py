"""Tests of libhpsdf.so through Python's ctypes: usage: ctypes_test.py LIBRARY. Exit status 77, for a skipped test, without
NumPy."""

import ctypes
import sys
import threading
import unittest

try:
    import numpy
except ImportError as error:
    print(f"skipped: python3-numpy is not installed ({error})")
    sys.exit(77)

LIBRARY = sys.argv.pop(1)
OK, CANCELLED, ARGUMENT, CALLBACK = 0, 7, 8, 9
FUNCTION = ctypes.CFUNCTYPE(
    ctypes.c_int, ctypes.c_void_p, ctypes.POINTER(ctypes.c_double), ctypes.c_size_t, ctypes.POINTER(ctypes.c_double)
)
REPORT = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_double)
IS_CANCELLED = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p)
BOX = numpy.array([-1.2, -1.2, -1.2, 1.2, 1.2, 1.2])


class Progress(ctypes.Structure):
    _fields_ = [("user", ctypes.c_void_p), ("report", REPORT), ("cancelled", IS_CANCELLED)]


def doubles(array):
    assert array is None or (array.dtype == numpy.float64 and array.flags.c_contiguous)
    return None if array is None else array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def indices(array):
    assert array.dtype == numpy.uint32 and array.flags.c_contiguous
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_uint32))


def loaded_library():
    """Returns the library with the types of the functions that are called with other arguments than pointers."""
    library = ctypes.CDLL(LIBRARY)
    pointer, size, double, number = ctypes.c_void_p, ctypes.c_size_t, ctypes.POINTER(ctypes.c_double), ctypes.c_int
    for name, result, arguments in [
        ("version", ctypes.c_char_p, []),
        ("last_error", ctypes.c_char_p, []),
        ("mesh_new", number, [double, size, ctypes.POINTER(ctypes.c_uint32), size, pointer]),
        ("mesh_load", number, [ctypes.c_char_p, pointer, pointer]),
        ("mesh_free", None, [pointer]),
        ("distance_new", number, [pointer, number, ctypes.c_double, number, pointer, pointer]),
        ("distance_values", number, [pointer, double, size, double]),
        ("distance_closest", number, [pointer, double, size, double, double, ctypes.POINTER(ctypes.c_uint32), double]),
        ("distance_free", None, [pointer]),
        ("options_new", number, [pointer]),
        ("options_set", number, [pointer, ctypes.c_char_p, ctypes.c_char_p]),
        ("options_free", None, [pointer]),
        ("build_mesh", number, [pointer, double, pointer, pointer, pointer]),
        ("build_function", number, [FUNCTION, pointer, double, pointer, pointer, pointer]),
        ("field_values", number, [pointer, double, size, double]),
        ("field_gradients", number, [pointer, double, size, double, double]),
        ("field_free", None, [pointer]),
    ]:
        function = getattr(library, "hpsdf_" + name)
        function.restype, function.argtypes = result, arguments
    return library


def distance_to_sphere(points):
    return numpy.linalg.norm(points, axis=1) - 1


@FUNCTION
def sphere(user, points, count, distances):
    given = numpy.ctypeslib.as_array(points, (count, 3))
    numpy.ctypeslib.as_array(distances, (count,))[:] = distance_to_sphere(given)
    return 0


class CtypesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.library = loaded_library()
        cls.points = numpy.random.default_rng(1).uniform(-1.2, 1.2, (2000, 3))

    def made(self, name, *arguments):
        """Returns the object that a function makes, which is freed at the end of the test."""
        handle = ctypes.c_void_p()
        status = getattr(self.library, "hpsdf_" + name)(*arguments, ctypes.byref(handle))
        self.assertEqual(status, OK, self.library.hpsdf_last_error())
        free = getattr(self.library, f"hpsdf_{'field' if name.startswith('build') else name.split('_')[0]}_free")
        self.addCleanup(free, handle)
        return handle

    def options(self, **settings):
        options = self.made("options_new")
        for name, value in settings.items():
            status = self.library.hpsdf_options_set(options, name.replace("_", "-").encode(), value.encode())
            self.assertEqual(status, OK, self.library.hpsdf_last_error())
        return options

    def values(self, field, points):
        values = numpy.empty(len(points))
        self.assertEqual(self.library.hpsdf_field_values(field, doubles(points), len(points), doubles(values)), OK)
        return values

    def test_version(self):
        self.assertRegex(self.library.hpsdf_version().decode(), r"^\d+\.\d+\.\d+$")

    def test_distances_to_a_tetrahedron(self):
        vertices = numpy.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
        triangles = numpy.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], dtype=numpy.uint32)
        mesh = self.made("mesh_new", doubles(vertices), 4, indices(triangles), 4)
        distance = self.made("distance_new", mesh, 0, 0, 0, None)
        points = numpy.array([[0.1, 0.2, 0.05], [0.25, 0.25, -3], [1, 1, 1.0]])
        distances, closest, barycentric = numpy.empty(3), numpy.empty((3, 3)), numpy.empty((3, 3))
        found = numpy.empty(3, dtype=numpy.uint32)
        status = self.library.hpsdf_distance_closest(
            distance, doubles(points), 3, doubles(distances), doubles(closest), indices(found), doubles(barycentric)
        )
        self.assertEqual(status, OK)
        numpy.testing.assert_allclose(distances, [-0.05, 3, 2 / numpy.sqrt(3)], rtol=1e-14)
        numpy.testing.assert_allclose(closest[1:], [[0.25, 0.25, 0], [1 / 3] * 3], atol=1e-15)
        numpy.testing.assert_array_equal(found, [0, 0, 3])
        corners = numpy.einsum("ij,ijk->ik", barycentric, vertices[triangles[found]])
        numpy.testing.assert_allclose(corners, closest, atol=1e-15)

    def test_fields_of_functions(self):
        field = self.made("build_function", sphere, None, doubles(BOX), self.options(target_error="1e-8"), None)
        near = self.points[abs(distance_to_sphere(self.points)) < 0.5]
        values, gradients = numpy.empty(len(near)), numpy.empty((len(near), 3))
        status = self.library.hpsdf_field_gradients(field, doubles(near), len(near), doubles(values), doubles(gradients))
        self.assertEqual(status, OK)
        numpy.testing.assert_allclose(values, distance_to_sphere(near), atol=2e-3)
        numpy.testing.assert_allclose(gradients, near / numpy.linalg.norm(near, axis=1)[:, None], atol=0.05)
        numpy.testing.assert_array_equal(self.values(field, near), values)

    def test_threads_query_one_field(self):
        mesh = self.made("mesh_load", b"builtin:torus", None)
        field = self.made("build_mesh", mesh, None, self.options(target_error="1e-5"), None)
        expected = self.values(field, self.points)
        results = [None] * 4

        def query(number):
            results[number] = [self.values(field, self.points) for _ in range(20)]

        threads = [threading.Thread(target=query, args=(number,)) for number in range(len(results))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for result in results:
            for values in result:
                numpy.testing.assert_array_equal(values, expected)

    def test_errors(self):
        field = ctypes.c_void_p()

        @FUNCTION
        def broken(user, points, count, distances):
            return 5

        status = self.library.hpsdf_build_function(broken, None, doubles(BOX), None, None, ctypes.byref(field))
        self.assertEqual((status, field.value), (CALLBACK, None))
        self.assertEqual(self.library.hpsdf_last_error(), b"the function of the distance has returned 5")
        self.assertEqual(self.library.hpsdf_field_values(None, None, 0, None), ARGUMENT)
        messages = []
        thread = threading.Thread(target=lambda: messages.append(self.library.hpsdf_last_error()))
        thread.start()
        thread.join()
        self.assertEqual(messages, [b""])

    def test_progress_and_cancellation(self):
        reports = []
        report = REPORT(lambda user, task, fraction: reports.append((task.decode(), fraction)))
        cancelled = IS_CANCELLED(lambda user: len(reports) > 1)
        progress = Progress(None, report, cancelled)
        field = ctypes.c_void_p()
        status = self.library.hpsdf_build_function(
            sphere, None, doubles(BOX), self.options(target_error="1e-8"), ctypes.byref(progress), ctypes.byref(field)
        )
        self.assertEqual((status, self.library.hpsdf_last_error()), (CANCELLED, b"cancelled"))
        self.assertTrue(all(task and 0 <= fraction <= 1 for task, fraction in reports))


if __name__ == "__main__":
    unittest.main()
