/* A program in C that uses libhpsdf.so. It checks distances that are known and every kind of error, and prints values
 * of a torus, which c_interface_test.cpp compares with those of C++. */
#include <hpsdf.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

static int failures = 0;

#define CHECK(condition)                                               \
  do {                                                                 \
    if (!(condition)) {                                                \
      fprintf(stderr, "line %d: %s is false\n", __LINE__, #condition); \
      ++failures;                                                      \
    }                                                                  \
  } while (0)

#define CHECK_STATUS(expected, message, call) check_status(__LINE__, expected, message, call)

/* Checks the status of a call and, if it is an error, the beginning of its message. */
static void check_status(int line, hpsdf_status expected, const char* message, hpsdf_status status) {
  if (status == expected && (status == HPSDF_OK || strncmp(hpsdf_last_error(), message, strlen(message)) == 0)) return;
  fprintf(stderr, "line %d: status %d rather than %d, message '%s' rather than '%s'\n", line, (int)status,
          (int)expected, hpsdf_last_error(), message);
  ++failures;
}

static const double unit_cube[24] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1};
static const uint32_t cube_triangles[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                            2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
static const double box[6] = {-1.2, -1.2, -1.2, 1.2, 1.2, 1.2};

static hpsdf_mesh* new_cube(void) {
  hpsdf_mesh* mesh = NULL;
  CHECK_STATUS(HPSDF_OK, "", hpsdf_mesh_new(unit_cube, 8, cube_triangles, 12, &mesh));
  return mesh;
}

static hpsdf_options* new_options(const char* name, const char* value) {
  hpsdf_options* options = NULL;
  CHECK_STATUS(HPSDF_OK, "", hpsdf_options_new(&options));
  CHECK_STATUS(HPSDF_OK, "", hpsdf_options_set(options, name, value));
  return options;
}

static int sphere(void* user, const double* points, size_t count, double* distances) {
  const double radius = *(const double*)user;
  size_t i;
  for (i = 0; i < count; ++i) {
    const double* p = points + 3 * i;
    distances[i] = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) - radius;
  }
  return 0;
}

static int broken(void* user, const double* points, size_t count, double* distances) {
  (void)user, (void)points, (void)count, (void)distances;
  return 42;
}

static int not_a_number(void* user, const double* points, size_t count, double* distances) {
  (void)user, (void)points;
  while (count > 0) distances[--count] = NAN;
  return 0;
}

static void test_meshes(void) {
  hpsdf_mesh *mesh = new_cube(), *cleaned = NULL, *none = NULL;
  const uint32_t bad[3] = {0, 1, 8};
  CHECK(hpsdf_mesh_vertex_count(mesh) == 8 && hpsdf_mesh_triangle_count(mesh) == 12);
  CHECK(memcmp(hpsdf_mesh_vertices(mesh), unit_cube, sizeof unit_cube) == 0);
  CHECK(memcmp(hpsdf_mesh_triangles(mesh), cube_triangles, sizeof cube_triangles) == 0);
  CHECK_STATUS(HPSDF_OK, "", hpsdf_mesh_cleaned(mesh, &cleaned));
  CHECK(hpsdf_mesh_triangle_count(cleaned) == 12);

  CHECK_STATUS(HPSDF_MESH_ERROR, "triangles: the triangle 0 refers to the vertex 8, but the mesh has 8 vertices",
               hpsdf_mesh_new(unit_cube, 8, bad, 1, &none));
  CHECK(none == NULL);
  CHECK_STATUS(HPSDF_ARGUMENT_ERROR, "vertices: expected a pointer, got NULL",
               hpsdf_mesh_new(NULL, 8, cube_triangles, 12, &none));
  CHECK_STATUS(HPSDF_ARGUMENT_ERROR, "mesh: expected a pointer, got NULL",
               hpsdf_mesh_new(unit_cube, 8, cube_triangles, 12, NULL));
  CHECK_STATUS(HPSDF_LIMIT_ERROR, "vertices: an array of ",
               hpsdf_mesh_new(unit_cube, SIZE_MAX / 8, cube_triangles, 12, &none));
  CHECK_STATUS(HPSDF_LIMIT_ERROR, "a mesh of 12 triangles would take",
               hpsdf_mesh_new(unit_cube, PTRDIFF_MAX / 24, cube_triangles, 12, &none));
  CHECK_STATUS(HPSDF_FILE_ERROR, "no-such.stl: ", hpsdf_mesh_load("no-such.stl", NULL, &none));
  CHECK_STATUS(HPSDF_ARGUMENT_ERROR, "file: ", hpsdf_mesh_load(NULL, NULL, &none));
  CHECK(hpsdf_mesh_vertex_count(NULL) == 0 && hpsdf_mesh_triangle_count(NULL) == 0);
  CHECK(hpsdf_mesh_vertices(NULL) == NULL && hpsdf_mesh_triangles(NULL) == NULL);
  hpsdf_mesh_free(cleaned);
  hpsdf_mesh_free(mesh);
}

