#ifndef HPSDF_H
#define HPSDF_H
/* The C interface of hpsdf, which turns triangle meshes into hierarchical hp-adaptive signed distance fields. It serves
 * programs in C, and in all languages that can call C: Python (ctypes), Rust, Julia, C# and others. The library is
 * libhpsdf.so. Programs in C++ may use the header <hpsdf/hpsdf.h> of the C++ library instead.
 *
 * Objects. Meshes, options, distances and fields are opaque. A function whose last parameter is a pointer to a pointer
 *   creates an object, which the caller owns and frees with the function hpsdf_…_free. Freeing NULL does nothing.
 *   Objects do not refer to each other: a mesh may be freed as soon as its distance or its field is there. If such a
 *   function fails, it sets the pointer to NULL.
 *
 * Errors. Functions that can fail return a status, which is HPSDF_OK (0) unless the call failed. hpsdf_last_error then
 *   returns a message. What the results hold after a failure is not specified. No C++ exception leaves the library, and
 *   the library neither prints nor ends the process.
 *
 * Arrays. Points, vertices and gradients are arrays of n times three double: x, y and z of the first, then of the
 *   second. A box is an array of six double: the lower corner, then the upper one. The library copies what it keeps.
 *   Arrays for results must not overlap other arrays. An array of no elements may be NULL.
 *
 * Units. Coordinates and distances have the unit of the mesh. Distances are negative inside.
 *
 * Threads. All functions may be called from any thread. Several threads may use one mesh, distance or field at the same
 *   time, but one that frees an object or sets options must be alone with it. Constructions use all threads of the
 *   machine unless the option "threads" says otherwise; queries use the calling thread alone.
 */

#include <stddef.h>
#include <stdint.h>

#if defined(__GNUC__)
#define HPSDF_API __attribute__((visibility("default")))
#else
#define HPSDF_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Versions and errors ---- */

typedef enum hpsdf_status {
  HPSDF_OK = 0,
  HPSDF_GENERAL_ERROR = 1,  /* none of the errors below */
  HPSDF_OPTION_ERROR = 2,   /* an option, a box or a parameter of a shape has a value that is not accepted */
  HPSDF_FILE_ERROR = 3,     /* a file cannot be read, is damaged, or cannot be written */
  HPSDF_MESH_ERROR = 4,     /* a mesh or a shape cannot be used */
  HPSDF_FIELD_ERROR = 5,    /* a field does not support the operation */
  HPSDF_LIMIT_ERROR = 6,    /* the work would exceed the memory, or the largest count that is possible */
  HPSDF_CANCELLED = 7,      /* hpsdf_progress.cancelled asked for it */
  HPSDF_ARGUMENT_ERROR = 8, /* an argument is NULL, or is no constant of its enumeration */
  HPSDF_CALLBACK_ERROR = 9  /* a function of the caller's has returned an error */
} hpsdf_status;

/* Returns the version of the library, such as "0.2.0". Before 1.0, libraries whose second number differs are not
 * compatible; their files and symbols have other versions, so that a program never meets the wrong one. */
HPSDF_API const char* hpsdf_version(void);

/* Returns the message of the last call that failed in the calling thread, or "" if none has. It is one line of UTF-8
 * that says what is wrong, where it is wrong, and what to do about it. It is valid until another call fails in this
 * thread, or until the thread ends. */
HPSDF_API const char* hpsdf_last_error(void);

/* ---- Progress ---- */

/* Functions of the caller's, by which a long call tells how far it is and asks whether to stop. Either may be NULL.
 * They are called from any thread, until the long call returns; if it uses one thread, from the calling thread alone.
 * They may call this library. No exception of C++ and no longjmp may leave them. */
typedef struct hpsdf_progress {
  void* user; /* is passed to both functions */
  /* Receives the name of the present task and the fraction of the work that is done, 0 to 1. Calls never overlap. */
  void (*report)(void* user, const char* task, double fraction);
  /* Is called often, and possibly by several threads at a time. Once it returns another number than 0, the long call
   * ends with HPSDF_CANCELLED. */
  int (*cancelled)(void* user);
} hpsdf_progress;

/* ---- Meshes ---- */

typedef struct hpsdf_mesh hpsdf_mesh;