static void test_distances(void) {
  const double points[6] = {0.5, 0.5, 0.25, 2, 0.25, 0.5};
  double distances[2], closest[6], barycentric[6];
  uint32_t triangles[2];
  hpsdf_mesh *mesh = new_cube(), *empty = NULL;
  hpsdf_distance *distance = NULL, *none = NULL;
  CHECK_STATUS(HPSDF_OK, "", hpsdf_distance_new(mesh, HPSDF_INSIDE_AUTOMATIC, 0, 0, NULL, &distance));
  CHECK_STATUS(HPSDF_OK, "", hpsdf_distance_values(distance, points, 2, distances));
  CHECK(distances[0] == -0.25 && distances[1] == 1);
  CHECK_STATUS(HPSDF_OK, "", hpsdf_distance_closest(distance, points, 2, distances, closest, triangles, barycentric));
  CHECK(distances[0] == -0.25 && closest[2] == 0 && triangles[0] < 2);
  CHECK(distances[1] == 1 && closest[3] == 1 && closest[4] == 0.25 && closest[5] == 0.5 && triangles[1] >= 10);
  CHECK(fabs(barycentric[3] + barycentric[4] + barycentric[5] - 1) < 1e-15);
  CHECK_STATUS(HPSDF_OK, "", hpsdf_distance_closest(distance, points, 2, NULL, NULL, triangles, NULL));
  CHECK_STATUS(HPSDF_OK, "", hpsdf_distance_values(distance, NULL, 0, NULL));
  CHECK_STATUS(HPSDF_OK, "", hpsdf_distance_closest(distance, NULL, 0, NULL, NULL, NULL, NULL));

  CHECK_STATUS(HPSDF_ARGUMENT_ERROR, "points: ", hpsdf_distance_values(distance, NULL, 1, distances));
  CHECK_STATUS(HPSDF_ARGUMENT_ERROR, "distances: ", hpsdf_distance_values(distance, points, 1, NULL));
  CHECK_STATUS(HPSDF_ARGUMENT_ERROR, "distance: ", hpsdf_distance_values(NULL, points, 1, distances));
  CHECK_STATUS(HPSDF_LIMIT_ERROR, "points: ", hpsdf_distance_values(distance, points, SIZE_MAX / 16, distances));
  CHECK_STATUS(HPSDF_ARGUMENT_ERROR,
               "inside_test: ", hpsdf_distance_new(mesh, (hpsdf_inside_test)7, 0, 0, NULL, &none));
  CHECK_STATUS(HPSDF_OPTION_ERROR, "thickness", hpsdf_distance_new(mesh, HPSDF_INSIDE_SHELL, 0, 0, NULL, &none));
  CHECK_STATUS(HPSDF_OPTION_ERROR, "threads: ", hpsdf_distance_new(mesh, HPSDF_INSIDE_AUTOMATIC, 0, -1, NULL, &none));
  CHECK_STATUS(HPSDF_OK, "", hpsdf_mesh_new(NULL, 0, NULL, 0, &empty));
  CHECK_STATUS(HPSDF_MESH_ERROR, "mesh: ", hpsdf_distance_new(empty, HPSDF_INSIDE_AUTOMATIC, 0, 0, NULL, &none));
  hpsdf_mesh_free(empty);
  hpsdf_distance_free(distance);
  hpsdf_mesh_free(mesh);
}

static void test_options(void) {
  hpsdf_options* options = new_options("grid", "3,4,5");
  hpsdf_mesh* mesh = new_cube();
  hpsdf_field* field = NULL;
  CHECK_STATUS(HPSDF_OPTION_ERROR, "target-eror: there is no such option: did you mean 'target-error'?",
               hpsdf_options_set(options, "target-eror", "1"));
  CHECK_STATUS(HPSDF_OPTION_ERROR, "target-error: expected a number above 0, got -1",
               hpsdf_options_set(options, "target-error", "-1"));
  CHECK_STATUS(HPSDF_ARGUMENT_ERROR, "name: ", hpsdf_options_set(options, NULL, "1"));
  CHECK_STATUS(HPSDF_ARGUMENT_ERROR, "options: ", hpsdf_options_set(NULL, "grid", "1"));
  CHECK_STATUS(HPSDF_OK, "", hpsdf_options_set(options, "tolerance", "1%"));
  CHECK_STATUS(HPSDF_OK, "", hpsdf_options_set(options, "strategy", "hp"));
  CHECK_STATUS(HPSDF_OPTION_ERROR, "strategy: has no effect with a tolerance",
               hpsdf_build_mesh(mesh, NULL, options, NULL, &field));
  CHECK_STATUS(HPSDF_OK, "", hpsdf_options_set(options, "strategy", NULL));
  CHECK_STATUS(HPSDF_OK, "", hpsdf_build_mesh(mesh, NULL, options, NULL, &field));
  hpsdf_field_free(field);
  hpsdf_mesh_free(mesh);
  hpsdf_options_free(options);
}

static void test_functions(void) {
  const double flat[6] = {0, 0, 0, 1, 1, 0}, point[3] = {0, 0.75, 0};
  double radius = 1, value = 0, domain[6], values[1];
  hpsdf_options* options = new_options("target-error", "1e-6");
  hpsdf_field* field = NULL;
  CHECK_STATUS(HPSDF_OK, "", hpsdf_build_function(sphere, &radius, box, options, NULL, &field));
  CHECK_STATUS(HPSDF_OK, "", hpsdf_field_values(field, point, 1, &value));
  CHECK(fabs(value + 0.25) < 0.01);
  CHECK_STATUS(HPSDF_OK, "", hpsdf_field_domain(field, domain));
  CHECK(memcmp(domain, box, sizeof box) == 0);
  CHECK(hpsdf_field_bytes(field) > 1000 && hpsdf_field_bytes(NULL) == 0);
  CHECK_STATUS(HPSDF_OK, "", hpsdf_field_values(field, NULL, 0, NULL));
  CHECK_STATUS(HPSDF_OK, "", hpsdf_field_gradients(field, NULL, 0, NULL, NULL));
  CHECK_STATUS(HPSDF_ARGUMENT_ERROR, "values: ", hpsdf_field_values(field, point, 1, NULL));
  CHECK_STATUS(HPSDF_ARGUMENT_ERROR, "gradients: ", hpsdf_field_gradients(field, point, 1, values, NULL));
  CHECK_STATUS(HPSDF_LIMIT_ERROR, "points: ", hpsdf_field_values(field, point, SIZE_MAX, values));
  CHECK_STATUS(HPSDF_ARGUMENT_ERROR, "field: ", hpsdf_field_values(NULL, point, 1, values));
  CHECK_STATUS(HPSDF_ARGUMENT_ERROR, "box: ", hpsdf_field_domain(field, NULL));
  CHECK_STATUS(HPSDF_ARGUMENT_ERROR, "file: ", hpsdf_field_save(field, NULL, 0));
  CHECK_STATUS(HPSDF_FILE_ERROR, "no-such-folder/x.hpsdf: ", hpsdf_field_save(field, "no-such-folder/x.hpsdf", 0));
  hpsdf_field_free(field);

  CHECK_STATUS(HPSDF_CALLBACK_ERROR, "the function of the distance has returned 42",
               hpsdf_build_function(broken, NULL, box, options, NULL, &field));
  CHECK(field == NULL);
  CHECK_STATUS(HPSDF_GENERAL_ERROR, "", hpsdf_build_function(not_a_number, NULL, box, options, NULL, &field));
  CHECK(strstr(hpsdf_last_error(), "finite") != NULL);
  CHECK_STATUS(HPSDF_OPTION_ERROR, "the domain is empty, flat or not finite",
               hpsdf_build_function(sphere, &radius, flat, options, NULL, &field));
  CHECK_STATUS(HPSDF_ARGUMENT_ERROR, "box: ", hpsdf_build_function(sphere, &radius, NULL, options, NULL, &field));
  CHECK_STATUS(HPSDF_ARGUMENT_ERROR, "function: ", hpsdf_build_function(NULL, NULL, box, options, NULL, &field));
  CHECK_STATUS(HPSDF_OK, "", hpsdf_options_set(options, "memory-limit", "1000"));
  CHECK_STATUS(HPSDF_LIMIT_ERROR, "", hpsdf_build_function(sphere, &radius, box, options, NULL, &field));
  CHECK_STATUS(HPSDF_FILE_ERROR, "no-such.hpsdf: ", hpsdf_field_load("no-such.hpsdf", &field));
  CHECK_STATUS(HPSDF_ARGUMENT_ERROR, "file: ", hpsdf_field_load(NULL, &field));
  hpsdf_options_free(options);
}