/* Makes a mesh from arrays: vertex_count times x, y, z, and triangle_count times the indices of three vertices,
 * counted from 0 and counter-clockwise as seen from outside. Fails with HPSDF_MESH_ERROR for an index out of range.
 * Vertices of equal position count as different ones; for triangles whose corners are not joined, see
 * hpsdf_mesh_cleaned. */
HPSDF_API hpsdf_status hpsdf_mesh_new(const double* vertices, size_t vertex_count, const uint32_t* triangles,
                                      size_t triangle_count, hpsdf_mesh** mesh);

/* Reads a mesh file (.obj, .ply, .stl, .off, .gltf, .glb or .3ds) and cleans the mesh, or makes a built-in shape such
 * as "builtin:torus". A damaged .3ds file, or a .glb file that Draco has compressed, can crash the libraries that read
 * them: read untrusted ones in another process. progress may be NULL. */
HPSDF_API hpsdf_status hpsdf_mesh_load(const char* file, const hpsdf_progress* progress, hpsdf_mesh** mesh);

/* Makes a copy in which vertices of equal position are joined, degenerate and duplicate triangles and unused vertices
 * are dropped, and which is reversed if its volume is negative. */
HPSDF_API hpsdf_status hpsdf_mesh_cleaned(const hpsdf_mesh* mesh, hpsdf_mesh** cleaned);

/* Return the numbers of vertices and triangles, and the arrays, which are valid until the mesh is freed. Return 0 and
 * NULL for NULL. */
HPSDF_API size_t hpsdf_mesh_vertex_count(const hpsdf_mesh* mesh);
HPSDF_API size_t hpsdf_mesh_triangle_count(const hpsdf_mesh* mesh);
HPSDF_API const double* hpsdf_mesh_vertices(const hpsdf_mesh* mesh);
HPSDF_API const uint32_t* hpsdf_mesh_triangles(const hpsdf_mesh* mesh);

HPSDF_API void hpsdf_mesh_free(hpsdf_mesh* mesh);

/* ---- Exact distances ---- */

/* The exact signed distance to a mesh. */
typedef struct hpsdf_distance hpsdf_distance;

/* The test that decides whether a point is inside. */
typedef enum hpsdf_inside_test {
  HPSDF_INSIDE_AUTOMATIC = 0,    /* by pseudonormals where these are certain to be right, else by winding numbers */
  HPSDF_INSIDE_PSEUDONORMAL = 1, /* by pseudonormals: for closed meshes that do not intersect themselves */
  HPSDF_INSIDE_WINDING = 2,      /* by winding numbers: for any mesh, whose holes are closed */
  HPSDF_INSIDE_SHELL = 3,        /* a wall of a thickness around the surface, which may be open */
  HPSDF_INSIDE_OUTER_HULL = 4    /* by winding numbers, without triangles that have the inside on both sides */
} hpsdf_inside_test;

/* Prepares the distance to a mesh. thickness is that of the wall for HPSDF_INSIDE_SHELL, and 0 for all other tests.
 * threads is the greatest number of threads to use, 0 for all. progress may be NULL. Fails with HPSDF_MESH_ERROR for a
 * mesh without triangles, or with coordinates that are not finite. */
HPSDF_API hpsdf_status hpsdf_distance_new(const hpsdf_mesh* mesh, hpsdf_inside_test inside_test, double thickness,
                                          int threads, const hpsdf_progress* progress, hpsdf_distance** distance);

/* Computes the signed distances of count points. It is fastest if successive points are close to each other. */
HPSDF_API hpsdf_status hpsdf_distance_values(const hpsdf_distance* distance, const double* points, size_t count,
                                             double* distances);

/* Finds the closest points of the mesh to count points: the signed distances (count numbers), the closest points (count
 * times three), the indices of their triangles (count) and their barycentric coordinates in these (count times three).
 * Each array of results may be NULL, and is left out then. */
HPSDF_API hpsdf_status hpsdf_distance_closest(const hpsdf_distance* distance, const double* points, size_t count,
                                              double* distances, double* closest, uint32_t* triangles,
                                              double* barycentric);

HPSDF_API void hpsdf_distance_free(hpsdf_distance* distance);

/* ---- Options of constructions ---- */