struct reports {
  int count;
  int cancel_after; /* reports; 0: never */
};

static void count_report(void* user, const char* task, double fraction) {
  struct reports* reports = user;
  if (task[0] != '\0' && fraction >= 0 && fraction <= 1) ++reports->count;
}

static int is_cancelled(void* user) {
  const struct reports* reports = user;
  return reports->cancel_after > 0 && reports->count >= reports->cancel_after;
}

static void test_progress(void) {
  struct reports reports = {0, 0};
  double radius = 1;
  const hpsdf_progress progress = {&reports, count_report, is_cancelled}, nothing = {NULL, NULL, NULL};
  hpsdf_options* options = new_options("target-error", "1e-7");
  hpsdf_field* field = NULL;
  CHECK_STATUS(HPSDF_OK, "", hpsdf_options_set(options, "threads", "1"));
  CHECK_STATUS(HPSDF_OK, "", hpsdf_build_function(sphere, &radius, box, options, &progress, &field));
  CHECK(reports.count > 3);
  hpsdf_field_free(field);
  reports.count = 0;
  reports.cancel_after = 2;
  CHECK_STATUS(HPSDF_CANCELLED, "cancelled", hpsdf_build_function(sphere, &radius, box, options, &progress, &field));
  CHECK(field == NULL && reports.count < 20);
  CHECK_STATUS(HPSDF_OK, "", hpsdf_options_set(options, "target-error", "1e-4"));
  CHECK_STATUS(HPSDF_OK, "", hpsdf_build_function(sphere, &radius, box, options, &nothing, &field));
  hpsdf_field_free(field);
  hpsdf_options_free(options);
}

static void free_nothing(void) {
  hpsdf_mesh_free(NULL);
  hpsdf_distance_free(NULL);
  hpsdf_options_free(NULL);
  hpsdf_field_free(NULL);
}

/* Prints the values of a torus at the points of a lattice, with all their digits. */
static void print_values(void) {
  enum { POINTS = 125 };
  double points[3 * POINTS], values[POINTS], batch[POINTS], gradients[3 * POINTS], distances[POINTS];
  double closest[3 * POINTS], barycentric[3 * POINTS];
  uint32_t triangles[POINTS];
  hpsdf_mesh* mesh = NULL;
  hpsdf_options* options = new_options("target-error", "1e-5");
  hpsdf_distance* distance = NULL;
  hpsdf_field* field = NULL;
  int i;
  for (i = 0; i < 3 * POINTS; ++i) points[i] = 0.53 * (i % 3 == 0 ? i / 75 : i % 3 == 1 ? i / 15 % 5 : i / 3 % 5) - 1.1;
  CHECK_STATUS(HPSDF_OK, "", hpsdf_mesh_load("builtin:torus", NULL, &mesh));
  CHECK_STATUS(HPSDF_OK, "", hpsdf_distance_new(mesh, HPSDF_INSIDE_AUTOMATIC, 0, 0, NULL, &distance));
  CHECK_STATUS(HPSDF_OK, "", hpsdf_build_distance(distance, NULL, options, NULL, &field));
  CHECK_STATUS(HPSDF_OK, "", hpsdf_field_values(field, points, POINTS, values));
  CHECK_STATUS(HPSDF_OK, "", hpsdf_field_gradients(field, points, POINTS, batch, gradients));
  CHECK(memcmp(values, batch, sizeof values) == 0);
  CHECK_STATUS(HPSDF_OK, "",
               hpsdf_distance_closest(distance, points, POINTS, distances, closest, triangles, barycentric));
  for (i = 0; i < POINTS; ++i)
    printf("%.17g %.17g %.17g %.17g  %.17g %.17g %.17g %.17g %u %.17g %.17g %.17g\n", values[i], gradients[3 * i],
           gradients[3 * i + 1], gradients[3 * i + 2], distances[i], closest[3 * i], closest[3 * i + 1],
           closest[3 * i + 2], (unsigned)triangles[i], barycentric[3 * i], barycentric[3 * i + 1],
           barycentric[3 * i + 2]);
  hpsdf_field_free(field);
  hpsdf_distance_free(distance);
  hpsdf_options_free(options);
  hpsdf_mesh_free(mesh);
}

int main(void) {
  CHECK(hpsdf_last_error()[0] == '\0');
  test_meshes();
  test_distances();
  test_options();
  test_functions();
  test_progress();
  free_nothing();
  print_values();
  return failures == 0 ? 0 : 1;
}