/* The options of a construction: those of the command 'hpsdf build' under "What you ask for", "What you get" and "How
 * it is built", except domain, margin and normalize, and "threads". Names, values and defaults are the same, except
 * that memory-limit is what the machine allows by default. docs/commands.md and 'hpsdf help build' describe them. */
typedef struct hpsdf_options hpsdf_options;

HPSDF_API hpsdf_status hpsdf_options_new(hpsdf_options** options);

/* Sets an option to a value, which is text: ("target-error", "1e-6"), ("tolerance", "0.02%"), ("grid", "6,6,6"),
 * ("strategy", "hp"), ("bounds", "true"), ("threads", "1"). The value NULL takes back what was set. Fails with
 * HPSDF_OPTION_ERROR for an unknown name and for a value out of range. Whether options go together is found out when a
 * field is built. */
HPSDF_API hpsdf_status hpsdf_options_set(hpsdf_options* options, const char* name, const char* value);

HPSDF_API void hpsdf_options_free(hpsdf_options* options);

/* ---- Fields ---- */

/* A signed distance field: an octree of polynomials. */
typedef struct hpsdf_field hpsdf_field;

/* Builds the field of a mesh; of an exact distance, which is the way to choose the inside test; or of any signed
 * distance (see below). box is the field's domain. If it is NULL, the domain is a cube around the mesh whose edge is
 * 1.1 times the mesh's longest side. options may be NULL for defaults, and progress may be NULL. The field does not
 * depend on the number of threads. */
HPSDF_API hpsdf_status hpsdf_build_mesh(const hpsdf_mesh* mesh, const double* box, const hpsdf_options* options,
                                        const hpsdf_progress* progress, hpsdf_field** field);
HPSDF_API hpsdf_status hpsdf_build_distance(const hpsdf_distance* distance, const double* box,
                                            const hpsdf_options* options, const hpsdf_progress* progress,
                                            hpsdf_field** field);

/* A signed distance of the caller's: computes the distances of count points, negative inside. It returns 0, or another
 * number to end the construction, which then fails with HPSDF_CALLBACK_ERROR. It is called from any thread, and by
 * several threads at a time; if the option "threads" is 1, from the calling thread alone. It must give equal points
 * equal distances. It may call this library. No exception of C++ and no longjmp may leave it. */
typedef int (*hpsdf_function)(void* user, const double* points, size_t count, double* distances);

/* Builds the field of a function, to which user is passed. box must not be NULL. */
HPSDF_API hpsdf_status hpsdf_build_function(hpsdf_function function, void* user, const double* box,
                                            const hpsdf_options* options, const hpsdf_progress* progress,
                                            hpsdf_field** field);

/* Reads a field from a .hpsdf file, which is not needed afterwards. */
HPSDF_API hpsdf_status hpsdf_field_load(const char* file, hpsdf_field** field);

/* Like hpsdf_field_load, but the field stays in the file, and its coefficients are read and checked only where they are
 * needed: for fields that are larger than the memory. The file must be uncompressed, and must not be changed while the
 * field exists: if it becomes shorter, the system ends the process with the signal SIGBUS. Functions that work on the
 * field fail with HPSDF_FILE_ERROR where the file is damaged. */
HPSDF_API hpsdf_status hpsdf_field_map(const char* file, hpsdf_field** field);

/* Writes a field as a .hpsdf file, whole or not at all. If compress is not 0, the file is smaller, and writing takes
 * longer. */
HPSDF_API hpsdf_status hpsdf_field_save(const hpsdf_field* field, const char* file, int compress);

/* Computes the values of a field at count points. Outside the domain, the value is an upper bound of the distance. */
HPSDF_API hpsdf_status hpsdf_field_values(const hpsdf_field* field, const double* points, size_t count, double* values);

/* Computes the values of a field at count points, and their gradients (count times three). */
HPSDF_API hpsdf_status hpsdf_field_gradients(const hpsdf_field* field, const double* points, size_t count,
                                             double* values, double* gradients);

/* Writes the domain of a field to box: six numbers. */
HPSDF_API hpsdf_status hpsdf_field_domain(const hpsdf_field* field, double* box);

/* Returns the bytes that a field takes, or 0 for NULL. The coefficients of a mapped field lie in its file. */
HPSDF_API size_t hpsdf_field_bytes(const hpsdf_field* field);

HPSDF_API void hpsdf_field_free(hpsdf_field* field);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif
